"""Frames without a pose are counted by reason."""

from __future__ import annotations

import numpy as np

from stairmap.recordings.pose_coverage import find_implausible_speed, find_pose_coverage
from stairmap.trajectory import Trajectory


def _trajectory(stamps_s: list[float], step: float = 0.01) -> Trajectory:
    poses = np.tile(np.eye(4), (len(stamps_s), 1, 1))
    poses[:, 0, 3] = step * np.arange(len(stamps_s))
    return Trajectory(stamps_ns=np.rint(np.array(stamps_s) * 1e9).astype(np.int64), map_from_camera=poses)


def test_frames_before_between_and_after_are_told_apart() -> None:
    stamps_ns = (np.array([0.9, 0.95, 1.0, 1.04, 1.1, 1.2, 1.3, 1.5, 1.55, 1.6]) * 1e9).astype(np.int64)
    coverage = find_pose_coverage(_trajectory([1.0, 1.08, 1.16, 1.5, 1.58]), stamps_ns)
    assert (coverage.num_before, coverage.num_between, coverage.num_after) == (2, 2, 1)
    assert coverage.num_without == 5
    assert str(coverage) == (
        "5 of 10 frames have no pose: 2 before the first pose, 2 between poses more than 0.1 s apart, "
        "1 after the last pose"
    )


def test_reasons_that_do_not_occur_are_not_named() -> None:
    coverage = find_pose_coverage(_trajectory([1.0, 1.05]), np.array([0, 10**9]))
    assert str(coverage) == "1 of 2 frames have no pose: 1 before the first pose"


def test_poses_in_millimetres_are_noticed() -> None:
    stamps_s = [0.0, 0.033, 0.066, 0.1]
    assert find_implausible_speed(_trajectory(stamps_s, step=0.02)) is None
    assert find_implausible_speed(_trajectory([0.0])) is None
    sentence = find_implausible_speed(_trajectory(stamps_s, step=20.0))
    assert sentence is not None
    assert "606 m/s; are they in millimetres" in sentence
