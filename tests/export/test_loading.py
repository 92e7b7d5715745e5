"""What is read from the files of a run: limits of numbers, ids, and which folder is that of a killed run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from stairmap.export.loading import (
    ResultsError,
    RunResults,
    check_unique_ids,
    is_unfinished,
    load_run_trajectory,
    load_stairways,
)
from stairmap.export.results import create_run_folder
from stairmap.stairway import Stairway


def saved(tmp_path: Path, stairway: Stairway, **changes: object) -> Path:
    """A file of results, with some values changed."""
    path = create_run_folder(tmp_path / "run", "x").write_stairways([stairway], num_frames=9)
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))
    return path


@pytest.mark.parametrize(
    ("height", "is_read"), [(0.0, False), (0.01, True), (99.0, True), (100.0, True), (100.5, False)]
)
def test_a_camera_is_at_most_100_m_above_the_ground(
    tmp_path: Path, stairway: Stairway, height: float, is_read: bool
) -> None:
    path = saved(tmp_path, stairway, camera_height=height)
    if is_read:
        assert load_stairways(path).camera_height == height
    else:
        with pytest.raises(ResultsError, match="camera_height"):
            load_stairways(path)


def test_what_a_file_does_not_tell_of_the_ground_is_none(tmp_path: Path, stairway: Stairway) -> None:
    path = saved(tmp_path, stairway)
    values = json.loads(path.read_text())
    del values["drops"], values["camera_height"]
    path.write_text(json.dumps(values))
    results = load_stairways(path)
    assert (results.drops, results.camera_height, results.is_finished) == ((), None, True)
    plain = RunResults(software="a", frame_id="map", num_frames=0, stairways=())
    assert (plain.drops, plain.camera_height, plain.is_finished) == ((), None, True)


@pytest.mark.parametrize("schema", [0, 3, True, "2", None])
def test_another_schema_is_refused_with_those_that_are_read(
    tmp_path: Path, stairway: Stairway, schema: object
) -> None:
    with pytest.raises(ResultsError, match="reads schemas 1 and 2"):
        load_stairways(saved(tmp_path, stairway, schema=schema))


def test_an_id_that_two_stairways_have_is_named() -> None:
    check_unique_ids([3, 1, 2])
    check_unique_ids([])
    for ids in ([3, 1, 3], [1, 3, 3], [3, 3]):
        with pytest.raises(ValueError, match="two have the id 3"):
            check_unique_ids(ids)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ((), False),
        (("history.jsonl",), True),
        (("trajectory.tum",), True),
        (("history.jsonl", "trajectory.tum"), True),
        (("stairways.json", "trajectory.tum"), False),
        (("detections.jsonl",), False),
    ],
)
def test_a_run_that_was_killed_left_its_history_or_its_way_alone(
    tmp_path: Path, names: tuple[str, ...], expected: bool
) -> None:
    for name in names:
        (tmp_path / name).write_text("")
    assert is_unfinished(tmp_path) == expected


def test_a_run_without_poses_has_no_trajectory(tmp_path: Path) -> None:
    assert load_run_trajectory(tmp_path) is None
    (tmp_path / "trajectory.tum").write_text("1.0 0 0 0 0 0 0 1\n2.0 1 0 0 0 0 0 1\n3.0 2 0")
    trajectory = load_run_trajectory(tmp_path)
    assert trajectory is not None
    assert trajectory.stamps_ns.tolist() == [1_000_000_000, 2_000_000_000]
