"""How far poses from depth drift: small_gicp as ``--odometry`` uses it, and KISS-ICP beside it.

    for scene in davis_rear cluttered; do stairmap simulate $scene -o drives/$scene --factor 0.5; done
    python benchmarks/odometry.py drives/*          # KISS-ICP too: pip install kiss-icp

Takes recordings with known poses, ignores these, and compares: over every stretch of 1 m, the error at its
end against its length (median), after the drift's kind: per cent of the way, degrees per metre. Only frames
with a pose count. Time is that of the processor for one frame, depth to pose, without reading the image.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from stairmap.arrays import Float64Array, Transform
from stairmap.frame import DepthFrame
from stairmap.recordings.map_up import UP_AUTO
from stairmap.recordings.open import open_recording
from stairmap.recordings.registration import MAX_DEPTH, DepthOdometry, TrackState, points_from_frame
from stairmap.recordings.tum_trajectory import load_tum_trajectory
from stairmap.transforms import invert_transform, vector_from_rotation

STRETCH = 1.0
"""Length of the stretches, m."""

KISS_VOXEL_SIZE = 0.08
"""For rooms; its default, a hundredth of the range, is for streets, m."""

Track = Callable[[DepthFrame], tuple[Transform | None, bool]]
"""Gives the pose of the next frame, and whether the view determines its motion."""


def small_gicp() -> Track:
    """``--odometry``."""
    odometry = DepthOdometry()

    def track(frame: DepthFrame) -> tuple[Transform | None, bool]:
        tracked = odometry.track(frame)
        is_usable = tracked.piece == 0  # poses of later pieces have no relation to the first
        return (
            tracked.piece_from_camera if is_usable else None
        ), tracked.state is not TrackState.UNDETERMINED

    return track


def kiss_icp() -> Track:
    """KISS-ICP with the same points and thresholds for a room instead of a street."""
    from kiss_icp.config import KISSConfig  # noqa: PLC0415
    from kiss_icp.kiss_icp import KissICP  # noqa: PLC0415

    config = KISSConfig()
    config.data.max_range, config.data.min_range, config.data.deskew = 1.5 * MAX_DEPTH, 0.2, False
    config.mapping.voxel_size = KISS_VOXEL_SIZE
    config.registration.max_num_threads = 1
    config.adaptive_threshold.initial_threshold, config.adaptive_threshold.min_motion_th = 0.3, 0.02
    odometry = KissICP(config)

    def track(frame: DepthFrame) -> tuple[Transform | None, bool]:
        points = points_from_frame(frame)
        odometry.register_frame(points, np.zeros(len(points)))
        return odometry.last_pose.copy(), True

    return track


def measure(folder: Path, track: Track) -> str:
    """Return one cell: drift, frames whose motion is not determined, time per frame."""
    path = folder / "groundtruth_true.tum"
    truth = load_tum_trajectory(path if path.is_file() else folder / "groundtruth.txt")
    found, true, seconds, num_undetermined = [], [], [], 0
    for frame in open_recording(folder, up=UP_AUTO):
        started = time.process_time()
        pose, is_determined = track(frame)
        seconds.append(time.process_time() - started)
        if pose is not None and truth.has_pose(np.array([frame.stamp_ns]))[0]:
            found.append(pose)
            true.append(truth.pose_at(frame.stamp_ns))
            num_undetermined += not is_determined
    drift, turn = drift_per_metre(np.array(found), np.array(true))
    share = 100 * num_undetermined / len(found)
    time_per_frame = 1e3 * float(np.median(seconds))
    return f"{100 * drift:5.1f} % {np.degrees(turn):5.2f} deg/m {share:4.0f} % {time_per_frame:5.0f} ms"


def drift_per_metre(found: Float64Array, true: Float64Array) -> tuple[float, float]:
    """Return the median error over stretches of the true way: m per m, rad per m; NaN if it is too short."""
    steps = np.linalg.norm(np.diff(true[:, :3, 3], axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    drifts, turns = [np.nan], [np.nan]
    for begin in range(len(true)):
        end = int(np.searchsorted(way, way[begin] + STRETCH))
        if end == len(true):
            break
        moved = invert_transform(found[begin]) @ found[end]
        error = invert_transform(invert_transform(true[begin]) @ true[end]) @ moved
        length = way[end] - way[begin]
        drifts.append(float(np.linalg.norm(error[:3, 3])) / length)
        turns.append(float(np.linalg.norm(vector_from_rotation(error[:3, :3]))) / length)
    return float(np.nanmedian(drifts)), float(np.nanmedian(turns))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recordings", nargs="+", type=Path)
    makers = {"small_gicp": small_gicp}
    if importlib.util.find_spec("kiss_icp") is not None:
        makers["KISS-ICP"] = kiss_icp
    recordings = parser.parse_args().recordings
    print(f"{'recording':28s}" + "".join(f"  {name + ': drift, undetermined, time':44s}" for name in makers))
    for folder in recordings:
        cells = [measure(folder, make()) for make in makers.values()]
        print(f"{folder.name:28s}" + "".join(f"  {cell:44s}" for cell in cells), flush=True)


if __name__ == "__main__":
    main()
