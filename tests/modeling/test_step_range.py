"""Which steps a flight has, and whether its ends were seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from stairmap.modeling.step_range import SeenSteps, StepRange, find_step_range


def steps_of(*views: tuple[range, dict[str, Any]]) -> StepRange:
    """The range of a flight by views of some steps: with floor or top seen, from below or from above."""
    return find_step_range(
        SeenSteps(
            edge_step=np.concatenate([np.array(list(steps)) for steps, _ in views]),
            from_below=np.concatenate(
                [np.full(len(steps), how.get("from_below", True)) for steps, how in views]
            ),
            lowest=np.array([min(steps) for steps, _ in views]),
            highest=np.array([max(steps) for steps, _ in views]),
            floor_seen=np.array([how.get("floor", False) for _, how in views]),
            top_seen=np.array([how.get("top", False) for _, how in views]),
        )
    )


WHOLE = (range(8), {})
FLOOR = (range(8), {"floor": True})
TOP = (range(8), {"top": True})


def test_all_steps_that_were_seen_count_and_ends_that_were_not_are_open() -> None:
    assert steps_of(*[WHOLE] * 5) == (0, 7, False, False)


def test_two_views_that_saw_an_end_close_it_and_one_does_not() -> None:
    assert steps_of(*[WHOLE] * 5, FLOOR) == (0, 7, False, False)
    assert steps_of(*[WHOLE] * 5, FLOOR, FLOOR) == (0, 7, True, False)
    assert steps_of(*[WHOLE] * 5, TOP) == (0, 7, False, False)
    assert steps_of(*[WHOLE] * 5, TOP, TOP) == (0, 7, False, True)
    assert steps_of(*[FLOOR] * 2, *[TOP] * 2) == (0, 7, True, True)


def test_views_that_disagree_where_the_floor_is_close_no_end() -> None:
    apart = [(range(0, 8), {"floor": True}), (range(1, 8), {"floor": True})]
    assert not steps_of(*[WHOLE] * 3, *apart).bottom_seen


def test_steps_beyond_a_floor_that_more_views_saw_are_cut() -> None:
    seen = steps_of(*[(range(1, 8), {"floor": True, "top": True})] * 4, *[(range(9), {})] * 3)
    assert seen == (1, 7, True, True)


def test_steps_beyond_a_floor_that_as_many_views_saw_stay_and_the_end_is_open() -> None:
    seen = steps_of(*[(range(1, 8), {"floor": True})] * 4, *[(range(8), {})] * 4)
    assert seen == (0, 7, False, False)
    seen = steps_of(*[(range(7), {"top": True})] * 4, *[(range(8), {})] * 4)
    assert seen == (0, 7, False, False)


def test_an_end_seen_below_steps_that_are_not_counted_is_not_that_of_the_flight() -> None:
    # One view in twenty saw two steps lower, with a floor there: those are not counted.
    seen = steps_of(*[WHOLE] * 40, *[(range(-2, 8), {"floor": True})] * 2)
    assert (seen.first, seen.bottom_seen) == (0, False)


@pytest.mark.parametrize(("num", "first"), [(2, 0), (3, -1)])
def test_a_step_below_counts_when_enough_views_saw_it(num: int, first: int) -> None:
    # 8 % of 30 views and those themselves: 2.56 and 2.64.
    assert steps_of(*[WHOLE] * 30, *[(range(-1, 8), {})] * num).first == first


@pytest.mark.parametrize(("num", "last"), [(5, 7), (6, 8)])
def test_a_step_above_counts_by_the_views_from_below_of_the_one_under_it(num: int, last: int) -> None:
    # 15 % of 36 views: 5.4.
    views = [WHOLE] * (36 - num) + [(range(9), {})] * num
    assert steps_of(*views).last == last
    from_above = [(range(8), {"from_below": False})] * (36 - num) + [(range(9), {"from_below": False})] * num
    assert steps_of(*from_above).last == 8


def test_a_step_that_one_view_saw_counts_only_where_there_is_no_other_view() -> None:
    assert steps_of(WHOLE, (range(9), {})).last == 7
    assert steps_of((range(9), {})).last == 8


def test_views_that_share_no_step_twice_still_give_all_of_them() -> None:
    assert steps_of((range(2), {}), (range(3, 5), {}))[:2] == (0, 4)
