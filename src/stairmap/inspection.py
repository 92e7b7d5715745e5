"""Measure what a recording holds, over all of its frames: how much depth there is, what tells up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, readonly
from stairmap.pose_mistakes import PoseWatch
from stairmap.recordings.base import Recording
from stairmap.recordings.depth_unit_watch import DepthUnitWatch

_PIXEL_STRIDE = 8
"""Every so many rows and columns count for the quartiles."""

_BIN = 0.01
_MAX_DEPTH = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameStatistics:
    """What the frames of a recording show.

    Attributes
    ----------
    num_read, num_all_invalid
        Frames that could be read, and those of them without a single valid pixel.
    valid_share
        Share of valid pixels over all frames; NaN without a frame.
    depth_quartiles
        (5,) smallest, lower quartile, median, upper quartile and largest valid depth, m, to 1 cm; NaN
        without a valid pixel.
    num_up_from_pose, num_up_from_camera, num_up_unknown
        Frames by what says which way is up: their pose, the camera file, or nothing yet: the floor will.
    pose_mistake
        A sentence if the poses do not fit the depth images, or the floor lies far from level by them.
    unit_mistake
        A sentence if depth fits the camera's way only in another unit.
    """

    num_read: int
    num_all_invalid: int
    valid_share: float
    depth_quartiles: Float64Array
    num_up_from_pose: int
    num_up_from_camera: int
    num_up_unknown: int
    pose_mistake: str | None
    unit_mistake: str | None

    def __post_init__(self) -> None:
        object.__setattr__(self, "depth_quartiles", readonly(self.depth_quartiles))


def measure_frames(
    recording: Recording,
    *,
    max_depth: float,
    knows_up: bool = False,
    should_stop: Callable[[], bool] = lambda: False,
    on_frame: Callable[[], None] = lambda: None,
) -> FrameStatistics:
    """Read all frames of a recording; memory does not grow with their number.

    Parameters
    ----------
    recording
        Where frames come from.
    max_depth
        Farthest depth at which the floor is looked for, m.
    knows_up
        Whether up comes from the floor or from elsewhere, so that the poses need not know it.
    should_stop
        Asked before each frame; the rest is left out when it says so.
    on_frame
        Called after each frame.
    """
    counts = np.zeros(int(_MAX_DEPTH / _BIN) + 1, dtype=np.int64)
    num_read = num_all_invalid = num_valid = num_pixels = 0
    ups = {"pose": 0, "camera": 0, "unknown": 0}
    trajectory = recording.trajectory
    watch = PoseWatch(
        recording.num_frames,
        map_from_recorded=recording.map_from_recorded,
        max_depth=max_depth,
        knows_up=knows_up,
    )
    unit_watch = DepthUnitWatch()
    for frame in recording:
        if should_stop():
            break
        sample = frame.depth[::_PIXEL_STRIDE, ::_PIXEL_STRIDE]
        bins = np.minimum(sample[np.isfinite(sample)], _MAX_DEPTH) / _BIN
        counts += np.bincount(bins.astype(np.int64), minlength=len(counts))
        num_frame_valid = int(np.count_nonzero(np.isfinite(frame.depth)))
        num_read += 1
        num_all_invalid += num_frame_valid == 0
        num_valid += num_frame_valid
        num_pixels += frame.depth.size
        has_pose = trajectory is not None and trajectory.has_pose(np.array([frame.stamp_ns]))[0]
        ups["unknown" if frame.up is None else "pose" if has_pose else "camera"] += 1
        if trajectory is not None and has_pose:
            map_from_camera = trajectory.pose_at(frame.stamp_ns)
            watch.add(frame, map_from_camera)
            unit_watch.add(frame.depth, frame.camera, frame.stamp_ns, map_from_camera)
        on_frame()
    return FrameStatistics(
        num_read=num_read,
        num_all_invalid=num_all_invalid,
        valid_share=num_valid / num_pixels if num_pixels else float("nan"),
        depth_quartiles=_quartiles(counts),
        num_up_from_pose=ups["pose"],
        num_up_from_camera=ups["camera"],
        num_up_unknown=ups["unknown"],
        pose_mistake=watch.mistake(),
        unit_mistake=unit_watch.advice(),
    )


def _quartiles(counts: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Float64Array:
    """(5,) quartiles of a histogram of depth, with both ends."""
    total = int(counts.sum())
    if total == 0:
        return np.full(5, np.nan)
    ranks = np.clip(np.array([0.0, 0.25, 0.5, 0.75, 1.0]) * total, 1, total)
    return np.asarray((np.searchsorted(np.cumsum(counts), ranks) + 0.5) * _BIN)
