"""``stairmap detect`` and ``stairmap inspect`` end to end."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from command_line import check_refused, stairmap
from small_recordings import damage_image, write_recording
from stairmap.export.loading import load_detections
from stairmap.kernels import describe_kernels


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Five frames without poses, the second one damaged."""
    folder = write_recording(tmp_path_factory.mktemp("recordings") / "stairs", num_frames=5, has_poses=False)
    damage_image(folder, 1)
    return folder


@pytest.fixture(scope="module")
def floor(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("recordings") / "floor", num_frames=3, has_stairs=False)


def test_detect_needs_no_poses_and_draws_each_frame(recording, tmp_path):
    outcome = stairmap("detect", recording, "-o", tmp_path / "out")
    assert outcome.code == 0
    assert outcome.last_line == str(tmp_path / "out")
    assert "4 frames, stair edges detected in 4 (100.0 %)" in outcome.stdout
    assert sum(bool(detection) for detection in load_detections(tmp_path / "out")) == 4


def test_pictures_keep_the_numbers_of_the_recording(recording, tmp_path):
    stairmap("detect", recording, "-o", tmp_path / "out")
    names = sorted(path.name for path in (tmp_path / "out" / "overlays").iterdir())
    assert names == ["000000.png", "000002.png", "000003.png", "000004.png"]
    assert cv2.imread(str(tmp_path / "out" / "overlays" / names[0])) is not None


def test_few_frames_are_listed_with_their_measures(recording, tmp_path):
    outcome = stairmap("detect", recording, "-o", tmp_path / "out", "--no-overlays")
    assert not (tmp_path / "out" / "overlays").exists()
    rows = [line.split() for line in outcome.stdout.splitlines() if "ascending" in line]
    assert [row[0] for row in rows] == ["0", "2", "3", "4"]
    assert all(abs(int(row[3]) - 170) <= 10 for row in rows)


def test_rejections_are_told_with_measure_and_limit(floor, tmp_path):
    outcome = stairmap("detect", floor, "-o", tmp_path / "out", "--no-overlays")
    assert outcome.code == 0
    assert "rule against" in outcome.stdout
    assert "min_steps" in outcome.stdout
    assert "0 (0.0 %)" in outcome.stdout


def test_detect_tells_programs_in_json(floor, tmp_path):
    outcome = stairmap("detect", floor, "-o", tmp_path / "out", "--json", "--no-overlays")
    values = json.loads(outcome.stdout)
    assert (values["num_frames"], values["num_detections"]) == (3, 0)
    assert values["rules"][0]["rule"] == "min_steps"


def test_report_method_detects_frame_by_frame(recording, tmp_path):
    outcome = stairmap("detect", recording, "--method", "delmerico2013", "-o", tmp_path / "out")
    assert outcome.code == 0


def test_all_invalid_image_is_a_frame_like_any_other(tmp_path):
    recording = write_recording(tmp_path / "stairs", num_frames=3)
    cv2.imwrite(str(recording / "depth/000001.png"), np.zeros((240, 320), np.uint16))
    for method in ("stairmap", "delmerico2013"):
        outcome = stairmap("detect", recording, "-o", tmp_path / method, "--method", method)
        assert outcome.code == 0
        assert outcome.stdout.startswith("3 frames")
    assert "1 of these all invalid" in stairmap("inspect", recording).stdout


def test_inspect_tells_what_a_recording_holds(floor):
    text = stairmap("inspect", floor).stdout
    assert "3, 3 read" in text
    assert "320 x 240 px" in text
    assert "3 of 3 frames have one" in text
    assert "from the poses (map z) in 3" in text
    assert f"kernels       {describe_kernels()}" in text


def test_inspect_tells_of_missing_poses_damaged_frames_and_unknown_up(recording):
    text = stairmap("inspect", recording).stdout
    assert "none: pass --trajectory or --odometry, or use 'stairmap detect'" in text
    assert "from the floor, frame by frame in 4" in text
    assert "skipped 1 damaged frame" in text


def test_inspect_tells_programs_in_json(floor):
    values = json.loads(stairmap("inspect", floor, "--json").stdout)
    depths = values["depth_m"]
    assert depths == sorted(depths)
    assert values["num_frames_without_pose"] == 0
    assert 0 < values["valid_share"] <= 1


def test_inspect_draws_how_a_frame_was_judged(recording, tmp_path):
    outcome = stairmap("inspect", recording, "--frame", "2", "-o", tmp_path / "frame.png")
    assert outcome.last_line == str(tmp_path / "frame.png")
    assert "ascending" in outcome.stdout
    assert cv2.imread(str(tmp_path / "frame.png")) is not None


def test_inspect_lists_all_rules_against_a_frame(floor):
    outcome = stairmap("inspect", floor, "--frame", "0")
    assert "no stairway; rules against it:" in outcome.stdout
    assert "min_steps" in outcome.stdout


def test_inspect_refuses_a_frame_that_is_not_there_or_damaged(recording, tmp_path):
    check_refused(stairmap("inspect", recording, "--frame", "5"), "0 to 4", "got 5")
    check_refused(stairmap("inspect", recording, "--frame", "1"), "frame 1 cannot be read")
    missing = tmp_path / "nowhere" / "frame.png"
    outcome = stairmap("inspect", recording, "--frame", "0", "-o", missing)
    assert outcome.code == 1
    assert "cannot write" in outcome.stderr


def test_a_picture_is_not_written_over_a_file_of_another_kind(recording, tmp_path):
    notes = tmp_path / "notes.txt"
    notes.write_text("mine")
    outcome = stairmap("inspect", recording, "--frame", "0", "-o", notes)
    assert outcome.code == 2
    assert stairmap("check", recording, "--picture", notes).code == 2
    assert notes.read_text() == "mine"


def test_inspect_doubts_poses_that_are_not_the_optical_frames(floor, tmp_path):
    """The pose of a camera_link, x forward and z up, makes a wall of the floor."""
    assert "floor is tilted" not in stairmap("inspect", floor).stdout
    optical = np.loadtxt(floor / "groundtruth.txt", ndmin=2)
    link_from_optical = Rotation.from_quat([-0.5, 0.5, -0.5, 0.5])
    quaternions = (Rotation.from_quat(optical[:, 4:]) * link_from_optical.inv()).as_quat()
    np.savetxt(tmp_path / "link.tum", np.column_stack([optical[:, :4], quaternions]))
    text = stairmap("inspect", floor, "--trajectory", tmp_path / "link.tum").stdout
    assert "they are poses of the body" in text
    assert "pass --pose-format body" in text
