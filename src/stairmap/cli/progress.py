"""The progress bar of long work: ``frame 812/2400 · 31 fps · 2 stairways`` on stderr."""

from __future__ import annotations

import sys
import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn

_PERIOD = 0.1
"""Time between two updates, s."""

_PATIENCE = 0.5
"""What takes no longer, s, needs no bar."""


class FrameProgress:
    """Shows how far the frames are; nothing when stderr is no terminal.

    Parameters
    ----------
    num_frames
        How many there will be; ``None`` if ``advance`` will tell.
    """

    def __init__(self, num_frames: int | None) -> None:
        self._num_frames = num_frames
        self._count = 0
        self._started = time.monotonic()
        self._updated = self._started
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            console=Console(stderr=True),
            transient=True,
            disable=not sys.stderr.isatty(),
        )
        self._task = self._progress.add_task(self._describe(""), total=num_frames)

    def __enter__(self) -> FrameProgress:
        self._progress.start()
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def advance(self, found: str = "", *, num_frames: int | None = None) -> None:
        """Count one more frame.

        Parameters
        ----------
        found
            What was found so far, such as ``2 stairways``.
        num_frames
            How many frames there will be, if it was not known before.
        """
        self._num_frames = self._num_frames if num_frames is None else num_frames
        self._count += 1
        now = time.monotonic()
        if now - self._updated >= _PERIOD:
            self._updated = now
            description = self._describe(found)
            self._progress.update(
                self._task, total=self._num_frames, completed=self._count, description=description
            )

    def _describe(self, found: str) -> str:
        seconds = time.monotonic() - self._started
        parts = [f"frame {self._count}/{self._num_frames or '?'}"]
        parts += [f"{self._count / seconds:.0f} fps"] if self._count and seconds > 0 else []
        return " · ".join([*parts, *([found] if found else [])])


class OpeningProgress:
    """Shows how far the opening of a recording is; nothing if it takes no time, or without a terminal.

    Parameters
    ----------
    name
        Of the recording.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            console=Console(stderr=True),
            transient=True,
            disable=not sys.stderr.isatty(),
        )
        self._started = time.monotonic()
        self._task: TaskID | None = None

    def __enter__(self) -> OpeningProgress:
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def update(self, count: int, total: int) -> None:
        """Tell how many of how many messages were read."""
        if self._task is None:
            if time.monotonic() - self._started < _PATIENCE:
                return
            self._progress.start()
            self._task = self._progress.add_task("", total=total)
        description = f"reading {self._name} · message {count}/{total}"
        self._progress.update(self._task, completed=count, total=total, description=description)
