from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stairmap.config import Config, load_config
from stairmap.detection.observation import Detection
from stairmap.errors import OutputError
from stairmap.export.loading import ResultsError, load_detections, load_stairways
from stairmap.export.results import create_run_folder, null_for_nan
from stairmap.recordings.tum_trajectory import load_tum_trajectory
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory


def test_stairways_json_has_the_promised_keys(tmp_path: Path, stairway: Stairway) -> None:
    path = create_run_folder(tmp_path / "run", "x").write_stairways([stairway], num_frames=90)
    values = json.loads(path.read_text())
    assert list(values) == [
        "schema", "software", "frame_id", "num_frames", "stairways", "drops", "camera_height",
    ]  # fmt: skip
    assert values["schema"] == 2
    assert values["software"].startswith("stairmap ")
    flight = values["stairways"][0]["flights"][0]
    assert set(flight) == {
        "base", "heading", "rise", "run", "width", "pitch", "num_risers", "width_bounded", "overhang",
        "bottom_seen", "top_seen", "std", "box", "plane", "steps",
    }  # fmt: skip
    assert flight["width_bounded"] == {"left": True, "right": False}


def test_stairways_come_back_as_they_were_written(tmp_path: Path, stairway: Stairway) -> None:
    folder = create_run_folder(tmp_path / "run", "x")
    folder.write_stairways([stairway], num_frames=90, frame_id="odom")
    results = load_stairways(folder.path)
    assert (results.frame_id, results.num_frames) == ("odom", 90)
    assert results.stairways[0].to_dict() == stairway.to_dict()
    assert results.stairways[0].first_seen_ns == stairway.first_seen_ns


def test_a_deviation_that_is_not_known_is_null_in_the_file_and_nan_again(
    tmp_path: Path, stairway: Stairway
) -> None:
    flight = stairway.flights[0]
    unknown = replace(flight, std=replace(flight.std, rise=float("nan"), base=[np.nan] * 3))
    folder = create_run_folder(tmp_path / "run", "x")
    path = folder.write_stairways([replace(stairway, flights=(unknown,))], num_frames=1)
    assert json.loads(path.read_text())["stairways"][0]["flights"][0]["std"]["rise"] is None
    std = load_stairways(path).stairways[0].flights[0].std
    assert np.isnan(std.rise)
    assert np.isnan(std.base).all()


def test_a_file_of_schema_1_is_read_and_what_it_does_not_tell_is_unknown(
    tmp_path: Path, stairway: Stairway
) -> None:
    path = create_run_folder(tmp_path / "run", "x").write_stairways([stairway], num_frames=1)
    values = json.loads(path.read_text())
    values["schema"] = 1
    for flight in values["stairways"][0]["flights"]:
        for name in ("overhang", "bottom_seen", "top_seen"):
            del flight[name]
        del flight["std"]["overhang"]
        for step in flight["steps"]:
            del step["std"]
    path.write_text(json.dumps(values))
    (read,) = load_stairways(path).stairways
    assert read.flights[0].rise == stairway.flights[0].rise
    assert (read.flights[0].bottom_seen, read.flights[0].top_seen) == (None, None)
    assert np.isnan([read.flights[0].overhang, *read.flights[0].steps[0].std]).all()


def test_ends_that_were_seen_or_not_come_back_as_such(tmp_path: Path, stairway: Stairway) -> None:
    for number, (bottom, top) in enumerate([(True, False), (False, True), (None, None)]):
        flight = replace(stairway.flights[0], bottom_seen=bottom, top_seen=top)
        folder = create_run_folder(tmp_path / f"run{number}", "x")
        path = folder.write_stairways([replace(stairway, flights=(flight,))], num_frames=1)
        (read,) = load_stairways(path).stairways
        assert (read.flights[0].bottom_seen, read.flights[0].top_seen) == (bottom, top)


def test_the_same_stairways_give_the_same_file_bit_for_bit(tmp_path: Path, stairway: Stairway) -> None:
    paths = [create_run_folder(tmp_path / n, "x").write_stairways([stairway], num_frames=9) for n in "ab"]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_results_are_never_overwritten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    paths = [create_run_folder(None, "hall").path for _ in range(3)]
    assert [str(path) for path in paths] == [str(Path("results") / f"hall_{n}") for n in (1, 2, 3)]
    paths[1].joinpath("detections.jsonl").unlink()
    paths[1].rmdir()
    assert create_run_folder(None, "hall").path.name == "hall_4"


