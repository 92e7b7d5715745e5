"""Pieces of a trajectory: the longest counts, the rest is counted."""

from __future__ import annotations

import numpy as np
import pytest

from depth_drives import PERIOD_NS
from stairmap.recordings.odometry_pieces import DRIFT, UNDETERMINED_DRIFT, PieceCollector
from stairmap.recordings.registration import TrackedFrame, TrackState


def collected(*states, piece=0):
    collector = PieceCollector()
    add_all(collector, states, piece=piece)
    return collector


def add_all(collector, states, *, piece=0, first=0):
    for index, state in enumerate(states):
        pose = np.eye(4) if state.has_pose else None
        if pose is not None:
            pose[0, 3] = 0.5 * index
        stamp_ns = (first + index) * PERIOD_NS
        collector.add(TrackedFrame(stamp_ns=stamp_ns, state=state, piece=piece, piece_from_camera=pose))


def test_the_longest_piece_is_used():
    collector = collected(TrackState.START, TrackState.TRACKED)
    add_all(collector, [TrackState.LOST], first=2)
    add_all(collector, [TrackState.START] + 3 * [TrackState.TRACKED], piece=1, first=20)
    result = collector.result()
    assert (result.piece, len(result.trajectory), result.num_pieces, result.num_lost) == (1, 4, 2, 1)
    assert result.trajectory.stamps_ns[0] == 20 * PERIOD_NS
    assert "1 could not be registered, 2 belong to 1 other pieces" in result.to_lines()[1]


def test_a_motion_that_the_view_does_not_determine_drifts_more():
    result = collected(TrackState.START, *3 * [TrackState.UNDETERMINED]).result()
    assert DRIFT < result.drift < UNDETERMINED_DRIFT
    assert "in 3 of 4 frames the view does not determine" in result.to_lines()[-1]
    assert "the width where both ends of the steps were seen" in result.to_lines()[-1]
    assert result.path_length == pytest.approx(1.5)
