from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.errors import TrajectoryError
from stairmap.trajectory import MAX_GAP_NS, Trajectory
from stairmap.transforms import transform_from_parts
from value_strategies import no_deadline

MS = 1_000_000


def straight_drive(stamps_ms: list[int]) -> Trajectory:
    """One metre along x per second."""
    poses = [transform_from_parts(np.eye(3), [stamp / 1000, 0.0, 0.0]) for stamp in stamps_ms]
    return Trajectory(stamps_ns=np.array(stamps_ms) * MS, map_from_camera=np.array(poses))


def test_pose_between_stamps_is_interpolated() -> None:
    assert straight_drive([0, 100]).pose_at(25 * MS)[0, 3] == pytest.approx(0.025)


def test_pose_at_a_stamp_is_given_even_beside_a_gap() -> None:
    trajectory = straight_drive([0, 5000, 5050])
    assert trajectory.has_pose(np.array([0, 5000 * MS, 5050 * MS])).tolist() == [True, True, True]
    assert trajectory.pose_at(5000 * MS)[0, 3] == pytest.approx(5.0)


def test_pose_in_a_gap_is_refused_with_the_limit_and_the_range() -> None:
    trajectory = straight_drive([0, 101])
    with pytest.raises(
        TrajectoryError, match=r"within 0\.1 s of stamp 0\.050000 s.*0\.000000 s to 0\.101000 s"
    ):
        trajectory.pose_at(50 * MS)


def test_gap_of_just_the_limit_is_bridged() -> None:
    assert MAX_GAP_NS == 100 * MS
    assert straight_drive([0, 100]).has_pose(np.array([50 * MS])).all()


def test_wider_gaps_are_bridged_when_the_caller_allows_them() -> None:
    assert straight_drive([0, 2000]).pose_at(500 * MS, max_gap_ns=2000 * MS)[0, 3] == pytest.approx(0.5)


@pytest.mark.parametrize("stamp_ns", [-2_000, 100 * MS + 2_000])
def test_nothing_is_extrapolated(stamp_ns: int) -> None:
    trajectory = straight_drive([0, 100])
    assert not trajectory.has_pose(np.array([stamp_ns])).any()
    with pytest.raises(TrajectoryError):
        trajectory.poses_at(np.array([0, stamp_ns]))


def test_single_pose_serves_its_own_stamp_only() -> None:
    trajectory = straight_drive([40])
    assert trajectory.has_pose(np.array([39 * MS, 40 * MS, 41 * MS])).tolist() == [False, True, False]
    assert trajectory.pose_at(40 * MS)[0, 3] == pytest.approx(0.04)


@no_deadline
@given(
    st.lists(st.integers(0, 3000), min_size=1, max_size=12, unique=True).map(sorted),
    st.lists(st.integers(-100, 3100), min_size=1, max_size=5),
)
def test_has_pose_tells_exactly_which_stamps_poses_at_accepts(stamps: list[int], wanted: list[int]) -> None:
    trajectory = straight_drive(stamps)
    for stamp, known in zip(wanted, trajectory.has_pose(np.array(wanted) * MS), strict=True):
        if known:
            assert trajectory.pose_at(stamp * MS)[0, 3] == pytest.approx(stamp / 1000, abs=1e-9)
        else:
            with pytest.raises(TrajectoryError):
                trajectory.pose_at(stamp * MS)


@pytest.mark.parametrize("stamps", [[0, 10, 10], [0, 10, 5]])
def test_stamps_that_do_not_increase_are_refused_with_their_place(stamps: list[int]) -> None:
    with pytest.raises(TrajectoryError, match="pose 3 has stamp"):
        straight_drive(stamps)


def test_trajectory_without_poses_is_refused() -> None:
    with pytest.raises(TrajectoryError, match="at least one"):
        Trajectory(stamps_ns=np.empty(0), map_from_camera=np.empty((0, 4, 4)))


def test_as_many_poses_as_stamps_are_required() -> None:
    with pytest.raises(TrajectoryError, match="2 stamps and 1 poses"):
        Trajectory(stamps_ns=np.array([0, 1]), map_from_camera=np.eye(4)[None])


def test_trajectory_cannot_be_written_to_and_does_not_follow_its_source() -> None:
    poses = np.eye(4)[None].copy()
    trajectory = Trajectory(stamps_ns=np.array([0]), map_from_camera=poses)
    poses[0, 0, 3] = 9.0
    assert trajectory.pose_at(0)[0, 3] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        trajectory.map_from_camera[0, 0, 3] = 1.0


def test_length_is_the_number_of_poses() -> None:
    assert len(straight_drive([0, 30, 60])) == 3


def test_a_stamp_printed_by_way_of_a_float_is_the_same_stamp() -> None:
    trajectory = straight_drive([0, 2000])
    assert trajectory.has_pose(np.array([2000 * MS - 240, 500 * MS])).tolist() == [True, False]
    np.testing.assert_array_equal(trajectory.pose_at(2000 * MS - 240), trajectory.map_from_camera[1])
