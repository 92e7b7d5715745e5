"""Decode depth that is compressed with RVL (Wilson 2017, "Fast Lossless Depth Image Compression").

The stream is made of nibbles, the highest of each little-endian 32-bit word first. A number takes as many
nibbles
as it needs, three bits in each, the lowest bits first; the nibble's fourth bit says that more follow. The
numbers are: how many zeros, how many values, and for each value its difference to the one before, with the
sign in the lowest bit; and so on to the end of the image.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stairmap.recordings.depth_png import DamagedImageError

_MAX_NIBBLES = 11
"""Nibbles of a 32-bit number, at most."""

MAX_PIXELS = 100_000_000
"""More pixels than any depth camera has: a size that says so is damaged."""


def decode_rvl(data: bytes) -> NDArray[np.uint16]:
    """Decode an image as compressedDepth holds it: its width and height as 32-bit numbers, then the stream.

    Returns
    -------
    (height, width) pixel values.

    Raises
    ------
    DamagedImageError
        If it is cut off, or holds more or less than its size says.
    """
    if len(data) < 8:
        raise DamagedImageError("the RVL image is cut off")
    width, height = (int(size) for size in np.frombuffer(data[:8], dtype="<u4"))
    num_pixels = width * height
    if not 0 < num_pixels <= MAX_PIXELS:
        raise DamagedImageError(f"the RVL image cannot have {width}x{height} pixels")
    words = np.frombuffer(data[8 : len(data) - len(data) % 4], dtype="<u4")
    pixels = np.zeros(num_pixels, dtype=np.uint16)
    places, differences = _unpack_runs(_numbers_from_words(words), num_pixels)
    # Sums of 16-bit differences wrap around as those of the encoder do.
    pixels[places] = np.cumsum(differences, dtype=np.int64).astype(np.uint16)
    return pixels.reshape(height, width)


def _numbers_from_words(words: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Return the numbers that the nibbles of (N,) words spell; zeros that fill the last word are numbers
    too."""
    pairs = np.empty((len(words), 8), dtype=np.uint8)
    octets = words.astype(">u4").view(np.uint8).reshape(-1, 4)
    pairs[:, ::2], pairs[:, 1::2] = octets >> 4, octets & 15
    nibbles = pairs.ravel()
    ends = np.flatnonzero(nibbles < 8)
    if not len(ends):
        raise DamagedImageError("the RVL image is cut off")
    lengths = np.diff(ends, prepend=-1)
    starts = ends - lengths + 1
    numbers = (nibbles[starts] & 7).astype(np.int64)
    # Few numbers are long: each round looks only at those that go on.
    longer = np.flatnonzero(lengths > 1)
    for place in range(1, int(lengths.max())):
        if place >= _MAX_NIBBLES:
            raise DamagedImageError("the RVL image is corrupt: a number in it has no end")
        numbers[longer] |= (nibbles[starts[longer] + place] & 7).astype(np.int64) << (3 * place)
        longer = longer[lengths[longer] > place + 1]
    return numbers


def _unpack_runs(numbers: NDArray[np.int64], num_pixels: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where the values of an image are, and the difference of each to the one before."""
    first_pixels, first_numbers, counts = [], [], []
    pixel = index = 0
    values = numbers.tolist()
    while pixel < num_pixels:
        if index + 2 > len(values):
            raise DamagedImageError(f"the RVL image ends after {pixel} of {num_pixels} pixels")
        num_zeros, num_values = values[index], values[index + 1]
        first_pixels.append(pixel + num_zeros)
        first_numbers.append(index + 2)
        counts.append(num_values)
        pixel += num_zeros + num_values
        index += 2 + num_values
        if num_zeros + num_values == 0:
            raise DamagedImageError(f"the RVL image is corrupt after {pixel} of {num_pixels} pixels")
    if pixel != num_pixels or index > len(values):
        raise DamagedImageError(f"the RVL image has more or less than its {num_pixels} pixels")
    lengths = np.array(counts)
    inside = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    signed = numbers[np.repeat(first_numbers, lengths) + inside]
    return np.repeat(first_pixels, lengths) + inside, (signed >> 1) ^ -(signed & 1)
