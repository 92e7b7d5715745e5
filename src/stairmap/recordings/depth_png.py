"""Depth images as 16-bit single-channel PNG, and how to tell a damaged one.

Pixel value = depth in metres × ``depth_scale``. Not measured: 0, and 65535, which
7-Scenes writes and stereo cameras give where the disparity vanishes.
"""

from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import DepthImage
from stairmap.errors import RecordingError

HEADER_SIZE = 33
"""Bytes from a PNG file's start to the end of its first chunk, the image header."""

MAX_PIXEL_VALUE = 65534
"""Largest pixel value that is a measurement."""

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_OTHER_SIGNATURES = {
    b"\xff\xd8\xff": "JPEG",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
    b"P5": "PGM",
    b"v/1\x01": "EXR",
}
_CHANNELS = {0: "grey", 2: "RGB", 3: "palette", 4: "grey with alpha", 6: "RGB with alpha"}


class DamagedImageError(RecordingError):
    """An image file is cut off or corrupt, as a full disk or a crash leaves it."""


def check_png_header(header: bytes) -> tuple[int, int]:
    """Check that a file begins like a 16-bit single-channel PNG.

    Parameters
    ----------
    header
        The first ``HEADER_SIZE`` bytes of the file, or more.

    Returns
    -------
    Width and height of the image, in pixels.

    Raises
    ------
    DamagedImageError
        If the header is cut off, corrupt or all zeros.
    RecordingError
        If it is another kind of file, or another kind of PNG.
    """
    header = header[:HEADER_SIZE]
    # Zeros are what a file system leaves of a file that was being written when the power failed.
    if not header.strip(b"\0"):
        raise DamagedImageError("the file is empty")
    if header[:8] != _SIGNATURE[: len(header)]:
        kind = next(
            (f", got {name}" for start, name in _OTHER_SIGNATURES.items() if header.startswith(start)), ""
        )
        raise RecordingError(f"expected a 16-bit single-channel PNG{kind or ', got another kind of file'}")
    if len(header) < HEADER_SIZE:
        raise DamagedImageError("the file is cut off")
    if header[12:16] != b"IHDR" or zlib.crc32(header[12:29]) != int.from_bytes(header[29:33], "big"):
        raise DamagedImageError("the image header is corrupt")
    width, height, bits, color_type = struct.unpack(">IIBB", header[16:26])
    if (bits, color_type) != (16, 0):
        channels = _CHANNELS.get(color_type, "unknown")
        raise RecordingError(
            f"expected a 16-bit single-channel PNG, got {bits}-bit {channels}; is it a colour image, "
            "or depth made visible?"
        )
    return width, height


def decode_depth_png(data: bytes, depth_scale: float) -> DepthImage:
    """Decode a depth image.

    Parameters
    ----------
    data
        A whole PNG file.
    depth_scale
        Pixel values per metre.

    Returns
    -------
    (height, width) float32 metres, NaN where the pixel is 0 or 65535.

    Raises
    ------
    DamagedImageError
        If the file is cut off or corrupt.
    RecordingError
        If it is no 16-bit single-channel PNG.
    """
    image = decode_png_values(data)
    depth = image.astype(np.float32)
    depth /= np.float32(depth_scale)
    depth[(image == 0) | (image > MAX_PIXEL_VALUE)] = np.nan
    return depth


def decode_png_values(data: bytes) -> NDArray[np.uint16]:
    """Decode a whole PNG file to its (height, width) pixel values.

    Raises
    ------
    DamagedImageError
        If the file is cut off or corrupt.
    RecordingError
        If it is no 16-bit single-channel PNG.
    """
    check_png_header(data)
    _check_chunks(data)
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise DamagedImageError("the image data are corrupt") from error
    if image is None or image.ndim != 2 or image.dtype != np.uint16:
        raise DamagedImageError("the image data are corrupt")
    return np.asarray(image, dtype=np.uint16)


def encode_depth_png(depth: DepthImage, depth_scale: float) -> bytes:
    """Encode a depth image, rounded to the nearest pixel value.

    Parameters
    ----------
    depth
        (height, width) metres. What is not finite, not positive or beyond 65534 / ``depth_scale`` metres
        becomes 0, not measured.
    depth_scale
        Pixel values per metre.

    Returns
    -------
    A whole PNG file.
    """
    values = np.rint(np.asarray(depth, dtype=np.float64) * depth_scale)
    with np.errstate(invalid="ignore"):
        measured = (values > 0) & (values <= MAX_PIXEL_VALUE)
    pixels = np.where(measured, values, 0).astype(np.uint16)
    _, data = cv2.imencode(".png", pixels)
    return bytes(data.tobytes())


def _check_chunks(data: bytes) -> None:
    """Walk all chunks to the last one and check their sums.

    Not left to the decoder: libpng complains on stderr, and some versions of OpenCV return the upper part
    of a cut-off image as if it were whole.
    """
    start = len(_SIGNATURE)
    while start + 12 <= len(data):
        length = int.from_bytes(data[start : start + 4], "big")
        end = start + 12 + length
        if end > len(data):
            break
        if zlib.crc32(data[start + 4 : end - 4]) != int.from_bytes(data[end - 4 : end], "big"):
            raise DamagedImageError("the image data are corrupt")
        if data[start + 4 : start + 8] == b"IEND":
            return
        start = end
    raise DamagedImageError("the file is cut off")
