"""Depth images as ROS sends them: ``sensor_msgs/Image`` and ``CompressedImage`` of ROS 1 and 2.

Shared by the reader of bags and the ROS 2 node, with no ROS in it: any object with the message's fields
will do. Whole numbers are millimetres, floating point is metres (REP 118).
"""

from __future__ import annotations

import struct
from typing import Any, Protocol

import numpy as np

from stairmap.arrays import DepthImage
from stairmap.errors import RecordingError
from stairmap.recordings.depth_png import (
    MAX_PIXEL_VALUE,
    DamagedImageError,
    decode_depth_png,
    decode_png_values,
)
from stairmap.recordings.rvl import decode_rvl

VALUES_PER_METRE = 1000.0
"""Pixel values of a 16-bit depth image are millimetres."""

DEPTH_ENCODINGS = {"16UC1": "u2", "mono16": "u2", "Z16": "u2", "32FC1": "f4"}
"""Encodings of depth, with the type of a pixel."""

_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_COMPRESSED_DEPTH_HEADER = struct.Struct("<iff")


class ImageMessage(Protocol):
    """The fields of ``sensor_msgs/Image`` that count."""

    height: int
    width: int
    encoding: str
    is_bigendian: Any
    step: int
    data: Any


class CompressedImageMessage(Protocol):
    """The fields of ``sensor_msgs/CompressedImage`` that count."""

    format: str
    data: Any


def depth_from_message(message: Any, *, values_per_metre: float = VALUES_PER_METRE) -> DepthImage:
    """Decode a depth image, compressed or not.

    Parameters
    ----------
    message
        ``sensor_msgs/Image`` or ``sensor_msgs/CompressedImage``.
    values_per_metre
        Scale of 16-bit images.

    Returns
    -------
    (height, width) float32 metres along the optical axis, NaN where nothing was measured.

    Raises
    ------
    DamagedImageError
        If the message holds less than it says.
    RecordingError
        If it holds something else than depth.
    """
    if hasattr(message, "encoding"):
        return depth_from_image(message, values_per_metre=values_per_metre)
    return depth_from_compressed_image(message, values_per_metre=values_per_metre)


def depth_from_image(message: ImageMessage, *, values_per_metre: float = VALUES_PER_METRE) -> DepthImage:
    """Decode an uncompressed depth image of either byte order, its rows padded or not.

    See ``depth_from_message``.
    """
    kind = DEPTH_ENCODINGS.get(message.encoding)
    if kind is None:
        raise RecordingError(
            f"expected depth with encoding 16UC1 (mm) or 32FC1 (m), got '{message.encoding}'; is it a colour "
            "image?"
        )
    pixel = np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<")
    height, width = int(message.height), int(message.width)
    num_row_bytes = width * pixel.itemsize
    step = int(message.step) or num_row_bytes
    data = np.frombuffer(message.data, dtype=np.uint8)
    num_needed = (height - 1) * step + num_row_bytes
    if height <= 0 or width <= 0 or step < num_row_bytes or data.size < num_needed:
        raise DamagedImageError(
            f"an image of {width}x{height} {message.encoding} with rows of {step} bytes cannot have "
            f"{data.size} bytes"
        )
    rows = np.lib.stride_tricks.as_strided(data, (height, num_row_bytes), (step, 1), writeable=False)
    values = rows.view(pixel)
    return _depth_from_metres(values) if kind == "f4" else _depth_from_whole(values, values_per_metre)


def depth_from_compressed_image(
    message: CompressedImageMessage, *, values_per_metre: float = VALUES_PER_METRE
) -> DepthImage:
    """Decode a ``compressedDepth`` image: 16UC1, or the quantised inverse of 32FC1, as PNG or RVL.

    A header of 12 bytes comes first: the kind of compression and the two parameters of the quantisation,
    ``depth = a / (value - b)`` (compressed_depth_image_transport). 16-bit PNG without it, as the plain
    ``compressed`` transport writes, is read too. See ``depth_from_message``.
    """
    data = bytes(np.frombuffer(message.data, dtype=np.uint8).data)
    encoding = message.format.partition(";")[0].strip()
    if data.startswith(_PNG_SIGNATURE):
        return decode_depth_png(data, values_per_metre)
    header_size = _COMPRESSED_DEPTH_HEADER.size
    if encoding not in DEPTH_ENCODINGS or "compressedDepth" not in message.format:
        raise RecordingError(
            f"expected compressedDepth of 16UC1 or 32FC1, got the format '{message.format}'; record "
            "the topic .../compressedDepth, not .../compressed"
        )
    is_rvl = "compressedDepth rvl" in message.format
    if DEPTH_ENCODINGS[encoding] == "u2":
        if is_rvl:
            return _depth_from_whole(decode_rvl(data[header_size:]), values_per_metre)
        return decode_depth_png(data[header_size:], values_per_metre)
    if len(data) < header_size:
        raise DamagedImageError("the image is cut off")
    _, factor, offset = _COMPRESSED_DEPTH_HEADER.unpack_from(data)
    values = decode_rvl(data[header_size:]) if is_rvl else decode_png_values(data[header_size:])
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.float32(factor) / (values.astype(np.float32) - np.float32(offset))
    depth[values == 0] = np.nan
    return _depth_from_metres(depth)


def _depth_from_whole(values: Any, values_per_metre: float) -> DepthImage:
    depth = values.astype(np.float32)
    # Times one over it would differ in the last bit from what the PNG of an image folder gives.
    depth /= np.float32(values_per_metre)
    depth[(values == 0) | (values > MAX_PIXEL_VALUE)] = np.nan
    return np.asarray(depth)


def _depth_from_metres(values: Any) -> DepthImage:
    """Infinities mean too near or too far (REP 117), and zero is what some drivers write for nothing."""
    depth = values.astype(np.float32)
    with np.errstate(invalid="ignore"):
        depth[~((depth > 0) & (depth < np.inf))] = np.nan
    return np.asarray(depth)
