"""Drops over frames: agreed on, placed by poses, withdrawn where ground is seen, part of stairways."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analytic_stairs import pose_looking
from drop_scenes import deep_dock, deep_well, dock, ramp_down, stairs_down
from solid_scenes import frame_of
from stairmap.config import Config
from stairmap.drop import Drop
from stairmap.modeling.drop_map import split_straight
from stairmap.modeling.drop_stairways import assign_drops
from stairmap.modeling.ground_table import EDGE_FIELDS, GroundTable
from stairmap.session import MapSession
from stairmap.simulation.triangle_mesh import make_rectangle
from stairmap.trajectory import Trajectory
from stairmap.transforms import transform_from_parts
from walkable_stairways import make_flight, make_stairway

HEIGHT = 0.6
PLAIN = make_rectangle((-8, -4), (8, 4), 0.0)


def drive(session, solid, distances, *, height=HEIGHT, down_deg=25.0, first=0):
    """Let a session look at a solid from ``distances`` m before x = 0, 0.1 s apart."""
    for number, distance in enumerate(distances, start=first):
        pose = pose_looking((-distance, 0.0, height), down=np.radians(down_deg))
        session.add(frame_of([solid], pose, stamp_ns=number * 10**8, has_up=False), pose)
    return session


def front_edges(drops):
    """The drops whose edge is x = 0."""
    return [drop for drop in drops if np.abs(drop.edge[:, 0]).max() < 0.08]


def test_a_dock_is_one_drop_with_its_place_depth_and_direction():
    session = drive(MapSession(), dock(0.8), np.linspace(2.4, 0.9, 8))
    (drop,) = session.drops()
    assert np.abs(drop.edge[:, 0]).max() < 0.03
    assert np.abs(drop.edge[:, 2]).max() < 0.02
    assert drop.length > 0.8
    assert drop.outward == pytest.approx([1, 0, 0], abs=0.05)
    assert drop.edge[0, 1] > drop.edge[1, 1]
    assert drop.depth == pytest.approx(0.8, abs=0.05)
    assert drop.stairway_id is None
    assert session.camera_height == pytest.approx(HEIGHT, abs=0.005)


@pytest.mark.parametrize("solid", [deep_dock(), deep_well()], ids=["dock", "well"])
def test_an_edge_behind_which_nothing_is_ever_measured_is_a_drop_of_unknown_depth(solid):
    session = drive(MapSession(), solid, np.linspace(2.0, 0.9, 12))
    (drop,) = front_edges(session.drops())
    assert drop.depth is None
    assert np.abs(drop.edge[:, 0]).max() < 0.08
    assert drop.outward == pytest.approx([1, 0, 0], abs=0.05)
    assert Drop.from_dict(drop.to_dict()).depth is None
    again = MapSession()
    again.restore(session.state())
    assert front_edges(again.drops())[0].depth is None


def test_a_robot_that_stands_does_not_take_the_end_of_what_it_sees_for_an_edge():
    assert drive(MapSession(), deep_dock(), [1.3] * 12).drops() == ()
    # Nor does one that drives, and sees no farther than 1.6 m.
    short = MapSession(Config.model_validate({"detection": {"max_depth": 1.6}}))
    drive(short, PLAIN, np.linspace(3.0, 0.5, 26))
    assert len(short.state().ground_edges) > 10
    assert short.drops() == ()


def test_what_is_seen_lower_once_tells_the_depth_of_an_edge_with_nothing_behind_it():
    session = drive(MapSession(), deep_dock(), np.linspace(2.0, 1.4, 7))
    drive(session, dock(0.8), [1.3, 1.2, 1.1], first=7)
    (drop,) = session.drops()
    assert drop.depth == pytest.approx(0.8, abs=0.05)


def test_two_frames_are_not_enough_and_three_are():
    assert drive(MapSession(), dock(0.8), [1.5, 1.4]).drops() == ()
    assert len(drive(MapSession(), dock(0.8), [1.5, 1.4, 1.3]).drops()) == 1


def test_an_edge_is_known_before_a_robot_is_within_half_a_metre_of_it():
    for height, down in ((0.3, 5.0), (0.45, 10.0), (1.3, 30.0)):
        session, known_at = MapSession(), None
        # 0.5 m/s at 10 Hz.
        for number, distance in enumerate(np.arange(2.5, 0.5, -0.05)):
            drive(session, stairs_down(), [distance], height=height, down_deg=down, first=number)
            if front_edges(session.drops()):
                known_at = distance
                break
        assert known_at is not None and known_at > 0.7


def test_the_top_edge_of_stairs_that_lead_down_belongs_to_them_once_they_are_found():
    session = drive(MapSession(), stairs_down(), np.linspace(1.6, 0.5, 10), height=1.0, down_deg=35)
    (before,) = front_edges(session.drops())
    assert before.stairway_id is None
    (stairway,) = session.stairways()
    (after,) = front_edges(session.drops())
    assert after.stairway_id == stairway.id
    assert after.id == before.id


def test_an_edge_is_withdrawn_when_ground_is_seen_across_it():
    session = drive(MapSession(), dock(0.8), np.linspace(2.0, 1.2, 6))
    assert session.drops()
    drive(session, PLAIN, np.linspace(1.5, 1.0, 12), first=6)
    assert session.drops() == ()


def test_a_ramp_is_no_drop_even_where_a_first_look_from_afar_hid_it():
    session = drive(MapSession(), ramp_down(10.0), np.linspace(3.0, 0.2, 29), height=0.45, down_deg=15)
    assert session.drops() == ()


def test_poses_that_are_corrected_move_the_drop_with_them():
    session = drive(MapSession(), dock(0.8), np.linspace(2.0, 1.2, 6))
    (before,) = session.drops()
    moved = transform_from_parts(np.eye(3), [5.0, 1.0, 0.0])
    way = session.trajectory()
    session.correct(Trajectory(stamps_ns=way.stamps_ns, map_from_camera=moved @ way.map_from_camera))
    (after,) = session.drops()
    assert after.edge == pytest.approx(before.edge + np.array([5.0, 1.0, 0.0]), abs=0.06)
    # Asked by other poses once, it answers by them and goes on with its own.
    (once,) = session.drops(way)
    assert once.edge == pytest.approx(before.edge, abs=0.06)
    assert session.drops()[0].edge == pytest.approx(after.edge, abs=1e-9)


def test_a_session_that_goes_on_from_a_state_knows_its_drops():
    session = drive(MapSession(), dock(0.8), np.linspace(2.0, 1.2, 6))
    again = MapSession()
    again.restore(session.state())
    assert [drop.to_dict() for drop in again.drops()] == [drop.to_dict() for drop in session.drops()]
    assert again.camera_height == session.camera_height


def test_a_state_whose_edges_are_of_no_frame_is_refused():
    state = drive(MapSession(), dock(0.8), [1.5, 1.4, 1.3]).state()
    edges = state.ground_edges.copy()
    edges["stamp_ns"] += 7
    with pytest.raises(ValueError, match="without a view"):
        MapSession().restore(replace(state, ground_edges=edges))
    with pytest.raises(ValueError, match="edges have the fields"):
        GroundTable.from_records(state.ground_views, np.zeros(0, dtype=EDGE_FIELDS.descr[:2]))


def test_a_camera_carried_at_changing_heights_over_a_table_tells_of_no_drop():
    session = MapSession()
    for number, height in enumerate(np.linspace(0.4, 1.2, 9)):
        drive(session, dock(0.7), [1.4], height=height, down_deg=30, first=number)
    assert session.camera_height is None
    assert session.drops() == ()
    known = MapSession(Config.model_validate({"detection": {"camera_height": 0.6}}))
    assert known.camera_height == 0.6


def test_edges_of_ground_that_the_robot_does_not_move_on_are_no_drops():
    """Frames whose ground lies lower or higher than the robot's own: a table, the floor below an edge."""
    session = drive(MapSession(), dock(0.8), np.linspace(2.4, 1.2, 12))
    (drop,) = session.drops()
    aside = transform_from_parts(np.eye(3), [0.0, 20.0, 0.0])
    for number, distance in enumerate(np.linspace(1.6, 1.3, 5), start=12):
        pose = pose_looking((-distance, 0.0, 1.0), down=np.radians(30))
        frame = frame_of([dock(0.8)], pose, stamp_ns=number * 10**8, has_up=False)
        assert session.add(frame, aside @ pose).drops
    assert [other.id for other in session.drops()] == [drop.id]


