"""Depth in another unit than ROS's convention is refused, or told with what mends it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from stairmap.errors import CalibrationError
from stairmap.recordings.depth_unit_watch import DepthUnitMistake
from stairmap_ros.depth_unit import check_depth_unit, describe_unit_mistake

FLOATS = SimpleNamespace(encoding="32FC1")
WHOLE = SimpleNamespace(encoding="16UC1")
COMPRESSED_FLOATS = SimpleNamespace(format="32FC1; compressedDepth png")


@pytest.mark.parametrize("message", [FLOATS, COMPRESSED_FLOATS])
def test_floating_point_millimetres_are_refused(message: SimpleNamespace) -> None:
    depth = np.full((64, 64), 1843.0, dtype=np.float32)
    depth[:20] = np.nan
    with pytest.raises(CalibrationError, match=r"median of 1843 m: 32FC1 must be metres \(REP 118\)"):
        check_depth_unit(depth, message)


def test_a_depth_unit_that_is_far_too_large_is_refused() -> None:
    with pytest.raises(CalibrationError, match="depth_unit does not fit these images"):
        check_depth_unit(np.full((64, 64), 180.0, dtype=np.float32), WHOLE)


@pytest.mark.parametrize("value", [2.0, 49.0, np.nan])
def test_depth_in_metres_and_images_of_nothing_pass(value: float) -> None:
    check_depth_unit(np.full((64, 64), value, dtype=np.float32), FLOATS)


def test_the_unit_that_mends_it_is_named() -> None:
    mistake = DepthUnitMistake(factor=0.25, agreeing=0.97)
    assert describe_unit_mistake(mistake, WHOLE, 0.001).endswith("; set depth_unit to 0.00025")
    assert describe_unit_mistake(mistake, FLOATS, 0.001).endswith("; publish 32FC1 in metres (REP 118)")
