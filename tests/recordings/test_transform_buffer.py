"""Transforms are interpolated link by link, never extrapolated, and a refusal says what is missing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.arrays import Transform
from stairmap.errors import TransformLookupError, TransformProblem
from stairmap.recordings.transform_buffer import TransformBuffer
from stairmap.recordings.transform_history import MAX_SLOW_GAP_NS
from stairmap.transforms import invert_transform, rotation_from_vector, transform_from_parts
from value_strategies import no_deadline

MS = 1_000_000


def at_x(x: float) -> Transform:
    return transform_from_parts(np.eye(3), [x, 0.0, 0.0])


def turned(yaw: float, x: float = 0.0) -> Transform:
    return transform_from_parts(rotation_from_vector([0.0, 0.0, yaw]), [x, 0.0, 0.0])


def robot(**options: int) -> TransformBuffer:
    """A robot that drives along x at 1 m/s for a second, its odometry 10 m from the map's origin."""
    buffer = TransformBuffer(**options)
    buffer.add_static("base", "camera", transform_from_parts(np.eye(3), [0.0, 0.0, 0.5]))
    for stamp_ms in range(0, 1001, 20):
        buffer.add("odom", "base", stamp_ms * MS, at_x(stamp_ms / 1000))
        if stamp_ms % 100 == 0:
            buffer.add("map", "odom", stamp_ms * MS, at_x(10.0))
    return buffer


def problem_of(buffer: TransformBuffer, destination: str, source: str, stamp_ns: int) -> TransformProblem:
    with pytest.raises(TransformLookupError) as caught:
        buffer.lookup(destination, source, stamp_ns)
    return caught.value.problem


def test_chain_is_interpolated_link_by_link() -> None:
    map_from_camera = robot().lookup("map", "camera", 505 * MS)
    assert map_from_camera[:3, 3] == pytest.approx([10.505, 0.0, 0.5])


def test_chain_is_walked_up_and_down_again() -> None:
    buffer = robot()
    buffer.add_static("base", "lidar", at_x(0.2))
    assert buffer.lookup("lidar", "camera", 0)[:3, 3] == pytest.approx([-0.2, 0.0, 0.5])
    assert np.allclose(
        buffer.lookup("camera", "map", 333 * MS), invert_transform(buffer.lookup("map", "camera", 333 * MS))
    )


def test_a_coordinate_frame_is_where_it_is_in_itself() -> None:
    assert np.array_equal(robot().lookup("base", "base", 5), np.eye(4))


def test_rotations_are_interpolated_along_the_shorter_arc() -> None:
    buffer = TransformBuffer()
    buffer.add("odom", "base", 0, turned(3.1))
    buffer.add("odom", "base", 100 * MS, turned(-3.1))
    assert np.allclose(buffer.lookup("odom", "base", 50 * MS), turned(np.pi), atol=1e-9)


def test_leading_slashes_do_not_matter() -> None:
    buffer = TransformBuffer()
    buffer.add("/odom", "base", 0, at_x(1.0))
    assert buffer.lookup("odom", "/base", 0)[0, 3] == 1.0
    assert buffer.coordinate_frames() == ("odom", "base")


def test_a_chain_has_come_as_far_as_its_slowest_moving_link() -> None:
    buffer = robot()
    buffer.add("odom", "base", 1040 * MS, at_x(1.04))
    buffer.add("map", "other", 5000 * MS, at_x(0.0))
    assert buffer.latest_ns("odom", "camera") == 1040 * MS
    assert buffer.latest_ns("map", "camera") == buffer.latest_ns("camera", "map") == 1000 * MS
    buffer.lookup("map", "camera", buffer.latest_ns("map", "camera"))
    with pytest.raises(TransformLookupError, match="no coordinate frame 'wheel'"):
        buffer.latest_ns("map", "wheel")


