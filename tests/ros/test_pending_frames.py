"""The newest image that can be placed wins; none waits longer than allowed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stairmap.arrays import Transform
from stairmap.errors import TransformLookupError, TransformProblem
from stairmap_ros.pending_frames import MAX_PENDING, MAX_PLACED, PendingFrame, PendingFrames

Find = Callable[[PendingFrame[str]], Transform]


def frame(stamp_ns: int, arrived: float = 0.0) -> PendingFrame[str]:
    return PendingFrame(message=f"image {stamp_ns}", stamp_ns=stamp_ns, arrived=arrived)


def known_until(last_ns: int, problem: TransformProblem = TransformProblem.NOT_YET) -> Find:
    def find_pose(pending: PendingFrame[str]) -> Transform:
        if pending.stamp_ns > last_ns:
            raise TransformLookupError(f"no transform at {pending.stamp_ns}", problem)
        return np.eye(4)

    return find_pose


def filled(*stamps_ns: int, max_wait: float = 0.3) -> PendingFrames[str]:
    pending: PendingFrames[str] = PendingFrames(max_wait=max_wait)
    for stamp_ns in stamps_ns:
        pending.put(frame(stamp_ns))
    return pending


def stamps_taken(pending: PendingFrames[str], find_pose: Find, now: float) -> list[int]:
    """Stamps of all images that can be taken at a moment, in their order."""
    taken = []
    while (placed := pending.take(find_pose, now)) is not None:
        taken.append(placed.frame.stamp_ns)
    return taken


def test_the_newest_image_comes_first_and_those_before_it_follow() -> None:
    # Odometry of 5 Hz places six images of a 30 Hz camera at once: none of them is lost.
    pending = filled(1, 2, 3, 4, 5, 6)
    assert stamps_taken(pending, known_until(6), now=0.2) == [6, 5, 4, 3, 2, 1]
    assert (pending.num_superseded, pending.num_unplaced) == (0, 0)


def test_an_image_that_comes_meanwhile_is_taken_before_older_ones() -> None:
    pending = filled(1, 2, 3)
    placed = pending.take(known_until(10), now=0.0)
    assert placed is not None
    assert placed.frame.stamp_ns == 3
    pending.put(frame(4))
    assert stamps_taken(pending, known_until(10), now=0.03) == [4, 2, 1]


def test_images_whose_turn_does_not_come_are_passed_over_and_counted() -> None:
    pending = filled(*range(MAX_PLACED + 5))
    assert len(stamps_taken(pending, known_until(100), now=0.0)) == MAX_PLACED
    assert pending.num_superseded == 5


def test_the_worker_goes_on_at_once_while_images_wait_for_their_turn() -> None:
    pending = filled(1, 2)
    assert pending.wait(timeout=0.0)
    pending.take(known_until(10), now=0.0)
    assert pending._news
    pending.wait(timeout=0.0)
    pending.take(known_until(10), now=0.0)
    assert not pending._news


def test_the_newest_image_with_a_transform_is_taken_and_a_newer_one_waits() -> None:
    pending = filled(1, 2, 3)
    placed = pending.take(known_until(2), now=0.1)
    assert placed is not None
    assert placed.frame.stamp_ns == 2
    assert stamps_taken(pending, known_until(2), now=0.1) == [1]
    assert stamps_taken(pending, known_until(3), now=0.2) == [3]
    assert (pending.num_superseded, pending.num_unplaced) == (0, 0)


def test_an_image_is_given_up_when_it_has_waited_long_enough() -> None:
    pending = filled(5)
    assert pending.take(known_until(2), now=0.29) is None
    assert pending.num_unplaced == 0
    assert pending.take(known_until(2), now=0.31) is None
    assert pending.num_unplaced == 1
    assert "no transform at 5" in str(pending.last_problem)
    assert pending.take(known_until(10), now=0.32) is None


def test_an_image_that_no_waiting_helps_is_given_up_at_once() -> None:
    pending = filled(5)
    assert pending.take(known_until(2, TransformProblem.TOO_EARLY), now=0.0) is None
    assert pending.num_unplaced == 1


def test_a_placed_image_ends_the_trouble() -> None:
    pending = filled(5)
    pending.take(known_until(2, TransformProblem.GAP), now=0.0)
    pending.put(frame(6))
    pending.take(known_until(10), now=0.0)
    assert pending.last_problem is None


def test_the_queue_stays_short() -> None:
    pending = filled(*range(MAX_PENDING + 5))
    assert pending.num_unplaced == 5
    placed = pending.take(known_until(5), now=0.0)
    assert placed is not None
    assert placed.frame.stamp_ns == 5


def test_waiting_ends_with_news_and_with_the_queue() -> None:
    pending = filled(1)
    assert pending.wait(timeout=10.0)
    pending.transforms_changed()
    assert pending.wait(timeout=10.0)
    pending.close()
    assert not pending.wait(timeout=10.0)
