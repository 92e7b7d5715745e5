"""What a recording holds, measured over all of its frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, readonly
from stairmap.cli.interrupts import Interrupt
from stairmap.cli.progress import FrameProgress
from stairmap.recordings.base import Recording

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
    """

    num_read: int
    num_all_invalid: int
    valid_share: float
    depth_quartiles: Float64Array
    num_up_from_pose: int
    num_up_from_camera: int
    num_up_unknown: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "depth_quartiles", readonly(self.depth_quartiles))


def measure_frames(recording: Recording, interrupt: Interrupt) -> FrameStatistics:
    """Read all frames, or those until an interrupt; memory does not grow with their number."""
    counts = np.zeros(int(_MAX_DEPTH / _BIN) + 1, dtype=np.int64)
    num_read = num_all_invalid = num_valid = num_pixels = 0
    ups = {"pose": 0, "camera": 0, "unknown": 0}
    trajectory = recording.trajectory
    with FrameProgress(recording.num_frames) as progress:
        for frame in recording:
            if interrupt:
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
            progress.advance()
    return FrameStatistics(
        num_read=num_read,
        num_all_invalid=num_all_invalid,
        valid_share=num_valid / num_pixels if num_pixels else float("nan"),
        depth_quartiles=_quartiles(counts),
        num_up_from_pose=ups["pose"],
        num_up_from_camera=ups["camera"],
        num_up_unknown=ups["unknown"],
    )


def _quartiles(counts: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Float64Array:
    """(5,) quartiles of a histogram of depth, with both ends."""
    total = int(counts.sum())
    if total == 0:
        return np.full(5, np.nan)
    ranks = np.clip(np.array([0.0, 0.25, 0.5, 0.75, 1.0]) * total, 1, total)
    return np.asarray((np.searchsorted(np.cumsum(counts), ranks) + 0.5) * _BIN)
