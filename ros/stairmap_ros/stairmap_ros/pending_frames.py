"""Images on their way to the worker: each waits for its transform, then for its turn; none for ever.

Transforms come in bunches: with odometry of 5 Hz, six images of a 30 Hz camera can be placed at once. The
newest is
looked at first, so that answers come without delay; those before it follow while nothing newer is there. No
ROS in here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition
from typing import Generic, TypeVar

from stairmap.arrays import Transform
from stairmap.errors import TransformLookupError, TransformProblem

T = TypeVar("T")

MAX_PENDING = 100
"""Images that may wait for their transform: 3 s at 30 Hz, 60 MB at 640x480."""

MAX_PLACED = 30
"""Images that have their transform and may wait for their turn: 20 MB at 640x480. A worker that is slower
than the camera would never come to more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingFrame(Generic[T]):
    """An image that has arrived: its message, stamp in nanoseconds, and arrival on the monotonic clock, s."""

    message: T
    stamp_ns: int
    arrived: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedFrame(Generic[T]):
    """An image with the (4, 4) pose of its camera in the map."""

    frame: PendingFrame[T]
    map_from_camera: Transform


FindPose = Callable[[PendingFrame[T]], Transform]
"""Gives ``map_from_camera`` of an image, or raises ``TransformLookupError``."""


class PendingFrames(Generic[T]):
    """Images that wait; gives the newest that can be placed. Safe to use from several threads.

    Parameters
    ----------
    max_wait
        How long an image may wait for its transform, s.

    Attributes
    ----------
    num_superseded
        Images passed over because newer ones kept the worker busy.
    num_unplaced
        Images given up because no transform came.
    last_problem
        Why the last image could not be placed; ``None`` once one could.
    """

    def __init__(self, *, max_wait: float) -> None:
        self._max_wait = max_wait
        self._waiting: deque[PendingFrame[T]] = deque()
        self._placed: list[PlacedFrame[T]] = []
        self._changed = Condition()
        self._is_closed = False
        self._news = False
        self.num_superseded = 0
        self.num_unplaced = 0
        self.last_problem: TransformLookupError | None = None

    def put(self, frame: PendingFrame[T]) -> None:
        """Add an image; an overfull queue forgets its oldest."""
        with self._changed:
            self._waiting.append(frame)
            if len(self._waiting) > MAX_PENDING:
                self._waiting.popleft()
                self.num_unplaced += 1
            self._news = True
            self._changed.notify_all()

    def transforms_changed(self) -> None:
        """Tell that an image which had to wait may be placed now."""
        with self._changed:
            if self._waiting:
                self._news = True
                self._changed.notify_all()

    def clear(self) -> None:
        """Forget all images."""
        with self._changed:
            self._waiting.clear()
            self._placed.clear()

    def open(self) -> None:
        """Let a worker wait, after ``close``; images of before are forgotten."""
        with self._changed:
            self._is_closed = False
            self._waiting.clear()
            self._placed.clear()

    def close(self) -> None:
        """Wake the worker for the last time."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()

    def wait(self, timeout: float) -> bool:
        """Block until something changed or the time is over, s; false once the queue is closed."""
        with self._changed:
            if not self._news and not self._is_closed:
                self._changed.wait(timeout)
            self._news = False
            return not self._is_closed

    def take(self, find_pose: FindPose[T], now: float) -> PlacedFrame[T] | None:
        """Take the newest image that can be placed.

        Parameters
        ----------
        find_pose
            Where images were taken. Its error of a transform that is not there yet makes the image wait, any
            other gives it up.
        now
            Time on the clock of ``PendingFrame.arrived``, s.
        """
        with self._changed:
            self._place_waiting(find_pose, now)
            num_passed_over = max(0, len(self._placed) - MAX_PLACED)
            del self._placed[:num_passed_over]
            self.num_superseded += num_passed_over
            taken = self._placed.pop() if self._placed else None
            self._news |= bool(self._placed)
        return taken

    def _place_waiting(self, find_pose: FindPose[T], now: float) -> None:
        """Place images in the order of their arrival, up to the first whose transform may still come."""
        while self._waiting:
            frame = self._waiting[0]
            try:
                placed = PlacedFrame(frame=frame, map_from_camera=find_pose(frame))
            except TransformLookupError as error:
                may_come = error.problem in (TransformProblem.NOT_YET, TransformProblem.UNKNOWN_FRAME)
                if may_come and now - frame.arrived <= self._max_wait:
                    return
                self.num_unplaced += 1
                self.last_problem = error
            else:
                self._placed.append(placed)
                self.last_problem = None
            self._waiting.popleft()
