"""How far long work is, on stderr: ``frame 812/2400 · 31 fps · 2 stairways · ends 14:32:05``.

A bar on a terminal; elsewhere, as in a log, a line a minute.
"""

from __future__ import annotations

import sys
import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from stairmap.input_files import shown

_PERIOD = 0.1
"""Time between two updates of a bar, s."""

LINE_PERIOD = 60.0
"""Time between two lines where there is no terminal, s."""

_PATIENCE = 0.5
"""What takes no longer, s, needs no bar."""

_MIN_SHARE = 0.02
"""Below this share of the work nobody knows when it ends."""


class _Bar:
    """A bar on a terminal, a line now and then elsewhere."""

    def __init__(self) -> None:
        self._is_terminal = sys.stderr.isatty()
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            console=Console(stderr=True),
            transient=True,
            disable=not self._is_terminal,
        )
        self._task: TaskID | None = None
        self._period = _PERIOD if self._is_terminal else LINE_PERIOD
        self.started = self._updated = time.monotonic()

    def start(self, text: str, total: int | None) -> None:
        if self._task is None:
            self._progress.start()
            self._task = self._progress.add_task(text, total=total)

    def stop(self) -> None:
        self._progress.stop()

    def is_due(self) -> bool:
        return time.monotonic() - self._updated >= self._period

    def show(self, text: str, count: int, total: int | None, *, num_known: int = 0) -> None:
        now = time.monotonic()
        self._updated = now
        if total and count - num_known > 0 and count - num_known >= _MIN_SHARE * (total - num_known):
            rest = (now - self.started) / (count - num_known) * max(total - count, 0)
            text += f" · ends {time.strftime('%H:%M:%S', time.localtime(time.time() + rest))}"
        if self._is_terminal and self._task is not None:
            self._progress.update(self._task, total=total, completed=count, description=text)
        elif not self._is_terminal:
            sys.stderr.write(f"{text}\n")
            sys.stderr.flush()


class _WithBar:
    """Owns a bar, and clears it where the work ends."""

    def __init__(self) -> None:
        self._bar = _Bar()

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._bar.stop()


class FrameProgress(_WithBar):
    """Shows how far the frames are.

    Parameters
    ----------
    num_frames
        How many there will be; ``None`` if ``advance`` will tell.
    """

    def __init__(self, num_frames: int | None) -> None:
        super().__init__()
        self._num_frames = num_frames
        self._count = 0

    def __enter__(self) -> FrameProgress:
        self._bar.start(self._describe(""), self._num_frames)
        return self

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
        if self._bar.is_due():
            self._bar.show(self._describe(found), self._count, self._num_frames)

    def _describe(self, found: str) -> str:
        seconds = time.monotonic() - self._bar.started
        parts = [f"frame {self._count}/{self._num_frames or '?'}"]
        parts += [f"{self._count / seconds:.0f} fps"] if self._count and seconds > 0 else []
        return " · ".join([*parts, *([found] if found else [])])


class OpeningProgress(_WithBar):
    """Shows how far the opening of a recording is; nothing if it takes no time.

    Parameters
    ----------
    name
        Of the recording.
    """

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = shown(name)

    def __enter__(self) -> OpeningProgress:
        return self

    def update(self, count: int, total: int) -> None:
        """Tell how many of how many messages were read."""
        if time.monotonic() - self._bar.started < _PATIENCE:
            return
        self._bar.start("", total)
        if self._bar.is_due():
            self._bar.show(f"reading {self._name} · message {count}/{total}", count, total)


class PointProgress(_WithBar):
    """Shows how far the points of a map are: ``12.4 of 50.0 million points · ends 14:32:05``.

    Parameters
    ----------
    num_points
        How many there will be; ``None`` if nobody knows.
    """

    def __init__(self, num_points: int | None) -> None:
        super().__init__()
        self._num_points = num_points
        self._count = 0

    def __enter__(self) -> PointProgress:
        self._bar.start(self._describe(), self._num_points)
        return self

    def advance(self, num_points: int) -> None:
        """Count more points."""
        self._count += num_points
        if self._bar.is_due():
            self._bar.show(self._describe(), self._count, self._num_points)

    def _describe(self) -> str:
        of = "" if self._num_points is None else f" of {self._num_points / 1e6:.1f}"
        return f"{self._count / 1e6:.1f}{of} million points"


class TrialProgress(_WithBar):
    """Shows how far the trials of an evaluation are: ``trial 12/90 · b3, kinect_v1 320 px, spot, seed 2``.

    Parameters
    ----------
    num_trials
        How many there will be.
    unit
        What each is called.
    num_known
        Of these, done before: they say nothing of when the others end.
    """

    def __init__(self, num_trials: int, *, unit: str = "trial", num_known: int = 0) -> None:
        super().__init__()
        self._num_trials, self._unit = num_trials, unit
        self._count = self._num_known = num_known

    def __enter__(self) -> TrialProgress:
        self._bar.start(f"{self._unit} {self._count}/{self._num_trials}", self._num_trials)
        return self

    def advance(self, text: str) -> None:
        """Count one more trial and say which."""
        self._count += 1
        if self._bar.is_due():
            described = f"{self._unit} {self._count}/{self._num_trials} · {text}"
            self._bar.show(described, self._count, self._num_trials, num_known=self._num_known)
