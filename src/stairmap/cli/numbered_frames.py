"""Frames with their number in the recording, damaged ones counted too."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice

from stairmap.frame import DepthFrame
from stairmap.recordings.base import Recording


def numbered_frames(recording: Recording) -> Iterator[tuple[int, DepthFrame]]:
    """Return (number, frame) from 0 in the order of the recording.

    A frame that cannot be read leaves a gap, so that a number always names the same image. The first
    frame is read at once: who asks before making a results folder makes none for an unreadable recording.

    Raises
    ------
    RecordingError
        If no image can be read.
    """
    frames = ((count + len(recording.problems.skipped), frame) for count, frame in enumerate(recording))
    return chain(list(islice(frames, 1)), frames)
