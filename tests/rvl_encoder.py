"""Compresses depth with RVL, number by number, as the paper describes it: what a robot's publisher does."""

from __future__ import annotations

import numpy as np


def encode_rvl(values: np.ndarray) -> bytes:
    """Return width, height and RVL stream of (height, width) 16-bit values."""
    height, width = values.shape
    nibbles: list[int] = []

    def put(number: int) -> None:
        while True:
            number, low = number >> 3, number & 7
            nibbles.append(low | (8 if number else 0))
            if not number:
                return

    pixels = values.ravel().tolist()
    previous = index = 0
    while index < len(pixels):
        end = index
        while end < len(pixels) and pixels[end] == 0:
            end += 1
        put(end - index)
        index = end
        while end < len(pixels) and pixels[end] != 0:
            end += 1
        put(end - index)
        for value in pixels[index:end]:
            difference = value - previous
            put(difference * 2 if difference >= 0 else -difference * 2 - 1)
            previous = value
        index = end
    nibbles += [0] * (-len(nibbles) % 8)
    words = [
        int("".join(f"{nibble:x}" for nibble in nibbles[i : i + 8]), 16) for i in range(0, len(nibbles), 8)
    ]
    return np.array([width, height, *words], dtype="<u4").tobytes()
