"""``--odometry``: poses from depth, and what their drift means for the configuration."""

from __future__ import annotations

from stairmap.cli.progress import FrameProgress
from stairmap.cli.requests import MethodRequest
from stairmap.config import Config
from stairmap.recordings.map_up import UP_AUTO
from stairmap.recordings.odometry import OdometryRecording, check_no_trajectory
from stairmap.recordings.odometry_pieces import OdometryResult
from stairmap.recordings.open import open_recording


def open_with_odometry(given: MethodRequest) -> OdometryRecording:
    """Open a recording and find its poses from its depth, with a progress bar.

    Poses of its own are not used.

    Raises
    ------
    StairmapError
        If the recording cannot be opened, or depth gives no poses; also if a trajectory is given as well.
    """
    check_no_trajectory(given.trajectory is not None)
    recording = open_recording(given.recording, bag=given.bag)
    if recording.trajectory is not None:
        # With auto, the poses do not tell up either.
        recording = open_recording(given.recording, up=UP_AUTO, bag=given.bag)
    with FrameProgress(recording.num_frames) as progress:
        return OdometryRecording(
            recording, up=given.up, on_frame=lambda: progress.advance("finding poses from depth")
        )


def config_with_drift(config: Config, odometry: OdometryResult) -> Config:
    """Return a configuration with the drift of these poses, where the user did not set one."""
    measured = {
        "pose_drift": round(odometry.drift, 4),
        "pose_heading_drift_deg": round(odometry.heading_drift_deg, 3),
    }
    update = {key: value for key, value in measured.items() if key not in config.modeling.model_fields_set}
    return config.model_copy(update={"modeling": config.modeling.model_copy(update=update)})
