"""Spot's staircases, read back with bosdyn-api."""

from __future__ import annotations

import builtins
from dataclasses import replace

import numpy as np
import pytest

from stairmap.errors import MissingPackageError, OutputError
from stairmap.export.spot import dump_spot
from stairmap.navigation.floors import Floor, FloorStack
from stairmap.stairway import Landing
from stairmap.transforms import rotation_from_quat
from walkable_stairways import make_flight, make_half_turn, make_stairway

stairs_pb2 = pytest.importorskip("bosdyn.api.stairs_pb2", reason="needs the extra spot")


def read(path):
    message = stairs_pb2.StaircaseWithLandings()
    message.ParseFromString(path.read_bytes())
    return message


def vector(message):
    return [message.x, message.y, message.z]


def map_from_stairs(message):
    """(3, 3) rotation and (3,) origin of a staircase in the map."""
    pose = message.staircase.stair_tform.frame_tform_stairs
    rotation = pose.rotation
    return rotation_from_quat([rotation.x, rotation.y, rotation.z, rotation.w]), np.array(
        vector(pose.position)
    )


def test_a_flight_is_a_staircase_at_its_place_with_its_steps(tmp_path):
    flight = make_flight(base=(2.0, 6.0, 3.0), heading=0.7, num_risers=12, left_bounded=False)
    (path,) = dump_spot([make_stairway(flight, stairway_id=4)], tmp_path, frame_id="odom")
    assert path.name == "spot_stairway_4_flight_1.pb"
    staircase = read(path).staircase
    assert staircase.stair_tform.frame_name == "odom"
    assert staircase.knowledge_type == stairs_pb2.Staircase.KNOWLEDGE_TYPE_MAPPED
    assert (staircase.average_rise, staircase.average_run) == pytest.approx((0.17, 0.28))
    assert staircase.average_width.width == pytest.approx(1.2)
    assert staircase.average_width.bounded_width == stairs_pb2.Staircase.Width.BOUNDED_WIDTH_EAST
    assert len(staircase.steps) == staircase.number_of_steps == 12
    rotation, origin = map_from_stairs(read(path))
    assert origin == pytest.approx([2.0, 6.0, 3.0])
    edges = np.array([vector(step.point) for step in staircase.steps]) @ rotation.T + origin
    assert edges == pytest.approx(flight.edges().mean(axis=1), abs=1e-9)
    assert all((step.north.x, step.north.y) == (1.0, 0.0) for step in staircase.steps)


def test_free_ground_before_and_behind_a_flight_is_its_landing(tmp_path):
    (path,) = dump_spot([make_stairway(make_flight())], tmp_path)
    message = read(path)
    assert vector(message.bottom_landing.stairs_tform_landing_center.position) == pytest.approx([-0.5, 0, 0])
    top = vector(message.top_landing.stairs_tform_landing_center.position)
    assert top == pytest.approx([9 * 0.28 + 0.5, 0, 1.7])
    assert (message.top_landing.landing_extent_x, message.top_landing.landing_extent_y) == pytest.approx(
        (0.5, 0.6)
    )


def test_the_landing_between_two_flights_belongs_to_both(tmp_path):
    paths = dump_spot([make_half_turn()], tmp_path)
    lower, upper = (read(path) for path in paths)
    centers = []
    for message, landing in ((lower, lower.top_landing), (upper, upper.bottom_landing)):
        rotation, origin = map_from_stairs(message)
        centers.append(rotation @ vector(landing.stairs_tform_landing_center.position) + origin)
        assert (landing.landing_extent_x, landing.landing_extent_y) == pytest.approx((0.6, 1.25))
    assert centers[0] == pytest.approx(centers[1], abs=1e-9)
    assert centers[0] == pytest.approx(make_half_turn().landings[0].center, abs=1e-9)


def test_a_landing_that_is_turned_keeps_its_heading(tmp_path):
    flights = (make_flight(), make_flight(base=(4.0, 0.0, 1.7)))
    landing = Landing(center=[3.0, 0.0, 1.7], size=(1.5, 1.0), heading=0.4)
    first, _ = dump_spot([make_stairway(*flights, landings=(landing,))], tmp_path)
    rotation = read(first).top_landing.stairs_tform_landing_center.rotation
    turned = rotation_from_quat([rotation.x, rotation.y, rotation.z, rotation.w])
    assert np.arctan2(turned[1, 0], turned[0, 0]) == pytest.approx(0.4)