def test_an_edge_that_bends_is_told_as_straight_pieces():
    along = np.arange(0.0, 1.0, 0.1)
    corner = np.array([[x, 0.0, 0.0] for x in along] + [[0.95, y, 0.0] for y in along[1:]])
    pieces = split_straight(corner)
    assert len(pieces) == 2
    assert sorted(index for piece in pieces for index in piece) == list(range(len(corner)))
    assert len(split_straight(corner[:10])) == 1


def drop_at(x, y=0.0, z=1.7, *, turn=0.0):
    """A drop 1 m long that falls towards -x, turned by ``turn`` rad."""
    half = 0.5 * np.array([np.sin(turn), -np.cos(turn), 0.0])
    edge = np.array([x, y, z]) + np.array([half, -half])
    return Drop(
        id=1, edge=edge, depth=0.17, num_observations=5, first_seen_ns=0,
        last_seen_ns=1,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("drop", "belongs"),
    [
        (drop_at(9 * 0.28), True),
        (drop_at(9 * 0.28 + 0.35), True),
        (drop_at(9 * 0.28 + 0.5), False),
        (drop_at(9 * 0.28, 1.2), False),
        (drop_at(9 * 0.28, z=2.2), False),
        (drop_at(9 * 0.28, turn=np.pi), False),
        (drop_at(4 * 0.28, z=5 * 0.17), True),
    ],
)
def test_a_drop_is_of_the_stairs_whose_nosing_it_is(drop, belongs):
    (found,) = assign_drops([drop], [make_stairway(make_flight(), stairway_id=4)])
    assert found.stairway_id == (4 if belongs else None)


def test_a_drop_comes_back_from_its_dictionary():
    drop = replace(drop_at(1.0), stairway_id=3)
    assert Drop.from_dict(drop.to_dict()).to_dict() == drop.to_dict()
    with pytest.raises(ValueError, match="depth"):
        Drop.from_dict({**drop.to_dict(), "depth": -1.0})
    for edge in ([[1, 2, 3], [1, 2, 3]], [[1, 2, 0], [1, 2, 3]], [[0, 0, 0], [1001, 0, 0]]):
        with pytest.raises(ValueError, match="long in plan"):
            Drop.from_dict({**drop.to_dict(), "edge": edge})
