"""Frames with their number in the recording, or with their pose."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import chain, islice
from typing import TypeVar, cast

import numpy as np

from stairmap.arrays import Transform
from stairmap.frame import DepthFrame
from stairmap.recordings.base import Recording
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.trajectory import Trajectory

T = TypeVar("T")

NUM_AHEAD = 3
"""So many frames are read while others are looked at: decoding takes about as long as looking."""


def numbered_frames(recording: Recording, *, num_ahead: int = NUM_AHEAD) -> Iterator[tuple[int, DepthFrame]]:
    """Return (number, frame) from 0 in the order of the recording.

    A frame that cannot be read leaves a gap, so that a number always names the same image. The first
    frame is read at once: who asks before making a results folder makes none for an unreadable recording.
    A thread reads the next ones ahead, in the same order.

    Parameters
    ----------
    recording
        Where they come from.
    num_ahead
        See ``read_ahead``.

    Raises
    ------
    RecordingError
        If no image can be read.
    """
    frames = ((count + len(recording.problems.skipped), frame) for count, frame in enumerate(recording))
    return chain(list(islice(frames, 1)), read_ahead(frames, num_ahead=num_ahead))


def read_ahead(items: Iterator[T], *, num_ahead: int = NUM_AHEAD) -> Iterator[T]:
    """Return the same items, some of which a thread asks for before they are wanted.

    An error comes where the iterator raised it. Nothing is asked for any more once the iteration is left.
    With ``num_ahead`` 0 there is no thread: for processes that have one core each.
    """
    if not num_ahead:
        yield from items
        return
    end = object()
    pool = ThreadPoolExecutor(1, thread_name_prefix="read ahead")
    try:
        pending = deque(pool.submit(next, items, end) for _ in range(num_ahead))
        while (item := pending.popleft().result()) is not end:
            pending.append(pool.submit(next, items, end))
            yield cast(T, item)
    finally:
        pool.shutdown(cancel_futures=True)


def frames_between(recording: Recording, first_ns: int, last_ns: int) -> Iterator[DepthFrame]:
    """Return the frames of a recording from one stamp to another, both included, nanoseconds.

    Of an image folder only these are read; of a bag all before them are too.
    """
    if isinstance(recording, ImageFolderRecording):
        yield from recording.frames_between(first_ns, last_ns)
        return
    for frame in recording:
        if frame.stamp_ns > last_ns:
            return
        if frame.stamp_ns >= first_ns:
            yield frame


def placed_frames(
    recording: Recording, trajectory: Trajectory | None = None
) -> Iterator[tuple[DepthFrame, Transform]]:
    """Return (frame, map_from_camera) for each frame that has a pose, in the order of the recording.

    Parameters
    ----------
    recording
        Where frames come from.
    trajectory
        Poses in a level map; the recording's own if not given.

    Raises
    ------
    TrajectoryError
        If neither gives a pose.
    """
    poses = recording.check_poses() if trajectory is None else trajectory
    for frame in recording:
        if poses.has_pose(np.array([frame.stamp_ns]))[0]:
            yield frame, poses.pose_at(frame.stamp_ns)
