"""Open the recording that a command was asked for."""

from __future__ import annotations

from stairmap.cli.progress import OpeningProgress
from stairmap.cli.requests import MethodRequest
from stairmap.recordings.base import Recording
from stairmap.recordings.open import open_recording


def open_requested(given: MethodRequest, *, up: str | None = None) -> Recording:
    """Open a recording, with a progress bar if it takes long.

    Parameters
    ----------
    given
        What was asked for.
    up
        See ``open_recording``; what was asked for if not given.

    Raises
    ------
    StairmapError
        See ``open_recording``.
    """
    with OpeningProgress(given.recording.name) as progress:
        return open_recording(
            given.recording,
            trajectory=given.trajectory,
            up=given.up if up is None else up,
            bag=given.bag,
            watch=progress.update,
        )