def test_unknown_coordinate_frame_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(TransformLookupError, match="'world'; there are: base, camera, map, odom") as caught:
        robot().lookup("world", "camera", 0)
    assert caught.value.problem is TransformProblem.UNKNOWN_FRAME


def test_two_trees_are_not_connected_and_the_roots_are_named() -> None:
    buffer = robot()
    buffer.add_static("tripod", "tracker", np.eye(4))
    with pytest.raises(TransformLookupError, match="camera hangs on map, tracker on tripod") as caught:
        buffer.lookup("tracker", "camera", 0)
    assert caught.value.problem is TransformProblem.NOT_CONNECTED


def test_nothing_is_extrapolated() -> None:
    buffer = robot()
    assert problem_of(buffer, "map", "camera", -1 * MS) is TransformProblem.TOO_EARLY
    assert problem_of(buffer, "map", "camera", 1001 * MS) is TransformProblem.NOT_YET
    with pytest.raises(TransformLookupError, match=r"from base to odom at 1\.010 s: the latest is 1\.000 s"):
        buffer.lookup("map", "camera", 1010 * MS)


def test_stamp_within_a_microsecond_of_the_newest_is_that_one() -> None:
    assert robot().lookup("odom", "base", 1000 * MS + 999)[0, 3] == pytest.approx(1.0)
    assert problem_of(robot(), "odom", "base", 1000 * MS + 1001) is TransformProblem.NOT_YET


def test_late_transform_makes_the_same_lookup_work() -> None:
    buffer = robot()
    assert problem_of(buffer, "odom", "base", 1010 * MS) is TransformProblem.NOT_YET
    buffer.add("odom", "base", 1020 * MS, at_x(1.02))
    assert buffer.lookup("odom", "base", 1010 * MS)[0, 3] == pytest.approx(1.01)


def test_gap_of_a_frame_that_moved_is_not_bridged() -> None:
    buffer = robot()
    buffer.add("odom", "base", 1501 * MS, at_x(1.501))
    assert problem_of(buffer, "odom", "base", 1200 * MS) is TransformProblem.GAP
    with pytest.raises(TransformLookupError, match=r"gap of 0\.501 s"):
        buffer.lookup("odom", "base", 1200 * MS)


