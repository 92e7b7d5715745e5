"""Images on their way to the worker: the newest that can be placed wins, and none waits for ever.

No ROS in here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition
from typing import Generic, TypeVar

from stairmap.arrays import Transform
from stairmap.errors import TransformLookupError, TransformProblem

T = TypeVar("T")

MAX_PENDING = 64
"""Images that may wait for their transform: 1 s at 60 Hz, 40 MB."""


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


class PendingFrames(Generic[T]):
    """A short queue that gives the newest placeable image and forgets all older ones.

    Safe to use from several threads.

    Parameters
    ----------
    max_wait
        How long an image may wait for its transform, s.

    Attributes
    ----------
    num_superseded
        Images passed over because a newer one could be placed: the worker was busy.
    num_unplaced
        Images given up because no transform came.
    last_problem
        Why the last image could not be placed; ``None`` once one could.
    """

    def __init__(self, *, max_wait: float) -> None:
        self._max_wait = max_wait
        self._frames: list[PendingFrame[T]] = []
        self._changed = Condition()
        self._is_closed = False
        self._news = False
        self.num_superseded = 0
        self.num_unplaced = 0
        self.last_problem: TransformLookupError | None = None

    def put(self, frame: PendingFrame[T]) -> None:
        """Add an image; an overfull queue forgets its oldest."""
        with self._changed:
            self._frames.append(frame)
            if len(self._frames) > MAX_PENDING:
                del self._frames[0]
                self.num_unplaced += 1
            self._news = True
            self._changed.notify_all()

    def transforms_changed(self) -> None:
        """Tell that an image which had to wait may be placed now."""
        with self._changed:
            if self._frames:
                self._news = True
                self._changed.notify_all()

    def clear(self) -> None:
        """Forget all images."""
        with self._changed:
            self._frames.clear()

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

    def take(self, find_pose: Callable[[PendingFrame[T]], Transform], now: float) -> PlacedFrame[T] | None:
        """Take the newest image that can be placed.

        Parameters
        ----------
        find_pose
            Gives ``map_from_camera`` of an image, or raises ``TransformLookupError``. One of a transform
            that is not there yet makes the image wait, any other gives it up.
        now
            Time on the clock of ``PendingFrame.arrived``, s.
        """
        with self._changed:
            frames = list(self._frames)
        given_up = []
        placed = None
        for index in range(len(frames) - 1, -1, -1):
            frame = frames[index]
            try:
                placed = PlacedFrame(frame=frame, map_from_camera=find_pose(frame))
            except TransformLookupError as error:
                may_come = error.problem in (TransformProblem.NOT_YET, TransformProblem.UNKNOWN_FRAME)
                if not may_come or now - frame.arrived > self._max_wait:
                    given_up.append(frame)
                    self.last_problem = error
                continue
            self.num_superseded += index
            given_up += frames[: index + 1]
            self.last_problem = None
            break
        num_unplaced = len(given_up) if placed is None else len(given_up) - index - 1
        with self._changed:
            self.num_unplaced += num_unplaced
            gone = {id(frame) for frame in given_up}
            self._frames = [frame for frame in self._frames if id(frame) not in gone]
        return placed
