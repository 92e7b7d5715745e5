"""Open the recording that a command was asked for."""

from __future__ import annotations

from stairmap.cli.progress import FrameProgress, OpeningProgress
from stairmap.cli.requests import MethodRequest
from stairmap.recordings.base import Recording
from stairmap.recordings.odometry import OdometryRecording, check_no_trajectory, open_without_poses
from stairmap.recordings.open import open_recording


def open_requested(given: MethodRequest, *, up: str | None = None) -> Recording:
    """Open a recording, with a progress bar if it takes long.

    Parameters
    ----------
    given
        What was asked for.
    up
        See ``open_recording``; what was asked for if not given.

    Raises
    ------
    StairmapError
        See ``open_recording``.
    """
    with OpeningProgress(given.recording.name) as progress:
        return open_recording(
            given.recording,
            trajectory=given.trajectory,
            up=given.up if up is None else up,
            pose_format=given.pose_format,
            bag=given.bag,
            watch=progress.update,
        )


def open_with_odometry(given: MethodRequest) -> OdometryRecording:
    """Open a recording and find its poses from its depth, with a progress bar.

    Raises
    ------
    StairmapError
        If the recording cannot be opened, or depth gives no poses; also if a trajectory is given as well.
    """
    check_no_trajectory(given.trajectory is not None)
    recording = open_without_poses(given.recording, bag=given.bag)
    with FrameProgress(recording.num_frames) as progress:
        return OdometryRecording(
            recording, up=given.up, on_frame=lambda: progress.advance("finding poses from depth")
        )
