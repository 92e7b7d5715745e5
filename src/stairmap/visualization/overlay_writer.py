"""Draw the pictures of frames in the background, and write them in the order of the frames."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType

from stairmap.detection.observation import Detection
from stairmap.frame import DepthFrame
from stairmap.visualization.overlay import draw_detection, png_from_image

MAX_WAITING = 8
"""So many pictures are drawn or wait to be written: more would fill the memory where the disk is slow."""


class OverlayWriter:
    """Draws pictures of frames in a thread while others are looked at; use it as a context manager.

    Parameters
    ----------
    write
        Takes the number of a frame and its picture as the content of a PNG file. It is called by ``add`` and
        at the end, never in the thread.
    """

    def __init__(self, write: Callable[[int, bytes], object]) -> None:
        self._write = write
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="overlays")
        self._waiting: deque[tuple[int, Future[bytes]]] = deque()

    def __enter__(self) -> OverlayWriter:
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self._write_waiting(at_most=0)
        finally:
            self._pool.shutdown(cancel_futures=True)

    def add(self, number: int, frame: DepthFrame, detection: Detection) -> None:
        """Have the picture of a frame drawn, and write those that are ready."""
        self._waiting.append((number, self._pool.submit(_draw, frame, detection)))
        self._write_waiting(at_most=MAX_WAITING)

    def _write_waiting(self, *, at_most: int) -> None:
        while self._waiting and (len(self._waiting) > at_most or self._waiting[0][1].done()):
            number, picture = self._waiting.popleft()
            self._write(number, picture.result())


def _draw(frame: DepthFrame, detection: Detection) -> bytes:
    return png_from_image(draw_detection(frame, detection))
