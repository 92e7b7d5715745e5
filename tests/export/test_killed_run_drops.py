"""A run that was killed keeps the edges that it saw: what a robot is kept off must not be lost with it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from analytic_stairs import pose_looking
from drop_scenes import deep_dock, dock
from solid_scenes import frame_of
from stairmap.export.finishing import finish_run_folder
from stairmap.export.loading import ResultsError, load_detections, load_stairways
from stairmap.export.results import DETECTIONS_FILE, STAIRWAYS_FILE, create_run_folder
from stairmap.session import MapSession


def killed_run(folder, solid):
    """A session that drives up to an edge, and the folder of its run, which was killed there."""
    session = MapSession()
    with create_run_folder(folder, "dock") as run:
        for number, distance in enumerate(np.linspace(2.0, 1.2, 8)):
            pose = pose_looking((-distance, 0.0, 0.6), down=np.radians(25.0))
            frame = frame_of([solid], pose, stamp_ns=number * 10**8, has_up=False)
            run.append_detection(session.add(frame, pose))
            run.append_pose(frame.stamp_ns, pose)
    return session


@pytest.mark.parametrize("solid", [dock(0.8), deep_dock()], ids=["dock", "void"])
def test_a_killed_run_keeps_its_drops_and_its_cameras_height(tmp_path, solid):
    session = killed_run(tmp_path / "run", solid)
    (expected,) = session.drops()
    results = load_stairways(tmp_path / "run")
    (drop,) = results.drops
    assert not results.is_finished
    assert drop.edge == pytest.approx(expected.edge, abs=1e-3)
    assert drop.depth == (None if expected.depth is None else pytest.approx(expected.depth, abs=1e-3))
    assert results.camera_height == pytest.approx(0.6, abs=0.005)
    finish_run_folder(tmp_path / "run")
    assert (tmp_path / "run" / STAIRWAYS_FILE).is_file()
    finished = load_stairways(tmp_path / "run")
    assert finished.is_finished
    assert finished.drops[0].edge == pytest.approx(drop.edge, abs=1e-5)
    assert finished.camera_height == pytest.approx(results.camera_height, abs=1e-5)


def test_without_poses_there_are_no_drops(tmp_path):
    killed_run(tmp_path / "run", dock(0.8))
    (tmp_path / "run" / "trajectory.tum").unlink()
    (tmp_path / "run" / "history.jsonl").write_text("")
    assert load_stairways(tmp_path / "run").drops == ()


@pytest.mark.parametrize(
    "drop", [{"edge": [[0, 0, 1]], "depth": 1.0}, {"edge": [[0, 0, 1], [1, 0, 1]], "depth": 0}]
)
def test_an_edge_that_stairmap_did_not_write_is_named(tmp_path, drop):
    killed_run(tmp_path / "run", dock(0.8))
    file = tmp_path / "run" / DETECTIONS_FILE
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    lines[2]["drops"] = [drop]
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    with pytest.raises(ResultsError, match=r"line 3 cannot be read: drops\.0\."):
        list(load_detections(tmp_path / "run"))


def test_lines_of_earlier_versions_tell_no_edges(tmp_path):
    killed_run(tmp_path / "run", dock(0.8))
    file = tmp_path / "run" / DETECTIONS_FILE
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    for line in lines:
        del line["drops"], line["camera_height"]
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    results = load_stairways(tmp_path / "run")
    assert results.drops == () and results.camera_height is None
