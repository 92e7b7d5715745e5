"""Look at a long recording in pieces of time, on several workers, with the same result to the bit.

Detection, which takes most of the time, looks at each frame by itself: pieces do it in parallel. Then one
task goes through all frames in order, as a run does, and takes the detections from there.
"""

from __future__ import annotations

import pickle
import tempfile
import zlib
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from stairmap.batch.job import RecordingJob, RecordingResult
from stairmap.batch.recording_task import open_for_batch
from stairmap.batch.task import check_version, fetch_input, guarded, perform
from stairmap.detection.observation import Detection
from stairmap.map_levelling import find_level_map
from stairmap.recordings.frame_iterators import frames_between
from stairmap.session import MapSession


def piece_bounds(num_frames: int, max_frames: int) -> list[tuple[int, int]]:
    """Return (first, end) frame numbers of pieces of nearly equal length, none above ``max_frames``."""
    num_pieces = -(-num_frames // max_frames)
    edges = np.linspace(0, num_frames, num_pieces + 1).round().astype(int).tolist()
    return list(pairwise(edges))


def detect_piece(job: RecordingJob, bounds: tuple[int, int]) -> bytes | RecordingResult:
    """Return the detections of a piece of a recording, for ``perform_with_pieces``, or why there are none."""
    return guarded(job, lambda: _detect_piece(job, bounds))


def _detect_piece(job: RecordingJob, bounds: tuple[int, int]) -> bytes:
    check_version(job)
    found: dict[int, Detection] = {}
    with tempfile.TemporaryDirectory(prefix="stairmap-") as scratch:
        opened = open_for_batch(fetch_input(job, Path(scratch)), job.settings)
        level_map = find_level_map(opened.recording, opened.up, max_depth=opened.config.detection.max_depth)
        session = MapSession(opened.config, method=job.settings.method)
        stamps = opened.recording.stamps_ns[bounds[0] : bounds[1]]
        for frame in frames_between(opened.recording, int(stamps[0]), int(stamps[-1])):
            if level_map.trajectory.has_pose(np.array([frame.stamp_ns]))[0]:
                pose = level_map.trajectory.pose_at(frame.stamp_ns)
                found[frame.stamp_ns] = session.detect(frame, pose)
    return zlib.compress(pickle.dumps(found), level=1)


def perform_with_pieces(job: RecordingJob, pieces: Sequence[bytes]) -> RecordingResult:
    """Make the run folder of a recording whose pieces were looked at; see ``perform``."""
    known: dict[int, Detection] = {}
    for piece in pieces:
        # It comes from a worker of the same cluster, which may run any code as it is.
        known.update(pickle.loads(zlib.decompress(piece)))
    return perform(replace(job, max_frames=0), known)
