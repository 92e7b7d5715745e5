"""Intrinsics as ROS sends them: ``sensor_msgs/CameraInfo`` of ROS 1 (``K D P``) and ROS 2 (``k d p``).

Shared by the reader of bags and the ROS 2 node, with no ROS in it: any object with the message's fields
will do. Depth images must be rectified, as those of depth cameras are; distortion is not undone.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.camera import PinholeCamera
from stairmap.errors import CalibrationError
from stairmap.recordings.camera_file import MAX_FIELD_OF_VIEW


def camera_from_info(message: Any, image_size: tuple[int, int] | None = None) -> PinholeCamera:
    """Return the camera of a depth image.

    The projection matrix counts, where it is set, as for all of ROS's own nodes: it is the one that
    belongs to the rectified image. Region of interest and binning are taken into account.

    Parameters
    ----------
    message
        ``sensor_msgs/CameraInfo``.
    image_size
        Width and height of the images, if they are known.

    Raises
    ------
    CalibrationError
        If the camera is not calibrated, its values are impossible, or it belongs to images of another size.
    """
    matrix = _matrix(message, "p", 12)
    if matrix[0] == 0:
        matrix = _matrix(message, "k", 9)
    columns = len(matrix) // 3
    fx, cx, fy, cy = matrix[0], matrix[2], matrix[columns + 1], matrix[columns + 2]
    if fx == 0 or fy == 0:
        raise CalibrationError(
            "CameraInfo is not calibrated: its focal length is 0; give the driver a calibration"
        )
    width, height, fx, fy, cx, cy = _cropped_and_binned(message, fx, fy, cx, cy)
    camera = PinholeCamera(width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy)
    for name, size, focal in (("fx", width, fx), ("fy", height, fy)):
        if 2 * math.atan2(size / 2, focal) > MAX_FIELD_OF_VIEW:
            raise CalibrationError(
                f"CameraInfo's {name} must be in pixels, got {focal:g} for an image of {size} pixels"
            )
    if image_size is not None and image_size != (width, height):
        raise CalibrationError(
            f"CameraInfo is for images of {width}x{height}, but the depth images are "
            f"{image_size[0]}x{image_size[1]}; it must be the depth camera's own"
        )
    return camera


def find_camera_info_oddities(message: Any) -> tuple[str, ...]:
    """Return what looks strange but can be used, one sentence each."""
    distortion = np.asarray(_field(message, "d"), dtype=np.float64)
    if not distortion.any():
        return ()
    return (
        f"CameraInfo has distortion (up to {np.abs(distortion).max():.3g}), which is not undone: depth "
        "images must be rectified",
    )


def _field(message: Any, name: str) -> Any:
    return getattr(message, name) if hasattr(message, name) else getattr(message, name.upper())


def _matrix(message: Any, name: str, size: int) -> Float64Array:
    values = np.asarray(_field(message, name), dtype=np.float64).ravel()
    if values.size != size:
        raise CalibrationError(f"CameraInfo's {name.upper()} must have {size} numbers, got {values.size}")
    return values


def _cropped_and_binned(
    message: Any, fx: float, fy: float, cx: float, cy: float
) -> tuple[int, int, float, float, float, float]:
    width, height = int(message.width), int(message.height)
    roi = getattr(message, "roi", None)
    if roi is not None and roi.width and roi.height:
        width, height = int(roi.width), int(roi.height)
        cx, cy = cx - roi.x_offset, cy - roi.y_offset
    x_binning = max(int(getattr(message, "binning_x", 0)), 1)
    y_binning = max(int(getattr(message, "binning_y", 0)), 1)
    return (
        width // x_binning,
        height // y_binning,
        float(fx / x_binning),
        float(fy / y_binning),
        float((cx + 0.5) / x_binning - 0.5),
        float((cy + 0.5) / y_binning - 0.5),
    )
