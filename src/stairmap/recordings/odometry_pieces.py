"""The longest piece of a trajectory from depth, how far it drifts, and why frames have no pose."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from stairmap.errors import TrajectoryError
from stairmap.recordings.registration import TrackedFrame, TrackState
from stairmap.trajectory import Trajectory

MIN_FRAMES = 3
"""Fewest frames of a piece of trajectory that is of any use."""

DRIFT = 0.04
"""Drift of a determined motion, m per m: measured, see docs/odometry.md."""

UNDETERMINED_DRIFT = 0.4
"""Drift of a motion that the view does not determine, m per m: measured, see docs/odometry.md."""

HEADING_DRIFT_DEG = 1.2
"""Drift of the heading of a determined motion, deg per m: measured."""

UNDETERMINED_HEADING_DRIFT_DEG = 6.0
"""Drift of the heading where the view does not determine the motion, deg per m: measured."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryResult:
    """The longest piece of trajectory that registration gave, and how good it is.

    Attributes
    ----------
    trajectory
        ``piece_from_camera``, in the optical coordinate frame of the piece's first camera.
    piece
        Number of that piece, from 0.
    num_frames
        Frames that were looked at.
    num_pieces
        Pieces of trajectory; only the longest is used.
    num_too_few_points, num_lost
        Frames without a pose, by reason.
    num_undetermined
        Frames of the trajectory in which a direction of motion was not determined.
    """

    trajectory: Trajectory
    piece: int
    num_frames: int
    num_pieces: int
    num_too_few_points: int
    num_lost: int
    num_undetermined: int

    @property
    def path_length(self) -> float:
        """Way of the camera, m."""
        places = self.trajectory.map_from_camera[:, :3, 3]
        return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())

    @property
    def drift(self) -> float:
        """How far the poses are expected to drift, m per m."""
        return DRIFT + (UNDETERMINED_DRIFT - DRIFT) * self._undetermined_share

    @property
    def heading_drift_deg(self) -> float:
        """How far the heading is expected to drift, deg per m."""
        difference = UNDETERMINED_HEADING_DRIFT_DEG - HEADING_DRIFT_DEG
        return HEADING_DRIFT_DEG + difference * self._undetermined_share

    @property
    def _undetermined_share(self) -> float:
        return self.num_undetermined / len(self.trajectory)

    def to_lines(self) -> tuple[str, ...]:
        """Return what a user should know."""
        num_with = len(self.trajectory)
        lines = [
            f"poses come from the registration of depth: {num_with} of {self.num_frames} frames, "
            f"{self.path_length:.1f} m; expect about {100 * self.drift:.0f} % and "
            f"{self.heading_drift_deg:.1f} deg/m of drift"
        ]
        reasons = {
            "had too few points": self.num_too_few_points,
            "could not be registered": self.num_lost,
            f"belong to {self.num_pieces - 1} other pieces of the way, whose place is not known": (
                self.num_frames - num_with - self.num_too_few_points - self.num_lost
            ),
        }
        missing = [f"{number} {reason}" for reason, number in reasons.items() if number]
        if missing:
            lines.append(f"{self.num_frames - num_with} of {self.num_frames} frames have no pose: ")
            lines[-1] += ", ".join(missing)
        if 2 * self.num_undetermined > num_with:
            lines.append(
                f"in {self.num_undetermined} of {num_with} frames the view does not determine the camera's "
                "motion (a floor alone, a corridor, steps without ends): places are uncertain; rise and "
                "run come from single frames and are not, nor is the width where both ends of the steps "
                "were seen"
            )
        return tuple(lines)


class PieceCollector:
    """Keeps the longest piece of what ``DepthOdometry`` gives, and counts the rest."""

    def __init__(self) -> None:
        self._counts: Counter[TrackState] = Counter()
        self._longest: list[TrackedFrame] = []
        self._current: list[TrackedFrame] = []

    def add(self, tracked: TrackedFrame) -> None:
        """Take in what came of one frame."""
        self._counts[tracked.state] += 1
        if tracked.piece_from_camera is None:
            return
        if tracked.state is TrackState.START:
            self._current = []
        self._current.append(tracked)
        if len(self._current) > len(self._longest):
            self._longest = self._current

    def result(self) -> OdometryResult:
        """Return the longest piece.

        Raises
        ------
        TrajectoryError
            If it has fewer than three frames; the message says why.
        """
        num_frames = sum(self._counts.values())
        num_few, num_lost = self._counts[TrackState.TOO_FEW_POINTS], self._counts[TrackState.LOST]
        if num_frames < MIN_FRAMES:
            raise TrajectoryError(
                f"--odometry: expected at least {MIN_FRAMES} frames, got {num_frames}; "
                "look at single frames with: stairmap detect"
            )
        if len(self._longest) < MIN_FRAMES:
            raise TrajectoryError(
                f"--odometry: expected at least {MIN_FRAMES} successive frames that fit together, but of "
                f"{num_frames} frames {num_few} have too few points and {num_lost} do not fit the one "
                "before; it takes 5 frames per second or more and walls or furniture in view; give poses "
                "with --trajectory, or look at single frames with: stairmap detect"
            )
        return OdometryResult(
            trajectory=Trajectory(
                stamps_ns=np.array([frame.stamp_ns for frame in self._longest]),
                map_from_camera=np.array([frame.piece_from_camera for frame in self._longest]),
            ),
            piece=self._longest[0].piece,
            num_frames=num_frames,
            num_pieces=self._counts[TrackState.START],
            num_too_few_points=num_few,
            num_lost=num_lost,
            num_undetermined=sum(frame.state is TrackState.UNDETERMINED for frame in self._longest),
        )
