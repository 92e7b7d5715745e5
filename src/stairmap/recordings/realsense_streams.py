"""Which streams of a RealSense device are used: depth, and the accelerometer where there is one."""

from __future__ import annotations

from typing import Any

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.errors import RecordingError

WANTED_WIDTH, WANTED_HEIGHT, WANTED_RATE = 640, 480, 30
"""Size in pixels and rate in Hz of the depth stream; the nearest that the camera offers is taken."""


def find_depth_stream(device: Any, library: Any, *, name: str) -> tuple[Any, Any]:
    """Return sensor and video profile of the depth stream nearest to the wanted size and rate.

    Parameters
    ----------
    device
        ``pyrealsense2.device``.
    library
        The module ``pyrealsense2``.
    name
        What errors call the device.

    Raises
    ------
    RecordingError
        If there is none.
    """
    best: tuple[tuple[int, int], Any, Any] | None = None
    for sensor in device.query_sensors():
        for profile in sensor.get_stream_profiles():
            if profile.stream_type() != library.stream.depth or profile.format() != library.format.z16:
                continue
            video = profile.as_video_stream_profile()
            size = abs(video.width() - WANTED_WIDTH) + abs(video.height() - WANTED_HEIGHT)
            key = (size, abs(profile.fps() - WANTED_RATE))
            if best is None or key < best[0]:
                best = (key, sensor, video)
    if best is None:
        raise RecordingError(f"expected a depth stream (Z16), but {name} has none")
    return best[1], best[2]


def find_accelerometer(device: Any, library: Any) -> tuple[Any, Any] | None:
    """Return sensor and profile of the slowest accelerometer stream, if there is one: up changes slowly."""
    found = [
        (sensor, profile)
        for sensor in device.query_sensors()
        for profile in sensor.get_stream_profiles()
        if profile.stream_type() == library.stream.accel
    ]
    return min(found, key=lambda item: int(item[1].fps()), default=None)


def rotation_to(profile: Any, depth_profile: Any) -> Float64Array:
    """Return the (3, 3) turn of a stream's coordinate frame into the depth camera's optical one.

    Without extrinsics it is the identity: librealsense gives readings in the axes of the depth camera, and
    only a small error of the mount is lost.
    """
    try:
        rotation = profile.get_extrinsics_to(depth_profile).rotation
    except RuntimeError:
        return np.eye(3)
    return np.array(rotation, dtype=np.float64).reshape(3, 3).T  # it is stored by columns
