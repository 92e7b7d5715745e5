"""Do the poses belong to the frames: how many frames have one, and does the camera move like a camera?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import IntArray
from stairmap.errors import TrajectoryError
from stairmap.trajectory import MAX_GAP_NS, Trajectory

MAX_MEDIAN_SPEED = 30.0
"""No robot indoors is faster, m/s; one that walks at 0.5 m/s seems to be if its poses are in millimetres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseCoverage:
    """Which of a recording's frames have a pose.

    Attributes
    ----------
    num_frames
        Number of frames.
    num_before, num_between, num_after
        How many have none because they lie before the first pose, between two poses that are too far
        apart, or after the last.
    """

    num_frames: int
    num_before: int
    num_between: int
    num_after: int

    @property
    def num_without(self) -> int:
        """How many frames have no pose."""
        return self.num_before + self.num_between + self.num_after

    def __str__(self) -> str:
        places = {
            "before the first pose": self.num_before,
            f"between poses more than {MAX_GAP_NS * 1e-9:g} s apart": self.num_between,
            "after the last pose": self.num_after,
        }
        reasons = ", ".join(f"{number} {place}" for place, number in places.items() if number)
        return f"{self.num_without} of {self.num_frames} frames have no pose: {reasons or 'none is missing'}"


def find_pose_coverage(trajectory: Trajectory, stamps_ns: IntArray) -> PoseCoverage:
    """Tell which of (N,) frame stamps have a pose, and why the others have none."""
    without = stamps_ns[~trajectory.has_pose(stamps_ns)]
    num_before = int(np.count_nonzero(without < trajectory.stamps_ns[0]))
    num_after = int(np.count_nonzero(without > trajectory.stamps_ns[-1]))
    return PoseCoverage(
        num_frames=len(stamps_ns),
        num_before=num_before,
        num_between=len(without) - num_before - num_after,
        num_after=num_after,
    )


def check_pose_coverage(trajectory: Trajectory, stamps_ns: IntArray) -> None:
    """Raise an error if none of (N,) frame stamps has a pose.

    Raises
    ------
    TrajectoryError
        With the times of images and poses.
    """
    coverage = find_pose_coverage(trajectory, stamps_ns)
    if coverage.num_without < coverage.num_frames:
        return
    first, last = stamps_ns[[0, -1]] * 1e-9
    pose_first, pose_last = trajectory.stamps_ns[[0, -1]] * 1e-9
    raise TrajectoryError(
        f"{coverage}; images run from {first:.3f} to {last:.3f} s, poses from {pose_first:.3f} to "
        f"{pose_last:.3f} s; give poses of the same clock at 10 Hz or more"
    )


def find_implausible_speed(trajectory: Trajectory) -> str | None:
    """Return a sentence if half of the time the camera moves faster than 30 m/s."""
    if len(trajectory) < 2:
        return None
    distances = np.linalg.norm(np.diff(trajectory.map_from_camera[:, :3, 3], axis=0), axis=1)
    speed = float(np.median(distances / (np.diff(trajectory.stamps_ns) * 1e-9)))
    if speed <= MAX_MEDIAN_SPEED:
        return None
    return (
        f"by its poses the camera moves at {speed:.0f} m/s; are they in millimetres? then pass "
        "--pose-format mm"
    )
