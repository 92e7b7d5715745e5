from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.arrays import Points
from stairmap.geometry import plane_distances
from stairmap.stairway import Flight, FlightStd, Landing, Stairway, Step
from stairmap.transforms import transform_points
from value_strategies import flights, no_deadline, point_clouds

STD = FlightStd(rise=0.002, run=0.003, width=0.02, pitch=0.01, heading=0.01, base=np.full(3, 0.01))


def make_flight(**changes: object) -> Flight:
    """Three risers of 0.2 by 0.3 m, 1 m wide, from (1, 2, 0.5) along +y."""
    values: dict[str, object] = {
        "base": np.array([1.0, 2.0, 0.5]),
        "heading": np.pi / 2,
        "rise": 0.2,
        "run": 0.3,
        "width": 1.0,
        "num_risers": 3,
        "std": STD,
    }
    return Flight(**{**values, **changes})  # type: ignore[arg-type]


def make_stairway(*flights_: Flight, landings: tuple[Landing, ...] = ()) -> Stairway:
    return Stairway(
        id=4, flights=flights_, landings=landings, num_observations=7, first_seen_ns=10, last_seen_ns=90
    )


def test_flight_frame_has_x_up_the_stairs_y_left_and_z_up_from_the_foot_of_the_first_riser() -> None:
    points = transform_points(
        make_flight().map_from_flight, np.array([[0, 0, 0], [1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
    )
    np.testing.assert_allclose(points, [[1, 2, 0.5], [1, 3, 0.5], [0, 2, 0.5], [1, 2, 1.5]], atol=1e-12)


def test_edges_run_from_left_to_right_one_run_behind_and_one_rise_above_each_other() -> None:
    expected = [[[0.5, 2.0 + 0.3 * k, 0.7 + 0.2 * k], [1.5, 2.0 + 0.3 * k, 0.7 + 0.2 * k]] for k in range(3)]
    np.testing.assert_allclose(make_flight().edges(), expected, atol=1e-12)


def test_pitch_is_the_angle_of_rise_over_run() -> None:
    assert make_flight(rise=0.3, run=0.3).pitch == pytest.approx(np.radians(45))


def test_plane_of_a_known_flight_is_the_one_worked_out_by_hand() -> None:
    # 0.3 z = 0.2 y + const through the nosing (1, 2, 0.7).
    plane = make_flight().plane
    np.testing.assert_allclose(plane, np.array([0.0, -0.2, 0.3, 0.19]) / np.hypot(0.2, 0.3), atol=1e-12)


def test_box_of_a_known_flight_is_the_one_worked_out_by_hand() -> None:
    box = make_flight().box
    np.testing.assert_allclose(box.center, [1.0, 2.3, 0.8])
    assert (box.height, box.width, box.depth) == pytest.approx((0.6, 1.0, 0.6))


def test_box_of_a_single_step_is_one_run_deep() -> None:
    assert make_flight(num_risers=1).box.depth == pytest.approx(0.3)


@no_deadline
@given(flights())
def test_edges_lie_in_the_plane(flight: Flight) -> None:
    np.testing.assert_allclose(plane_distances(flight.plane, flight.edges()), 0, atol=1e-9)
    assert np.linalg.norm(flight.plane[:3]) == pytest.approx(1.0)


@no_deadline
@given(flights())
def test_pitch_is_the_angle_between_the_plane_and_the_ground(flight: Flight) -> None:
    # Report section 3.1: P = arccos((a, b, c) . (0, 0, 1)).
    assert np.arccos(flight.plane[2]) == pytest.approx(flight.pitch, abs=1e-7)


@no_deadline
@given(flights())
def test_edges_and_base_lie_in_the_box_and_touch_its_top_bottom_and_sides(flight: Flight) -> None:
    points = np.concatenate([flight.edges().reshape(-1, 3), flight.base[None]])
    distances = np.array([plane_distances(plane, points) for plane in flight.box_planes()])
    assert distances.max() < 1e-9
    top, bottom, back, front, right, left = distances.max(axis=1)
    np.testing.assert_allclose([top, bottom, front, right, left], 0, atol=1e-9)
    assert back == pytest.approx(0 if flight.num_risers > 1 else -flight.run, abs=1e-9)


@no_deadline
@given(flights(), point_clouds(min_size=1))
def test_box_planes_are_equations_2_to_4_of_the_report(flight: Flight, points: Points) -> None:
    a, b, c, _ = flight.plane
    box = flight.box
    x, y, z = (points - box.center).T
    level = np.hypot(a, b)
    top, bottom, back, front, right, left = (plane_distances(plane, points) for plane in flight.box_planes())
    half_depth, half_width = box.depth / 2 * level, box.width / 2 * c * level
    np.testing.assert_allclose(top, z - box.height / 2, atol=1e-9)
    np.testing.assert_allclose(bottom, -z - box.height / 2, atol=1e-9)
    np.testing.assert_allclose(back * level, -(a * x + b * y) - half_depth, atol=1e-9)
    np.testing.assert_allclose(front * level, a * x + b * y - half_depth, atol=1e-9)
    np.testing.assert_allclose(right * c * level, -c * b * x + c * a * y - half_width, atol=1e-9)
    np.testing.assert_allclose(left * c * level, c * b * x - c * a * y - half_width, atol=1e-9)


@no_deadline
@given(flights())
def test_box_planes_face_where_their_names_say(flight: Flight) -> None:
    forward = flight.forward
    to_the_right = np.array([forward[1], -forward[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(
        flight.box_planes()[:, :3], [up, -up, forward, -forward, to_the_right, -to_the_right], atol=1e-9
    )


@no_deadline
@given(flights())
def test_surface_has_the_area_of_all_risers_and_the_treads_between_them(flight: Flight) -> None:
    vertices, triangles = flight.surface()
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1).sum() / 2
    risers, treads = flight.num_risers * flight.rise, (flight.num_risers - 1) * flight.run
    assert area == pytest.approx((risers + treads) * flight.width, rel=1e-6)


@no_deadline
@given(flights())
def test_surface_fills_the_box_and_faces_up_or_down_the_stairs(flight: Flight) -> None:
    vertices, triangles = flight.surface()
    distances = np.array([plane_distances(plane, vertices) for plane in flight.box_planes()])
    assert distances.max() < 1e-9
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    upward, backward = normals[:, 2], -(normals @ flight.forward)
    assert (np.maximum(upward, backward) > 1e-6).all()
    np.testing.assert_allclose(np.minimum(upward, backward), 0, atol=1e-9)


@no_deadline
@given(flights(), st.integers(0, 99))
def test_stairway_survives_json_to_the_micrometre(flight: Flight, num_observations: int) -> None:
    steps = tuple(
        Step(nosing=edge, num_observations=num_observations, std=(0.003, np.nan)) for edge in flight.edges()
    )
    with_steps = Flight.from_dict({**flight.to_dict(), "steps": [step.to_dict() for step in steps]})
    landing = Landing(center=flight.base + np.array([1.0, 2.0, 3.0]), size=(1.5, 2.5), heading=flight.heading)
    stairway = make_stairway(with_steps, flight, landings=(landing,))
    text = json.dumps(stairway.to_dict(), allow_nan=False)
    back = Stairway.from_dict(json.loads(text))
    assert json.dumps(back.to_dict(), allow_nan=False)
    assert (back.id, back.num_observations, back.first_seen_ns, back.last_seen_ns) == (4, 7, 10, 90)
    assert back.num_risers == 2 * flight.num_risers
    assert (back.flights[1].left_bounded, back.flights[1].right_bounded) == (
        flight.left_bounded,
        flight.right_bounded,
    )
    np.testing.assert_allclose(back.flights[0].base, flight.base, atol=1e-6)
    np.testing.assert_allclose(back.edges(), stairway.edges(), atol=1e-4)
    np.testing.assert_allclose(back.flights[0].steps[-1].nosing, flight.edges()[-1], atol=1e-6)
    assert back.flights[0].steps[0].num_observations == num_observations
    assert back.flights[0].std.width == pytest.approx(flight.std.width, abs=1e-6)
    assert back.flights[0].steps[0].std == pytest.approx((0.003, np.nan), nan_ok=True)
    assert back.flights[0].overhang == pytest.approx(flight.overhang, abs=1e-6, nan_ok=True)
    assert back.flights[0].std.overhang == pytest.approx(flight.std.overhang, abs=1e-6, nan_ok=True)
    assert (back.flights[0].bottom_seen, back.flights[0].top_seen) == (flight.bottom_seen, flight.top_seen)
    np.testing.assert_allclose(back.landings[0].center, landing.center, atol=1e-6)
    assert back.landings[0].size == landing.size


def test_json_of_a_flight_holds_what_is_derived_too() -> None:
    data = make_flight(right_bounded=False).to_dict()
    assert data["pitch"] == pytest.approx(np.arctan2(0.2, 0.3), abs=1e-6)
    assert data["box"] == {"center": [1.0, 2.3, 0.8], "height": 0.6, "width": 1.0, "depth": 0.6}
    assert data["width_bounded"] == {"left": True, "right": False}
    assert len(data["plane"]) == 4
    assert data["steps"] == []


def in_schema_1(flight: Flight) -> dict[str, Any]:
    """A flight as ``stairways.json`` had it before overhang, ends and deviations of steps came in."""
    data = flight.to_dict()
    for name in ("overhang", "bottom_seen", "top_seen"):
        del data[name]
    del data["std"]["overhang"]
    for step in data["steps"]:
        del step["std"]
    return data


def test_what_schema_1_does_not_tell_of_a_flight_is_unknown() -> None:
    steps = tuple(Step(nosing=edge, num_observations=1, std=(0.1, 0.1)) for edge in make_flight().edges())
    known = make_flight(
        overhang=0.02, bottom_seen=True, top_seen=True, steps=steps, std=replace(STD, overhang=0.003)
    )
    old = Flight.from_dict(in_schema_1(known))
    assert old.bottom_seen is None and old.top_seen is None
    assert np.isnan([old.overhang, old.std.overhang, *old.steps[0].std]).all()
    assert old.is_open_below and old.is_open_above
    assert (old.rise, old.std.run, old.num_risers) == (known.rise, known.std.run, known.num_risers)


@pytest.mark.parametrize(
    ("name", "is_open"), [("bottom_seen", "is_open_below"), ("top_seen", "is_open_above")]
)
def test_an_end_is_open_unless_it_was_seen(name: str, is_open: str) -> None:
    for value, expected in ((True, False), (False, True), (None, True)):
        assert getattr(make_flight(**{name: value}), is_open) is expected


@pytest.mark.parametrize("unknown", [None, float("nan")])
def test_an_unknown_end_is_read_as_unknown_also_where_null_became_nan(unknown: float | None) -> None:
    data = {**make_flight().to_dict(), "bottom_seen": unknown, "top_seen": unknown, "overhang": unknown}
    flight = Flight.from_dict(data)
    assert flight.bottom_seen is None and flight.top_seen is None
    assert np.isnan(flight.overhang)


@pytest.mark.parametrize("name", ["base", "heading", "rise", "num_risers", "width_bounded", "std", "steps"])
def test_flight_without_a_key_is_refused_by_its_name(name: str) -> None:
    data = make_flight().to_dict()
    del data[name]
    with pytest.raises(ValueError, match=name):
        Flight.from_dict(data)


def test_stairway_without_a_key_is_refused_by_its_name() -> None:
    data = make_stairway(make_flight()).to_dict()
    del data["last_seen_ns"]
    with pytest.raises(ValueError, match="last_seen_ns"):
        Stairway.from_dict(data)


@pytest.mark.parametrize("name", ["rise", "run", "width"])
@pytest.mark.parametrize("value", [0.0, -0.1, float("nan")])
def test_flight_with_a_dimension_that_is_not_positive_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} must be positive"):
        make_flight(**{name: value})


def test_flight_without_risers_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one riser, got 0"):
        make_flight(num_risers=0)


def test_stairway_counts_the_risers_and_edges_of_all_its_flights() -> None:
    stairway = make_stairway(make_flight(), make_flight(num_risers=5, heading=0.0))
    assert stairway.num_risers == 8
    assert stairway.edges().shape == (8, 2, 3)


def test_surface_of_a_stairway_joins_flights_and_landings_without_mixing_their_vertices() -> None:
    first, second = make_flight(), make_flight(base=np.array([9.0, 9.0, 2.0]), heading=0.0)
    landing = Landing(center=np.array([5.0, 5.0, 2.0]), size=(2.0, 1.5), heading=0.0)
    vertices, triangles = make_stairway(first, second, landings=(landing,)).surface()
    num = len(first.surface()[0])
    parts = [triangles[:10], triangles[10:20], triangles[20:]]
    np.testing.assert_allclose(vertices[parts[0]], first.surface()[0][first.surface()[1]])
    np.testing.assert_allclose(vertices[parts[1]], second.surface()[0][second.surface()[1]])
    assert len(vertices) == 2 * num + 4
    corners = vertices[parts[2]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(normals, [[0, 0, 3.0]] * 2, atol=1e-9)
    np.testing.assert_allclose(corners.reshape(-1, 3).min(axis=0), [4.0, 4.25, 2.0])
    np.testing.assert_allclose(corners.reshape(-1, 3).max(axis=0), [6.0, 5.75, 2.0])


def test_arrays_of_a_flight_cannot_be_written_to() -> None:
    with pytest.raises(ValueError, match="read-only"):
        make_flight().base[0] = 3.0


def test_surface_of_a_landing_is_its_rectangle_turned_to_its_heading_and_faces_up() -> None:
    landing = Landing(center=[1.0, 2.0, 1.1], size=(2.0, 1.0), heading=np.radians(30))
    vertices, triangles = make_stairway(make_flight(), landings=(landing,)).surface()
    corners = vertices[-4:] - landing.center
    forward, left = np.array([np.sqrt(3) / 2, 0.5, 0.0]), np.array([-0.5, np.sqrt(3) / 2, 0.0])
    np.testing.assert_allclose(corners @ forward, [-1.0, 1.0, 1.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(corners @ left, [-0.5, -0.5, 0.5, 0.5], atol=1e-12)
    first, second, third = vertices[triangles[-2:]].swapaxes(0, 1)
    normals = np.cross(second - first, third - first) / 2
    np.testing.assert_allclose(normals, [[0.0, 0.0, 1.0]] * 2, atol=1e-12)
