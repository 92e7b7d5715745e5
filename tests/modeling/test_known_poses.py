"""Which poses may be other than those of the last query."""

from __future__ import annotations

import numpy as np

from ideal_observations import MS, make_flight, poses_before, trajectory_of, turned_map
from stairmap.arrays import IntArray
from stairmap.modeling.known_poses import KnownPoses, PoseChange, PoseMemory
from stairmap.trajectory import Trajectory

POSES = poses_before(make_flight(), 10)


def asked(*trajectories: Trajectory, stamps_ns: IntArray) -> list[PoseChange]:
    """What each trajectory after the other says otherwise of the same stamps."""
    memory, known, changes = PoseMemory(), KnownPoses(), []
    for trajectory in trajectories:
        goes_on = memory.goes_on(trajectory)
        changes.append(known.renew(stamps_ns, trajectory, memory=memory, goes_on=goes_on))
        memory.keep(trajectory)
    return changes


def test_a_trajectory_goes_on_when_it_has_all_poses_of_the_last() -> None:
    memory = PoseMemory()
    assert not memory.goes_on(trajectory_of(POSES))
    memory.keep(trajectory_of(POSES[:6]))
    assert memory.goes_on(trajectory_of(POSES))
    assert memory.goes_on(trajectory_of(POSES[:6]))
    assert not memory.goes_on(trajectory_of(POSES[:5]))
    assert not memory.goes_on(trajectory_of([turned_map(0.0, (1e-12, 0, 0)) @ POSES[0], *POSES[1:]]))
    later = Trajectory(stamps_ns=np.arange(6) * 100 * MS + 1, map_from_camera=np.array(POSES[:6]))
    assert not memory.goes_on(later)


def test_the_same_trajectory_is_told_by_its_poses() -> None:
    memory = PoseMemory()
    assert not memory.has_same(trajectory_of(POSES))
    memory.keep(trajectory_of(POSES[:6]))
    assert memory.has_same(trajectory_of(POSES[:6]))
    assert not memory.has_same(trajectory_of(POSES))
    assert not memory.has_same(trajectory_of(POSES[:5]))
    assert not memory.has_same(trajectory_of([*POSES[:5], POSES[7]]))


def test_only_stamps_without_a_pose_or_at_the_end_are_asked_again() -> None:
    stamps = np.arange(10) * 100 * MS
    first, second = asked(trajectory_of(POSES[:6]), trajectory_of(POSES), stamps_ns=stamps)
    np.testing.assert_array_equal(first.chosen, np.arange(6))
    assert first.is_new.all() and not len(first.lost)
    # The last pose of a trajectory may be one of a stamp a little later.
    np.testing.assert_array_equal(second.chosen, np.arange(5, 10))
    np.testing.assert_array_equal(second.is_new, [False, True, True, True, True])
    np.testing.assert_array_equal(second.poses, np.array(POSES[5:]))


def test_another_trajectory_is_asked_for_all_and_says_what_it_lost() -> None:
    stamps = np.arange(10) * 100 * MS
    _, second, third = asked(
        trajectory_of(POSES), trajectory_of(POSES[:4]), trajectory_of(POSES), stamps_ns=stamps
    )
    np.testing.assert_array_equal(second.chosen, np.arange(4))
    assert not second.is_new.any()
    np.testing.assert_array_equal(second.lost, np.arange(4, 10))
    np.testing.assert_array_equal(third.chosen[third.is_new], np.arange(4, 10))


def test_stamps_outside_of_every_trajectory_have_no_pose() -> None:
    (change,) = asked(trajectory_of(POSES), stamps_ns=np.array([10_000 * MS]))
    assert not len(change.chosen) and change.poses.shape == (0, 4, 4)
