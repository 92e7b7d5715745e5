"""Fixtures of the tests of the ROS 2 node."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from ros_environment import ENVIRONMENT, ROOT, Drive, RosEnvironment

from stairmap.evaluation.trials import TrialSpec

DRIVE = TrialSpec(
    suite="ros", scene="free_standing", sensor="kinect_v1", robot="spot", seed=1, width=320, num_frames=40
)
"""A robot that comes up to a free-standing flight of 8 risers."""

sys.path.insert(0, str(ROOT / "ros/stairmap_ros"))


@pytest.fixture(scope="session")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    """A drive with true poses: 16-bit depth, mm."""
    simulation = DRIVE.simulation()
    file = tmp_path_factory.mktemp("drive") / "drive.npz"
    depth = [np.nan_to_num(frame.frame.depth * 1000.0) for frame in simulation.frames()]
    camera = simulation.sensor.camera
    np.savez(
        file,
        depth=np.rint(depth).astype(np.uint16),
        map_from_camera=simulation.true_poses,
        intrinsics=[camera.fx, camera.fy, camera.cx, camera.cy],
    )
    return Drive(file, simulation.scene.stairways[0].flights[0])


@pytest.fixture(scope="session")
def wheels() -> None:
    """Skip where the environment could not be made."""
    reason = ENVIRONMENT / "unavailable.txt"
    if reason.exists():
        pytest.skip(f"no ROS 2 here: {reason.read_text().strip()}")
    if not (ENVIRONMENT / ".installed").exists():
        pytest.skip("no ROS 2 here: run tests/ros/make_environment.py, or make test")


@pytest.fixture
def ros(wheels: None, drive: Drive, tmp_path: Path) -> Iterator[RosEnvironment]:
    """Give a ROS 2 of one's own with a drive; show the node's output where a test fails."""
    yield from _environment(RosEnvironment(tmp_path, drive), tmp_path)


@pytest.fixture
def ros_world(wheels: None, tmp_path: Path) -> Iterator[RosEnvironment]:
    """Give a ROS 2 of one's own for robots in a simulated world."""
    yield from _environment(RosEnvironment(tmp_path), tmp_path)


def _environment(environment: RosEnvironment, tmp_path: Path) -> Iterator[RosEnvironment]:
    yield environment
    environment.stop()
    for log in sorted(tmp_path.glob("*.log")):
        text = log.read_text()
        sys.stdout.write(f"{log.name}:\n{text}")
        assert "Traceback" not in text
