"""Every axis can be up, and a level map keeps its numbers."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.errors import RecordingError
from stairmap.recordings.map_up import UP_AXES, check_up, find_up_disagreement, map_from_recorded_with_up


@pytest.mark.parametrize("up", sorted(UP_AXES))
def test_the_named_axis_becomes_z_by_an_exact_turn(up: str) -> None:
    turn = map_from_recorded_with_up(up)
    assert (turn[:3, :3] @ UP_AXES[up]).tolist() == [0, 0, 1]
    assert np.linalg.det(turn[:3, :3]) == pytest.approx(1)
    np.testing.assert_array_equal(turn[:3, :3] @ turn[:3, :3].T, np.eye(3))
    np.testing.assert_array_equal(turn[:3, 3], 0)


@pytest.mark.parametrize("up", ["+z", "auto"])
def test_a_map_with_z_up_stays_as_it_is(up: str) -> None:
    np.testing.assert_array_equal(map_from_recorded_with_up(up), np.eye(4))


@pytest.mark.parametrize("up", ["z", "y", "", "+Z", "up", "+w"])
def test_anything_else_is_refused(up: str) -> None:
    with pytest.raises(
        RecordingError, match=r"expected --up to be one of \+x, -x, \+y, -y, \+z, -z, auto, got"
    ):
        check_up(up)


def test_an_imu_may_be_a_few_degrees_off_but_no_more() -> None:
    up = np.array([0.0, -1.0, 0.0])
    assert find_up_disagreement(up, np.array([0.1, -1.0, 0.0])) is None
    sentence = find_up_disagreement(up, np.array([0.0, 0.0, -1.0]))
    assert sentence is not None
    assert "differ by 90 degrees" in sentence
    assert "--up" in sentence
