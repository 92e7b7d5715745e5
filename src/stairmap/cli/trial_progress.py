"""The progress bar of an evaluation: ``trial 12/90 · b3, kinect_v1 320 px, spot, seed 2`` on stderr."""

from __future__ import annotations

import sys
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


class TrialProgress:
    """Shows how far the trials are; nothing when stderr is no terminal.

    Parameters
    ----------
    num_trials
        How many there will be.
    unit
        What each is called.
    """

    def __init__(self, num_trials: int, *, unit: str = "trial") -> None:
        self._num_trials, self._unit = num_trials, unit
        self._count = 0
        self._progress = Progress(
            BarColumn(bar_width=20),
            TimeRemainingColumn(),
            TextColumn("{task.description}"),
            console=Console(stderr=True),
            transient=True,
            disable=not sys.stderr.isatty(),
        )
        self._task = self._progress.add_task(f"{unit} 0/{num_trials}", total=num_trials)

    def __enter__(self) -> TrialProgress:
        self._progress.start()
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def advance(self, text: str) -> None:
        """Count one more trial and say which."""
        self._count += 1
        self._progress.update(
            self._task,
            completed=self._count,
            description=f"{self._unit} {self._count}/{self._num_trials} · {text}",
        )
