"""Frames that a thread reads ahead come as they would without it."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest

from stairmap.errors import RecordingError
from stairmap.recordings.frame_iterators import NUM_AHEAD, read_ahead


def test_items_come_in_their_order_and_all_of_them() -> None:
    assert list(read_ahead(iter(range(50)))) == list(range(50))
    assert list(read_ahead(iter([]))) == []
    assert list(read_ahead(iter([None, 0, ""]))) == [None, 0, ""]


def test_an_error_comes_after_the_items_before_it() -> None:
    def broken() -> Iterator[int]:
        yield from range(7)
        raise RecordingError("the cable was pulled")

    seen = []
    with pytest.raises(RecordingError, match="the cable was pulled"):
        for item in read_ahead(broken()):
            seen.append(item)  # noqa: PERF402
    assert seen == list(range(7))


def test_nothing_is_read_ahead_where_it_would_take_a_core_from_others() -> None:
    asked = []

    def items() -> Iterator[int]:
        for item in range(3):
            asked.append(threading.current_thread())
            yield item

    for number, item in enumerate(read_ahead(items(), num_ahead=0), start=1):
        assert item == number - 1 and len(asked) == number
    assert asked == [threading.current_thread()] * 3


def test_only_a_few_items_are_read_ahead_and_none_after_the_end() -> None:
    asked = []

    def slow() -> Iterator[int]:
        for item in range(100):
            asked.append((item, threading.current_thread().name))
            yield item

    items = read_ahead(slow())
    assert next(items) == 0
    time.sleep(0.05)
    assert 1 < len(asked) <= 2 + NUM_AHEAD
    assert all(thread != threading.current_thread().name for _, thread in asked)
    items.close()
    num_asked = len(asked)
    time.sleep(0.05)
    assert len(asked) == num_asked