def test_a_recording_name_cannot_leave_the_results_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("../../etc/x y", "..", "", "/"):
        assert create_run_folder(None, name).path.parent == Path("results")


def test_an_output_folder_that_holds_something_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(OutputError, match="not empty and results are never overwritten"):
        create_run_folder(tmp_path, "x")
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_an_empty_output_folder_is_taken(tmp_path: Path) -> None:
    assert create_run_folder(tmp_path, "x").path == tmp_path


def test_an_output_that_is_a_file_or_lies_below_one_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    for output in (file, file / "below"):
        with pytest.raises(OutputError, match="file") as caught:
            create_run_folder(output, "x")
        assert "\n" not in str(caught.value)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_an_output_error(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="cannot write"):
        create_run_folder(tmp_path / "run", "x")


def test_a_folder_that_vanishes_is_an_output_error(tmp_path: Path) -> None:
    folder = create_run_folder(tmp_path / "run", "x")
    (folder.path / "detections.jsonl").unlink()
    folder.path.rmdir()
    folder.path.write_text("")
    folder.write_summary("text")
    with pytest.raises(OutputError, match=r"cannot write .*summary.txt"):
        folder.close()


def test_every_detection_is_on_disk_before_the_run_ends(tmp_path: Path, detection: Detection) -> None:
    folder = create_run_folder(tmp_path / "run", "x")
    for _ in range(3):
        folder.append_detection(detection)
    lines = (folder.path / "detections.jsonl").read_text().splitlines()
    folder.close()
    assert [json.loads(line) for line in lines] == [null_for_nan(detection.to_dict())] * 3


def test_detections_come_back_as_they_were_written(tmp_path: Path, detection: Detection) -> None:
    with create_run_folder(tmp_path / "run", "x") as folder:
        folder.append_detection(detection)
        folder.append_detection(replace(detection, observations=()))
    found, empty = load_detections(folder.path)
    assert found
    assert not empty
    assert found.stamp_ns == 12
    assert found.observations[0].edges.shape == (3, 2, 3)
    assert found.observations[0].num_steps == 3
    assert np.isnan(found.rejections[0].measured)
    assert found.rejections[0].limit == 6.0


