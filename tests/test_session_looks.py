"""Frames that must see a stairway and do not: it is withdrawn, unless something hides it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import pytest

from analytic_stairs import AnalyticStairs, pose_looking
from solid_scenes import frame_of, room, stairs_solid
from stairmap.arrays import Transform
from stairmap.detection.observation import Detection
from stairmap.frame import DepthFrame
from stairmap.modeling.look_table import MAX_SUPPORT, NUM_VIEWS
from stairmap.modeling.mapper import StairwayMapper
from stairmap.session import FRAMES_UNTIL_ASKED, MIN_NEW_OBSERVATIONS, MapSession
from stairmap.simulation.triangle_mesh import TriangleMesh, make_block
from stairmap.trajectory import Trajectory

PERIOD_NS = 100_000_000
STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
WITH_STAIRS = [room(), stairs_solid(STAIRS)]
PERSON = make_block([-0.7, -0.9, 0.0], [-0.4, 0.9, 1.8])
NUM_SEEN = MIN_NEW_OBSERVATIONS + 2
NUM_MISSED = NUM_VIEWS - MAX_SUPPORT
NOTHING = Detection(stamp_ns=0, observations=(), rejections=())


def pose_at(index: int) -> Transform:
    return pose_looking((-1.9 + 0.02 * index, 0.1, 0.8), yaw=-0.02, down=0.15)


def frames_of(solids: Iterable[TriangleMesh], first: int, num: int) -> Iterator[tuple[DepthFrame, Transform]]:
    for index in range(first, first + num):
        pose = pose_at(index)
        yield frame_of(solids, pose, stamp_ns=index * PERIOD_NS, has_up=False), pose


SEEN = list(frames_of(WITH_STAIRS, 0, NUM_SEEN))
EMPTY = list(frames_of([room()], NUM_SEEN, NUM_MISSED + FRAMES_UNTIL_ASKED))
HIDDEN = list(frames_of([room(), PERSON], NUM_SEEN, NUM_MISSED + 5))


def show(session: MapSession, frames: Iterable[tuple[DepthFrame, Transform]]) -> MapSession:
    for frame, pose in frames:
        session.add(frame, pose)
    return session


def test_stairs_that_were_taken_away_are_withdrawn_at_the_end_of_a_run_that_never_asked() -> None:
    session = show(MapSession(), SEEN + EMPTY[:NUM_MISSED])
    assert session.stairways() == ()


def test_they_stand_while_too_few_frames_have_missed_them() -> None:
    session = show(MapSession(), SEEN + EMPTY[: NUM_MISSED - 1])
    assert len(session.stairways()) == 1


def test_somebody_in_front_of_the_stairs_does_not_withdraw_them() -> None:
    session = show(MapSession(), SEEN + HIDDEN)
    assert len(session.stairways()) == 1


def test_stairs_that_stand_on_are_seen_by_looks_even_where_no_edges_are_found() -> None:
    session = show(MapSession(), SEEN)
    for frame, pose in frames_of(WITH_STAIRS, NUM_SEEN, NUM_VIEWS):
        session.take(frame, NOTHING, pose)
    looks = session.state().modeler.looks
    # The last two of the frames that see the stairs look already: the tenth observation made them known.
    assert len(looks) == NUM_VIEWS + NUM_SEEN - MIN_NEW_OBSERVATIONS
    assert not looks["is_absent"].any()
    assert len(session.stairways()) == 1


@pytest.mark.parametrize("num_before", [3, NUM_MISSED])
def test_a_restored_session_knows_what_was_missed_and_goes_on_looking(num_before: int) -> None:
    session = show(MapSession(), SEEN + EMPTY[:num_before])
    restored = MapSession()
    restored.restore(session.state())
    assert len(restored.stairways()) == len(session.stairways()) == int(num_before < NUM_MISSED)
    other = MapSession()
    other.restore(session.state())
    show(other, EMPTY[num_before:])
    assert other.stairways() == ()


def test_frames_without_a_pose_do_not_look() -> None:
    session = show(MapSession(), SEEN)
    session.stairways()
    num_before = len(session.state().modeler.looks)
    for frame, _ in EMPTY:
        session.take(frame, NOTHING, None)
    assert len(session.state().modeler.looks) == num_before


def test_a_method_that_learns_nothing_from_looks_is_left_alone() -> None:
    session = show(MapSession(method="delmerico2013"), SEEN[:3])
    assert session.look(*EMPTY[0]) == ()


def test_asking_for_flights_gives_out_no_ids() -> None:
    session = show(MapSession(), SEEN)
    assert session.look(*EMPTY[0])
    assert session.state().modeler.next_id == 1
    (stairway,) = session.stairways()
    assert stairway.id == 1


class CountingMapper(StairwayMapper):
    """Counts how often its flights are asked for."""

    num_asked = 0

    def flights(self, trajectory: Trajectory):
        self.num_asked += 1
        return super().flights(trajectory)


def counting_session() -> tuple[MapSession, CountingMapper]:
    session = MapSession()
    mapper = CountingMapper(session.config)
    session.modeler = mapper
    return session, mapper


def test_flights_are_asked_for_when_observations_came_and_not_with_every_frame() -> None:
    session, mapper = counting_session()
    show(session, SEEN[:MIN_NEW_OBSERVATIONS])
    assert mapper.num_asked == 0
    show(session, SEEN[MIN_NEW_OBSERVATIONS:])
    assert mapper.num_asked == 1
    show(session, EMPTY)
    assert mapper.num_asked == 1


def test_a_large_map_asks_after_a_tenth_more_observations() -> None:
    session, mapper = counting_session()
    detection = session.detect(*SEEN[-1])
    frame, pose = SEEN[-1]
    for index in range(400):
        later = DepthFrame(
            stamp_ns=(index + 1) * PERIOD_NS, depth=np.full_like(frame.depth, np.nan), camera=frame.camera
        )
        session.take(later, detection, pose)
    # Ten at a time to a hundred, then 110, 121, ... to 393: a tenth more each time.
    assert mapper.num_asked == 10 + 15 - 1


def test_after_a_correction_no_frame_looks_at_where_the_stairs_were_before() -> None:
    session = show(MapSession(), SEEN)
    session.stairways()
    assert session.look(*EMPTY[0])
    shift = np.eye(4)
    shift[0, 3] = 5.0
    stamps = session.trajectory().stamps_ns
    poses = session.trajectory().map_from_camera
    session.correct(Trajectory(stamps_ns=stamps, map_from_camera=shift @ poses))
    (frame, pose) = EMPTY[0]
    assert session.look(frame, pose) == ()
    for _ in range(FRAMES_UNTIL_ASKED - 2):
        assert session.look(frame, shift @ pose) == ()
    assert len(session.look(frame, shift @ pose)) == 1
    assert session.look(frame, pose) == ()
