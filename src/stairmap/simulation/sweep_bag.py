"""Write a simulated drive with a LiDAR as a bag of ROS 2, as its robot would record it, with its truth."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer

from stairmap.arrays import Transform
from stairmap.output_files import check_new_folder, output_error, write_whole_text
from stairmap.recordings.tum_trajectory import dump_tum_trajectory
from stairmap.simulation.cloud_messages import RobotMessages
from stairmap.simulation.lidars import SWEEP_PERIOD_NS
from stairmap.simulation.recording import TRUE_TRAJECTORY_FILE, TRUTH_FILE
from stairmap.simulation.sweep_visibility import ReturnCounter
from stairmap.simulation.sweeps import LidarDrive
from stairmap.transforms import interpolate_poses, invert_transform

TRANSFORM_PERIOD_NS = 20_000_000
"""Odometry is published at 50 Hz, nanoseconds."""

START_NS = 1_700_000_000_000_000_000
"""When drives begin: drivers of some LiDARs write the time of day to each point."""


def write_lidar_drive(
    folder: Path, drive: LidarDrive, *, seed: int, on_sweep: Callable[[int, int], None] | None = None
) -> Path:
    """Write a bag (MCAP) with sweeps, ``/tf`` and ``/tf_static``, and beside it ``truth.json``.

    Transforms are those that odometry gives: ``odom`` to ``base_link`` at 50 Hz, and the LiDAR's mount.
    ``truth.json`` is that of ``write_simulation`` with the returns of each step instead of what a camera
    sees; its ``start_ns`` is the stamp of the first pose of ``true_trajectory``, which is that of the LiDAR.

    Parameters
    ----------
    folder
        Where to write; must be empty or not there.
    drive
        The drive.
    seed
        What it was made with.
    on_sweep
        Called with the number of sweeps written and of all.

    Raises
    ------
    OutputError
        If the folder is not empty or cannot be written.
    """
    check_new_folder(folder)
    try:
        if folder.exists():
            folder.rmdir()
        folder.parent.mkdir(parents=True, exist_ok=True)
        returns = _write_bag(folder, drive, on_sweep)
    except OSError as error:
        raise output_error(folder, error) from error
    dump_tum_trajectory(folder / TRUE_TRAJECTORY_FILE, drive.true_path)
    stairways = (*drive.scene.stairways, *drive.scene.optional_stairways)
    named = [(stairway.id, index) for stairway in stairways for index in range(len(stairway.flights))]
    truth: dict[str, Any] = {
        "schema": 1,
        "scene": drive.scene.name,
        "seed": seed,
        "sensor": drive.lidar.name,
        "robot": drive.robot.name,
        "num_frames": len(drive),
        "start_ns": START_NS,
        "stairways": [stairway.to_dict() for stairway in drive.scene.stairways],
        "optional_stairways": [stairway.to_dict() for stairway in drive.scene.optional_stairways],
        "true_trajectory": TRUE_TRAJECTORY_FILE,
        "visibility": [
            {"stairway_id": stairway_id, "flight_index": index, **found.to_dict()}
            for (stairway_id, index), found in zip(named, returns.result(), strict=True)
        ],
    }
    write_whole_text(folder / TRUTH_FILE, json.dumps(truth, indent=1, allow_nan=False) + "\n")
    return folder


def _write_bag(folder: Path, drive: LidarDrive, on_sweep: Callable[[int, int], None] | None) -> ReturnCounter:
    messages, lidar = RobotMessages(), drive.lidar
    base_from_lidar = drive.base_from_lidar
    lidar_from_base = invert_transform(base_from_lidar)
    stairways = (*drive.scene.stairways, *drive.scene.optional_stairways)
    returns = ReturnCounter([flight for stairway in stairways for flight in stairway.flights])
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {
            topic: writer.add_connection(topic, name, typestore=messages.store)
            for topic, name in (
                ("/tf_static", "tf2_msgs/msg/TFMessage"),
                ("/tf", "tf2_msgs/msg/TFMessage"),
                (lidar.topic, "sensor_msgs/msg/PointCloud2"),
            )
        }

        def write(topic: str, recorded_ns: int, message: Any) -> None:
            data = messages.store.serialize_cdr(message, message.__msgtype__)
            writer.write(connections[topic], recorded_ns, data)

        static = messages.transforms(START_NS, [("base_link", lidar.frame_id, base_from_lidar)])
        write("/tf_static", START_NS, static)
        for index, found in enumerate(drive.sweeps()):
            sweep = found.sweep
            for late_ns in range(0, SWEEP_PERIOD_NS, TRANSFORM_PERIOD_NS):
                _write_transform(write, messages, drive, sweep.stamp_ns + late_ns, lidar_from_base)
            end_ns = sweep.stamp_ns + SWEEP_PERIOD_NS
            if index + 1 == len(drive):
                _write_transform(write, messages, drive, end_ns, lidar_from_base)
            stamped = type(sweep)(
                stamp_ns=START_NS + sweep.stamp_ns, points=sweep.points, offsets_ns=sweep.offsets_ns
            )
            # A sweep is sent when it is over.
            write(lidar.topic, START_NS + end_ns, messages.cloud(stamped, found.rings, lidar.frame_id))
            returns.add(found.true_points, drive.true_path.map_from_camera[index, :3, 3])
            if on_sweep is not None:
                on_sweep(index + 1, len(drive))
    return returns


def _write_transform(
    write: Callable[[str, int, Any], None],
    messages: RobotMessages,
    drive: LidarDrive,
    stamp_ns: int,
    lidar_from_base: Transform,
) -> None:
    path = drive.odometry_path
    (map_from_lidar,) = interpolate_poses(path.stamps_ns, path.map_from_camera, np.array([stamp_ns]))
    link = ("odom", "base_link", map_from_lidar @ lidar_from_base)
    write("/tf", START_NS + stamp_ns, messages.transforms(START_NS + stamp_ns, [link]))
