"""OpenStreetMap's tags, and places on the earth against an independent formula."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.errors import ConfigError
from stairmap.export.geojson import EarthAnchor, osm_from_stairways
from stairmap.navigation.floors import find_floors
from value_strategies import no_deadline
from walkable_stairways import make_flight, make_half_turn, make_stairway

ANCHOR = EarthAnchor(latitude=48.2, longitude=11.5)


def earth_centred(degrees, height=0.0):
    """Return x, y, z of longitude and latitude on the WGS 84 ellipsoid, m."""
    longitude, latitude = np.radians(degrees)
    radius = 6378137.0 / math.sqrt(1 - 0.00669437999014 * math.sin(latitude) ** 2)
    return np.array(
        [
            (radius + height) * math.cos(latitude) * math.cos(longitude),
            (radius + height) * math.cos(latitude) * math.sin(longitude),
            (radius * (1 - 0.00669437999014) + height) * math.sin(latitude),
        ]
    )


HIGH = EarthAnchor(latitude=48.2, longitude=11.5, height=520.0)


def features_of(*stairways, anchor=ANCHOR):
    collection = osm_from_stairways(stairways, find_floors(stairways), anchor)
    return json.loads(json.dumps(collection))["features"]


def test_a_flight_is_highway_steps_with_its_measures():
    (feature,) = features_of(make_stairway(make_flight(rise=0.17, run=0.28, width=1.234, num_risers=10)))
    assert feature["properties"] == {
        "highway": "steps", "step_count": "10", "incline": "up", "width": "1.23", "step:height": "0.170",
        "step:length": "0.280", "level": "0;1", "indoor": "yes",
    }  # fmt: skip
    assert feature["geometry"]["type"] == "LineString"


def test_the_way_leads_up():
    for feature in features_of(make_half_turn(), anchor=HIGH):
        heights = [point[2] for point in feature["geometry"]["coordinates"]]
        assert heights[1] > heights[0] or feature["properties"]["highway"] == "footway"


def test_a_landing_is_a_footway_between_the_flights():
    kinds = [feature["properties"]["highway"] for feature in features_of(make_half_turn())]
    assert sorted(kinds) == ["footway", "steps", "steps"]


def test_a_width_with_an_unseen_end_is_an_estimate():
    (feature,) = features_of(make_stairway(make_flight(right_bounded=False)))
    assert "width" not in feature["properties"]
    assert feature["properties"]["est_width"] == "1.20"


@no_deadline
@given(st.floats(-500, 500), st.floats(-500, 500), st.floats(0, 360), st.floats(-70, 70))
def test_places_are_as_far_apart_on_the_earth_as_in_the_map(x, y, bearing, latitude):
    anchor = EarthAnchor(latitude=latitude, longitude=11.5, bearing=bearing)
    degrees = anchor.degrees_from_map([[0.0, 0.0], [x, y]])
    distance = np.linalg.norm(earth_centred(degrees[1]) - earth_centred(degrees[0]))
    assert distance == pytest.approx(math.hypot(x, y), abs=0.05)
    assert anchor.map_from_degrees(degrees)[1] == pytest.approx([x, y], abs=1e-6)


def test_a_bearing_of_90_deg_puts_x_to_the_east_and_y_to_the_north():
    east, north = ANCHOR.degrees_from_map([[10.0, 0.0], [0.0, 10.0]]) - [11.5, 48.2]
    assert east[0] > 0
    assert east[1] == pytest.approx(0)
    assert north[1] > 0
    assert north[0] == pytest.approx(0)


def test_flights_are_read_back_where_they_are():
    stairway = make_stairway(make_flight(base=(12.0, -7.0, 0.3), heading=0.7))
    (feature,) = features_of(stairway)
    points = np.array(feature["geometry"]["coordinates"])
    assert ANCHOR.map_from_degrees(points[:, :2])[0] == pytest.approx([12.0, -7.0], abs=1e-3)


@pytest.mark.parametrize(("latitude", "longitude"), [(90, 0), (0, 181), (float("nan"), 0)])
def test_an_impossible_anchor_is_refused(latitude, longitude):
    with pytest.raises(ConfigError, match="an anchor needs a latitude"):
        EarthAnchor(latitude=latitude, longitude=longitude)


def east_north(anchor, degrees):
    """Return metres to the east and north of an anchor, through earth-centred coordinates."""
    longitude, latitude = math.radians(anchor.longitude), math.radians(anchor.latitude)
    offset = earth_centred(degrees) - earth_centred([anchor.longitude, anchor.latitude])
    east = np.array([-math.sin(longitude), math.cos(longitude), 0.0])
    up = np.array(
        [
            math.cos(latitude) * math.cos(longitude),
            math.cos(latitude) * math.sin(longitude),
            math.sin(latitude),
        ]
    )
    return np.array([east @ offset, np.cross(up, east) @ offset])


@pytest.mark.parametrize("latitude", [-60.0, 0.0, 48.2])
@pytest.mark.parametrize("bearing", [0.0, 30.0, 90.0, 200.0])
def test_a_bearing_turns_the_map_clockwise_from_north(latitude, bearing):
    """To a centimetre in 200 m: x points along the bearing, y to its left."""
    anchor = EarthAnchor(latitude=latitude, longitude=11.5, bearing=bearing)
    ahead, left = anchor.degrees_from_map([[200.0, 0.0], [0.0, 200.0]])
    sine, cosine = math.sin(math.radians(bearing)), math.cos(math.radians(bearing))
    assert east_north(anchor, ahead) == pytest.approx([200 * sine, 200 * cosine], abs=0.01)
    assert east_north(anchor, left) == pytest.approx([-200 * cosine, 200 * sine], abs=0.01)


def test_without_a_bearing_x_points_to_the_east():
    assert ANCHOR.bearing == 90.0


@pytest.mark.parametrize(
    ("latitude", "longitude", "bearing", "is_taken"),
    [
        (89, 180, 0, True), (-89, -180, 720, True), (89.1, 0, 0, False), (-89.1, 0, 0, False),
        (0, 180.1, 0, False),
        (0, -180.1, 0, False), (0, 0, float("inf"), False), (0, float("nan"), 0, False),
    ],
)  # fmt: skip
def test_an_anchor_is_on_the_earth_but_not_at_its_poles(latitude, longitude, bearing, is_taken):
    if is_taken:
        assert EarthAnchor(latitude=latitude, longitude=longitude, bearing=bearing).latitude == latitude
    else:
        with pytest.raises(ConfigError, match="an anchor needs"):
            EarthAnchor(latitude=latitude, longitude=longitude, bearing=bearing)


def test_a_way_begins_at_the_first_riser_and_ends_at_the_last_nosing_to_a_tenth_of_a_millimetre():
    half_turn = make_half_turn()
    ways = [np.array(feature["geometry"]["coordinates"]) for feature in features_of(half_turn)]
    ends = [(0, 0), (8 * 0.28, 0), (8 * 0.28, 1.3), (0, 1.3), (8 * 0.28, 0), (8 * 0.28, 1.3)]
    assert ANCHOR.map_from_degrees(np.concatenate(ways)[:, :2]) == pytest.approx(np.array(ends), abs=2e-4)
    high = [np.array(feature["geometry"]["coordinates"]) for feature in features_of(half_turn, anchor=HIGH)]
    heights = np.concatenate(high)[:, 2] - 520.0
    assert heights == pytest.approx([0, 1.53, 1.53, 3.06, 1.53, 1.53], abs=1e-4)


def test_heights_are_those_above_the_ellipsoid_or_left_out():
    """RFC 7946: the third coordinate is no height above some floor."""
    stairway = make_stairway(make_flight(base=(0, 0, 0.12345678)))
    (feature,) = features_of(stairway, anchor=HIGH)
    assert feature["geometry"]["coordinates"][0][2] == 520.1235
    (flat,) = features_of(stairway)
    assert {len(point) for point in flat["geometry"]["coordinates"]} == {2}
    with pytest.raises(ConfigError, match="WGS 84 ellipsoid"):
        EarthAnchor(latitude=0, longitude=0, height=1e6)
