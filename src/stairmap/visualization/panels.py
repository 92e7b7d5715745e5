"""Text on pictures, and pictures side by side, with OpenCV alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import Float64Array

Image: TypeAlias = NDArray[np.uint8]
"""(height, width, 3) uint8, blue-green-red."""

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_TEXT_SCALE = 0.5
_LINE_HEIGHT = 22
_MARGIN = 8
_STRIP_COLOR = (32, 30, 28)
_TEXT_COLOR = (245, 245, 245)


def add_text_strip(
    picture: Image, lines: Sequence[str], *, color_bar: tuple[str, Image, str] | None = None
) -> Image:
    """Return the picture with lines of ASCII text on a dark strip below it.

    Parameters
    ----------
    picture
        Any picture.
    lines
        What to write; a line that is too long is broken at a space.
    color_bar
        Text, bar and text that go on one line above the others, as a key to the colours.
    """
    width = picture.shape[1]
    broken = [part for line in lines for part in _broken(line, width - 2 * _MARGIN)]
    num_lines = len(broken) + (color_bar is not None)
    strip = np.full((num_lines * _LINE_HEIGHT + _MARGIN, width, 3), _STRIP_COLOR, dtype=np.uint8)
    row = _LINE_HEIGHT - 4
    if color_bar is not None:
        _write_color_bar(strip, row, *color_bar)
        row += _LINE_HEIGHT
    for line in broken:
        _write(strip, line, (_MARGIN, row))
        row += _LINE_HEIGHT
    return np.concatenate([picture, strip])


def with_title(picture: Image, title: str) -> Image:
    """Return the picture with a title on a dark strip above it."""
    strip = np.full((_LINE_HEIGHT + 4, picture.shape[1], 3), _STRIP_COLOR, dtype=np.uint8)
    _write(strip, title, (_MARGIN, _LINE_HEIGHT - 4))
    return np.concatenate([strip, picture])


def place_in_grid(pictures: Sequence[Image], *, num_columns: int, gap: int = 4) -> Image:
    """Return pictures of one size in rows of ``num_columns``, ``gap`` pixels apart."""
    height, width = pictures[0].shape[:2]
    num_rows = -(-len(pictures) // num_columns)
    size = (num_rows * (height + gap) - gap, num_columns * (width + gap) - gap, 3)
    grid = np.full(size, 255, dtype=np.uint8)
    for index, picture in enumerate(pictures):
        top, left = (index // num_columns) * (height + gap), (index % num_columns) * (width + gap)
        grid[top : top + height, left : left + width] = picture
    return grid


def draw_label(picture: Image, text: str, center: Float64Array, color: tuple[int, int, int]) -> None:
    """Write a short text on a dark ground, centred at (u, v) or as near to it as the picture allows."""
    (width, height), _ = cv2.getTextSize(text, _FONT, _TEXT_SCALE, 1)
    rows, columns = picture.shape[:2]
    left = round(min(max(float(center[0]) - width / 2, 3), columns - width - 3))
    bottom = round(min(max(float(center[1]) + height / 2, height + 3), rows - 3))
    cv2.rectangle(
        picture, (left - 3, bottom - height - 3), (left + width + 3, bottom + 3), _STRIP_COLOR, cv2.FILLED
    )
    _write(picture, text, (left, bottom), color)


def _write(
    picture: Image, text: str, position: tuple[int, int], color: tuple[int, int, int] = _TEXT_COLOR
) -> None:
    cv2.putText(picture, text, position, _FONT, _TEXT_SCALE, color, 1, cv2.LINE_AA)


def _write_color_bar(strip: Image, row: int, near: str, bar: Image, far: str) -> None:
    left = _MARGIN
    for text in ("depth", near):
        _write(strip, text, (left, row))
        left += _text_width(text) + 12
    height, width = bar.shape[:2]
    width = min(width, max(strip.shape[1] - left, 0))
    strip[row - height : row, left : left + width] = bar[:, :width]
    _write(strip, far, (left + width + 12, row))


def _broken(line: str, width: int) -> list[str]:
    """Break a line at its spaces so that no part is wider than ``width`` px."""
    parts = [""]
    for word in line.split(" "):
        longer = f"{parts[-1]} {word}" if parts[-1] else word
        if parts[-1] and _text_width(longer) > width:
            parts.append(f"    {word}")
        else:
            parts[-1] = longer
    return parts


def _text_width(text: str) -> int:
    return int(cv2.getTextSize(text, _FONT, _TEXT_SCALE, 1)[0][0])