def test_an_unfinished_last_line_is_passed_over(tmp_path: Path, detection: Detection) -> None:
    with create_run_folder(tmp_path / "run", "x") as folder:
        folder.append_detection(detection)
    path = folder.path / "detections.jsonl"
    path.write_text(path.read_text() + '{"stamp_ns": 13, "det')
    assert len(list(load_detections(path))) == 1
    path.write_text('{"stamp_ns": 13}\n')
    with pytest.raises(ResultsError, match="line 1 cannot be read: lacks the key 'observations'"):
        list(load_detections(path))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not a JSON file"),
        ("[]", "must hold one JSON object"),
        ("{}", "no schema"),
        ('{"schema": 3}', "schema 3, this version of stairmap reads schemas 1 and 2"),
        ('{"schema": 1, "software": "", "num_frames": 0, "stairways": []}', "lacks the key 'frame_id'"),
        ('{"schema": 1, "software": "", "frame_id": "", "num_frames": 0, "stairways": [{}]}', "lacks"),
        (
            '{"schema": 1, "software": "", "frame_id": "", "num_frames": 0, "stairways": 5}',
            "stairways: should be a valid list, got 5",
        ),
    ],
)
def test_a_file_that_is_no_stairways_json_says_what_is_wrong(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "stairways.json"
    path.write_text(text)
    with pytest.raises(ResultsError, match=message):
        load_stairways(path)


def test_a_missing_stairways_json_is_named(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match=r"stairways.json"):
        load_stairways(tmp_path)


def test_config_trajectory_log_and_overlays_are_written(tmp_path: Path) -> None:
    trajectory = Trajectory(stamps_ns=[1_000, 2_000], map_from_camera=np.tile(np.eye(4), (2, 1, 1)))
    with create_run_folder(tmp_path / "run", "x") as folder:
        assert load_config(folder.write_config(Config())) == Config()
        assert load_tum_trajectory(folder.write_trajectory(trajectory)).stamps_ns.tolist() == [1_000, 2_000]
        folder.log("one")
        folder.log("two")
        assert folder.write_overlay(12, b"png").name == "000012.png"
    assert (folder.path / "log.txt").read_text() == "one\ntwo\n"
    assert not [path for path in folder.path.rglob("*") if path.name.endswith(".partial")]


def test_the_number_after_the_highest_is_taken_and_other_recordings_do_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("hall_2", "hall_10", "hall_x", "hall_99_1", "big_hall_40", "ha.l_50"):
        (tmp_path / "results" / name).mkdir(parents=True)
    assert create_run_folder(None, "hall").path.name == "hall_11"
    assert create_run_folder(None, "ha.l").path.name == "ha.l_51"


def test_a_number_that_another_run_takes_in_the_meantime_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for number in (1, 2):
        (tmp_path / "results" / f"hall_{number}").mkdir(parents=True)
    monkeypatch.setattr(Path, "iterdir", lambda folder: iter(()))
    assert create_run_folder(None, "hall").path.name == "hall_3"


@pytest.mark.parametrize(
    ("name", "folder"),
    [("a b/c", "a_b_c_1"), ("..x..", "x_1"), ("__y", "y_1"), ("ok-1.2", "ok-1.2_1"), ("", "recording_1")],
)
def test_what_a_folders_name_cannot_hold_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, folder: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert create_run_folder(None, name).path.name == folder


def test_an_output_folder_below_others_that_do_not_exist_is_made(tmp_path: Path) -> None:
    assert create_run_folder(tmp_path / "a" / "b", "x").path.is_dir()


def test_a_run_that_saw_nothing_still_leaves_its_file_of_detections(tmp_path: Path) -> None:
    folder = create_run_folder(tmp_path / "run", "x")
    assert list(load_detections(folder.path)) == []


def test_null_stands_for_whatever_is_not_finite_at_any_depth() -> None:
    values = {"a": [1.5, float("nan"), (float("inf"), "text")], "b": {"c": -float("inf"), "d": 0, "e": True}}
    assert null_for_nan(values) == {"a": [1.5, None, [None, "text"]], "b": {"c": None, "d": 0, "e": True}}


def test_a_file_that_cannot_be_put_in_place_leaves_no_partial_one(tmp_path: Path) -> None:
    folder = create_run_folder(tmp_path / "run", "x")
    (folder.path / "summary.txt").mkdir()
    folder.write_summary("text")
    with pytest.raises(OutputError, match=r"cannot write .*summary.txt"):
        folder.close()
    assert not [path for path in folder.path.iterdir() if path.name.endswith(".partial")]


def test_the_other_files_of_a_run_have_their_names(tmp_path: Path, stairway: Stairway) -> None:
    folder = create_run_folder(tmp_path / "run", "x")
    paths = [folder.write_summary("a"), folder.write_report("b"), folder.write_mesh([stairway])]
    assert [path.name for path in paths] == ["summary.txt", "report.html", "stairways.ply"]
    assert (paths[0].read_text(), paths[1].read_text()) == ("a", "b")
    assert paths[2].read_bytes().startswith(b"ply\n")


def test_each_number_of_an_observation_comes_back(tmp_path: Path, detection: Detection) -> None:
    with create_run_folder(tmp_path / "run", "x") as folder:
        folder.append_detection(detection)
    (found,) = load_detections(folder.path)
    (observation,) = found.observations
    assert (observation.view, observation.rise, observation.run, observation.width) == (
        "ascending",
        0.1,
        0.3,
        1.0,
    )
    assert observation.edges[2, 1] == pytest.approx([0.5, 0.1, 2.6])
    (rejection,) = found.rejections
    assert (rejection.rule, rejection.unit) == ("up", "deg")


def test_a_line_in_the_middle_that_stairmap_did_not_write_is_named(
    tmp_path: Path, detection: Detection
) -> None:
    with create_run_folder(tmp_path / "run", "x") as folder:
        folder.append_detection(detection)
    path = folder.path / "detections.jsonl"
    path.write_text(path.read_text() + "no json\n" + path.read_text())
    with pytest.raises(ResultsError, match=r"detections.jsonl, line 2 cannot be read"):
        list(load_detections(path))


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "stairways.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ResultsError, match="to be UTF-8 text, but it is UTF-16"):
        load_stairways(tmp_path)
