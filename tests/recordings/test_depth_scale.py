"""A wrong depth scale is found out and the right one named."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.errors import CalibrationError
from stairmap.recordings.depth_scale import check_depth_scale


def _depth(metres: float) -> np.ndarray:
    return np.full((4, 5), metres, dtype=np.float32)


@pytest.mark.parametrize("metres", [0.11, 0.7, 2.0, 9.0, 49.0])
def test_plausible_depth_passes(metres: float) -> None:
    assert check_depth_scale([_depth(metres)], 1000.0) == pytest.approx(metres)


@pytest.mark.parametrize(
    ("metres", "used", "right"),
    [
        (2.0, 1.0, "1000"),
        (2.0, 0.001, "1000"),
        (1.5, 0.0002, "5000"),
        (2.0, 1e6, "1000"),
        (1.0, 100000.0, "1000"),
    ],
)
def test_the_likely_scale_is_named(metres: float, used: float, right: str) -> None:
    with pytest.raises(CalibrationError, match=f"with depth_scale .*the likely depth_scale is {right}$"):
        check_depth_scale([_depth(metres * float(right) / used)], used)


def test_hopeless_depth_suggests_nothing() -> None:
    with pytest.raises(CalibrationError, match="check depth_scale"):
        check_depth_scale([_depth(1e-7)], 1000.0)


def test_frames_without_depth_do_not_count() -> None:
    blank = _depth(np.nan)
    assert check_depth_scale([blank, blank, _depth(3.0)], 1000.0) == pytest.approx(3)
    assert check_depth_scale([blank], 1000.0) is None
    assert check_depth_scale([], 1000.0) is None


def test_no_more_frames_are_read_than_needed() -> None:
    frames = iter([_depth(2.0)] * 8)
    check_depth_scale(frames, 1000.0)
    assert len(list(frames)) == 3