def test_ids_differ_between_stairs_and_stay_between_exports(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    first = [read(path).staircase.id for path in dump_spot([make_half_turn()], tmp_path / "a")]
    again = [read(path).staircase.id for path in dump_spot([make_half_turn()], tmp_path / "b")]
    assert first == again
    assert len(set(first)) == 2


def test_a_file_that_is_there_is_not_replaced(tmp_path):
    dump_spot([make_stairway()], tmp_path)
    with pytest.raises(OutputError, match="is there already"):
        dump_spot([make_stairway()], tmp_path)


def test_without_bosdyn_api_the_extra_is_named(tmp_path, monkeypatch):
    real_import = builtins.__import__

    def refuse(name, *arguments, **options):
        if name.startswith("bosdyn"):
            raise ImportError(name)
        return real_import(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(MissingPackageError, match=r"stairmap\[spot\]"):
        dump_spot([make_stairway()], tmp_path)


@pytest.mark.parametrize(
    ("left", "right", "name"),
    [(False, False, "NEITHER"), (True, False, "WEST"), (False, True, "EAST"), (True, True, "BOTH")],
)
def test_sides_that_were_seen_bound_the_width_of_every_step(tmp_path, left, right, name):
    flight = make_flight(left_bounded=left, right_bounded=right, width=1.4)
    (path,) = dump_spot([make_stairway(flight)], tmp_path)
    staircase = read(path).staircase
    for width in (staircase.average_width, *(step.width for step in staircase.steps)):
        value = stairs_pb2.Staircase.Width.BoundedWidth.Name(width.bounded_width)
        assert value.endswith(name), value
        assert width.width == pytest.approx(1.4)
    assert staircase.stair_tform.frame_name == "map"


def test_each_flight_of_three_has_the_landings_before_and_behind_it(tmp_path):
    flights = [make_flight(base=(4.0 * number, 0.0, 1.7 * number)) for number in range(3)]
    landings = [
        Landing(center=[4.0 * number + 3.2, 0.0, 1.7 * (number + 1)], size=(1.4, 1.0 + number), heading=0.0)
        for number in range(2)
    ]
    paths = dump_spot([make_stairway(*flights, landings=tuple(landings))], tmp_path)
    assert [path.name[-11:] for path in paths] == ["flight_1.pb", "flight_2.pb", "flight_3.pb"]
    extents = [
        (message.bottom_landing.landing_extent_y, message.top_landing.landing_extent_y)
        for message in (read(path) for path in paths)
    ]
    # Without a landing, ground as wide as the flight.
    assert extents == [pytest.approx(pair) for pair in ((0.6, 0.5), (0.5, 1.0), (1.0, 0.6))]
    # What a flight has behind it lies as high as its top, what it has before it as its foot.
    middle = read(paths[1])
    assert vector(middle.bottom_landing.stairs_tform_landing_center.position) == pytest.approx([-0.8, 0, 0])
    assert vector(middle.top_landing.stairs_tform_landing_center.position) == pytest.approx([3.2, 0, 1.7])


@pytest.mark.parametrize("end", ["bottom", "top"])
def test_where_nobody_saw_the_end_of_the_steps_spot_is_told_no_landing(tmp_path, end):
    """It was told 1 m of free ground, in the middle of the stairs."""
    stairway = make_stairway(make_flight(**{f"{end}_seen": False}))
    (path,) = dump_spot([stairway], tmp_path)
    message = read(path)
    assert message.HasField(f"{end}_landing") is False
    assert message.HasField({"top": "bottom_landing", "bottom": "top_landing"}[end])
    # A robot stood at the height of that end.
    height = 0.0 if end == "bottom" else 1.7
    floors = FloorStack(
        floors=(Floor(level=0, height=height, is_explored=True),), levels={1: (0, 0)},
        open_ends={1: (False, False)},
    )  # fmt: skip
    (tmp_path / "known").mkdir()
    (path,) = dump_spot([stairway], tmp_path / "known", floors=floors)
    assert read(path).HasField(f"{end}_landing")


def test_the_landing_between_two_flights_is_told_whatever_was_seen_of_their_ends(tmp_path):
    turn = make_half_turn()
    flights = (replace(turn.flights[0], top_seen=False), replace(turn.flights[1], bottom_seen=False))
    lower, upper = dump_spot([replace(turn, flights=flights)], tmp_path)
    assert read(lower).HasField("top_landing") and read(upper).HasField("bottom_landing")
