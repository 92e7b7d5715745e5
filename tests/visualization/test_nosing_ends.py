"""An end of a step is called cut only where the image or something in front cuts it."""

from __future__ import annotations

import numpy as np

from stairmap.camera import PinholeCamera
from stairmap.detection.observation import StairEdge
from stairmap.frame import DepthFrame
from stairmap.visualization.overlay import NosingEnd, find_nosing_ends

CAMERA = PinholeCamera(width=200, height=100, fx=100.0, fy=100.0, cx=99.5, cy=49.5)


def frame_with(column: int | None = None, depth: float = 1.0) -> DepthFrame:
    """A wall 2 m away; from a column on, something else."""
    image = np.full((100, 200), 2.0, dtype=np.float32)
    if column is not None:
        image[:, column:] = depth
    return DepthFrame(stamp_ns=0, depth=image, camera=CAMERA)


def edge(left: float, right: float, *, bounded: bool = False) -> StairEdge:
    """A nosing 2 m away from column ``left`` to ``right``."""
    ends = [[(column - 99.5) / 100 * 2.0, 0.0, 2.0] for column in (left, right)]
    return StairEdge(
        nosing=ends, step_index=0, left_bounded=bounded, right_bounded=bounded, cue="jump", num_pixels=50
    )


def test_end_that_was_seen_is_seen_wherever_it_is() -> None:
    assert find_nosing_ends(frame_with(), edge(1, 198, bounded=True)) == (NosingEnd.SEEN, NosingEnd.SEEN)


def test_end_at_the_border_is_cut_and_one_near_it_is_not() -> None:
    assert find_nosing_ends(frame_with(), edge(1, 198)) == (NosingEnd.CUT, NosingEnd.CUT)
    assert find_nosing_ends(frame_with(), edge(5, 194)) == (NosingEnd.UNKNOWN, NosingEnd.UNKNOWN)


def test_end_behind_something_is_cut_and_one_before_something_is_not() -> None:
    assert find_nosing_ends(frame_with(150, 1.0), edge(50, 148)) == (NosingEnd.UNKNOWN, NosingEnd.CUT)
    assert find_nosing_ends(frame_with(150, 3.0), edge(50, 148)) == (NosingEnd.UNKNOWN, NosingEnd.UNKNOWN)
    assert find_nosing_ends(frame_with(150, 1.95), edge(50, 148))[1] is NosingEnd.UNKNOWN
    assert find_nosing_ends(frame_with(150, np.nan), edge(50, 148))[1] is NosingEnd.UNKNOWN
