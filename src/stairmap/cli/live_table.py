"""The table on the terminal while a camera looks: what is in view now, and what is in the map."""

from __future__ import annotations

import sys
import time
from types import TracebackType

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from stairmap.cli.live_session import LiveSession
from stairmap.detection.observation import Detection
from stairmap.export.summary import format_table
from stairmap.recordings.realsense import RealSenseCamera

PERIOD = 0.2
"""Time between two updates, s."""

RATE_MEMORY = 0.9
"""Share of the mean time per frame that a new frame leaves."""

COLUMNS = ("view", "steps", "distance m", "rise mm", "run mm", "width mm", "pitch deg")


class LiveTable:
    """Shows each moment on stderr; nothing when that is no terminal."""

    def __init__(self, camera: RealSenseCamera) -> None:
        self._camera = camera
        self._console = Console(stderr=True)
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._is_shown = sys.stderr.isatty()
        self._last = self._drawn = time.monotonic()
        self._period = 1.0 / max(camera.rate, 1.0)

    def __enter__(self) -> LiveTable:
        if self._is_shown:
            self._live.start()
            self._live.update(
                Text(f"{self._camera.name}: waiting for the first frame; Ctrl-C ends"), refresh=True
            )
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._is_shown:
            self._live.stop()

    def show(self, session: LiveSession, detection: Detection) -> None:
        """Show one frame."""
        now = time.monotonic()
        self._period = RATE_MEMORY * self._period + (1 - RATE_MEMORY) * (now - self._last)
        self._last = now
        if self._is_shown and now - self._drawn >= PERIOD:
            self._drawn = now
            self._live.update(self._render(session, detection), refresh=True)

    def _render(self, session: LiveSession, detection: Detection) -> Group:
        up = "the accelerometer" if self._camera.has_accelerometer else "the floor"
        head = (
            f"{self._camera.name} · frame {session.collector.num_frames} · "
            f"{1 / max(self._period, 1e-6):.0f} fps · {session.num_skipped} skipped · "
            f"up from {up} · Ctrl-C ends"
        )
        parts: list[Text | Table] = [Text(head), observation_table(detection)]
        if session.stairways:
            parts.append(Text("\nin the map so far\n" + format_table(session.stairways)))
        return Group(*parts)


def observation_table(detection: Detection) -> Table:
    """Return what one frame shows, or the first reason why it shows no stairs."""
    table = Table(*COLUMNS, title="in view now", title_justify="left", box=None)
    for cells in observation_rows(detection):
        table.add_row(*cells)
    if not detection.observations:
        reason = f" ({detection.rejections[0]})" if detection.rejections else ""
        table.title = f"in view now: no stairs{reason}"
    return table


def observation_rows(detection: Detection) -> list[tuple[str, ...]]:
    """Return the text of each of ``COLUMNS`` for each observation of a frame."""
    return [
        (
            observation.view,
            str(observation.num_steps),
            f"{min(float(np.linalg.norm(edge.nosing.mean(axis=0))) for edge in observation.edges):.2f}",
            *(f"{value * 1e3:.0f}" for value in (observation.rise, observation.run, observation.width)),
            f"{np.degrees(observation.pitch):.1f}",
        )
        for observation in detection.observations
    ]