def test_frame_that_has_hardly_moved_may_be_silent_for_two_and_a_half_seconds_and_no_longer() -> None:
    buffer = TransformBuffer()
    buffer.add("map", "odom", 0, at_x(10.0))
    buffer.add("map", "odom", MAX_SLOW_GAP_NS, at_x(10.01))
    buffer.add("map", "odom", 2 * MAX_SLOW_GAP_NS + MS, at_x(10.01))
    assert buffer.lookup("map", "odom", MAX_SLOW_GAP_NS // 2)[0, 3] == pytest.approx(10.005)
    assert problem_of(buffer, "map", "odom", MAX_SLOW_GAP_NS + 10 * MS) is TransformProblem.GAP


def test_turn_over_a_gap_is_movement() -> None:
    buffer = TransformBuffer()
    buffer.add("odom", "base", 0, turned(0.0))
    buffer.add("odom", "base", 600 * MS, turned(0.1))
    assert problem_of(buffer, "odom", "base", 250 * MS) is TransformProblem.GAP


def test_odometry_at_5_hz_that_loses_a_message_is_interpolated() -> None:
    buffer = robot()
    buffer.add("odom", "base", 1400 * MS, at_x(1.4))
    assert buffer.lookup("odom", "base", 1210 * MS)[0, 3] == pytest.approx(1.21)


def test_a_correction_of_5_cm_in_a_second_is_interpolated() -> None:
    buffer = TransformBuffer()
    buffer.add("map", "odom", 0, at_x(10.0))
    buffer.add("map", "odom", 1000 * MS, at_x(10.05))
    assert buffer.lookup("map", "odom", 500 * MS)[0, 3] == pytest.approx(10.025)


def test_the_allowed_gap_can_be_told() -> None:
    buffer = TransformBuffer(max_gap_ns=100 * MS)
    buffer.add("odom", "base", 0, at_x(0.0))
    buffer.add("odom", "base", 200 * MS, at_x(0.2))
    assert problem_of(buffer, "odom", "base", 100 * MS) is TransformProblem.GAP


def test_same_stamp_replaces() -> None:
    buffer = robot()
    buffer.add("odom", "base", 500 * MS, at_x(7.0))
    assert buffer.lookup("odom", "base", 500 * MS)[0, 3] == 7.0


@given(order=st.permutations(range(12)))
@no_deadline
def test_order_of_arrival_does_not_matter(order: list[int]) -> None:
    buffer = TransformBuffer()
    for index in order:
        buffer.add("odom", "base", index * 50 * MS, at_x(float(index**2)))
    assert buffer.lookup("odom", "base", 475 * MS)[0, 3] == pytest.approx((81 + 100) / 2)


def test_old_transforms_are_forgotten_and_the_newest_never() -> None:
    buffer = robot(max_age_ns=200 * MS)
    assert buffer.lookup("odom", "base", 810 * MS)[0, 3] == pytest.approx(0.81)
    assert problem_of(buffer, "odom", "base", 790 * MS) is TransformProblem.TOO_EARLY
    buffer.add("odom", "base", 100 * MS, at_x(9.9))
    assert problem_of(buffer, "odom", "base", 100 * MS) is TransformProblem.TOO_EARLY
    buffer.add("odom", "base", 9000 * MS, at_x(2.0))
    assert buffer.lookup("odom", "base", 9000 * MS)[0, 3] == 2.0


def test_memory_does_not_grow_beyond_the_age() -> None:
    buffer = TransformBuffer(max_age_ns=100 * MS)
    for stamp_ms in range(5000):
        buffer.add("odom", "base", stamp_ms * MS, at_x(0.0))
    assert len(buffer._moving["base"]["odom"]._stamps_ns) < 250


def test_clear_keeps_static_transforms_only() -> None:
    buffer = robot()
    buffer.clear()
    assert buffer.lookup("base", "camera", 0)[2, 3] == 0.5
    assert problem_of(buffer, "map", "camera", 0) is TransformProblem.NOT_CONNECTED
    buffer.add("odom", "base", -5000 * MS, at_x(3.0))
    assert buffer.lookup("odom", "camera", -5000 * MS)[0, 3] == 3.0


def test_second_parent_is_noted_once_and_each_time_has_its_own() -> None:
    buffer = robot()
    assert buffer.notes == ()
    for stamp_ms in (2000, 2050):
        buffer.add("anchor", "base", stamp_ms * MS, at_x(-1.0))
    assert buffer.lookup("odom", "base", 500 * MS)[0, 3] == pytest.approx(0.5)
    assert buffer.lookup("anchor", "base", 2020 * MS)[0, 3] == -1.0
    assert len(buffer.notes) == 1
    assert "base has more than one parent, anchor and odom" in buffer.notes[0]
    assert buffer.parents("base") == ("odom", "anchor")


def test_static_transform_that_becomes_a_moving_one_moves() -> None:
    buffer = TransformBuffer()
    buffer.add_static("odom", "base", at_x(5.0))
    buffer.add("odom", "base", 0, at_x(1.0))
    assert buffer.lookup("odom", "base", 0)[0, 3] == 1.0
    assert buffer.notes == ()


def test_loop_of_parents_ends_in_an_answer() -> None:
    buffer = TransformBuffer()
    buffer.add_static("a", "b", at_x(1.0))
    buffer.add_static("b", "a", at_x(-1.0))
    buffer.add_static("c", "d", np.eye(4))
    assert buffer.lookup("a", "b", 0)[0, 3] == 1.0
    assert problem_of(buffer, "a", "d", 0) is TransformProblem.NOT_CONNECTED
