"""The navigation graph of Open-RMF, read back by the rules of rmf_fleet_adapter's parse_graph.cpp."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import yaml

from stairmap.errors import OutputError
from stairmap.export.rmf import dump_rmf, rmf_from_route_graph
from stairmap.navigation.floors import find_floors
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.navigation.portals import make_portals
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.route_graph import make_route_graph
from walkable_stairways import make_flight, make_half_turn, make_stairway

STAIRWAYS = (
    make_half_turn(height=3.0),
    make_stairway(make_flight(base=(0, 6, 3.0), num_risers=17), stairway_id=2),
)


def parse_graph(path):
    """Return waypoints (level, x, y, name, lift) and lanes (from, to), as parse_graph makes them."""
    config = yaml.safe_load(path.read_text())
    lifts = config["lifts"]
    for lift in lifts.values():
        assert len(lift["position"]) == 3 and len(lift["dims"]) == 2
    waypoints, lanes, names, of_lift = [], [], set(), {}
    for level, content in config["levels"].items():
        first = len(waypoints)
        for x, y, options in content["vertices"]:
            name, lift = options.get("name", ""), options.get("lift", "")
            assert not name or name not in names, "duplicated waypoint name"
            names.add(name)
            if lift:
                assert lift in lifts, "lift properties were not provided"
                of_lift.setdefault(lift, []).append(len(waypoints))
            waypoints.append((level, float(x), float(y), name, lift))
        for start, end, options in content["lanes"]:
            assert 0 <= start < len(content["vertices"]) and 0 <= end < len(content["vertices"])
            assert isinstance(options["speed_limit"], float)
            begin_lift, end_lift = waypoints[first + start][4], waypoints[first + end][4]
            assert not (begin_lift and end_lift) or begin_lift == end_lift
            lanes.append((first + start, first + end))
    for points in of_lift.values():
        for first, second in pairwise(points):
            lanes += [(first, second), (second, first)]
            distance = math.dist(waypoints[first][1:3], waypoints[second][1:3])
            assert distance <= 0.1, "bad vertical alignment for the waypoints in lift"
    return waypoints, lanes


def write(tmp_path, robot="spot", stairways=STAIRWAYS, **changes):
    profile = replace(load_robot(robot), **changes)
    portals = make_portals(stairways, find_floors(stairways), profile)
    graph = make_route_graph(portals, profile, {})
    dump_rmf(rmf_from_route_graph(graph, profile, building_name="house"), tmp_path / "graph.yaml")
    return parse_graph(tmp_path / "graph.yaml")


def reachable(lanes, start):
    reached, queue = set(), [start]
    while queue:
        number = queue.pop()
        if number not in reached:
            reached.add(number)
            queue += [end for begin, end in lanes if begin == number]
    return reached


def named(waypoints, name):
    return next(number for number, waypoint in enumerate(waypoints) if waypoint[3] == name)


def test_lanes_lead_from_level_to_level_and_back(tmp_path):
    waypoints, lanes = write(tmp_path)
    for stairway in (1, 2):
        low, high = (named(waypoints, f"stairway_{stairway}_{end}") for end in ("lower", "upper"))
        assert waypoints[low][0] != waypoints[high][0]
        assert high in reachable(lanes, low)
        assert low in reachable(lanes, high)


def test_the_level_changes_halfway_over_the_stairs_and_lanes_follow_the_way(tmp_path):
    waypoints, _ = write(tmp_path, stairways=STAIRWAYS[:1])
    cabins = [waypoint for waypoint in waypoints if waypoint[4]]
    assert [cabin[0] for cabin in cabins] == ["floor_0", "floor_1"]
    assert cabins[0][1:3] == pytest.approx((8 * 0.28 + 0.6, 0.65))
    places = {(round(x, 2), round(y, 2)) for _, x, y, _, _ in waypoints}
    assert {(-0.6, 0.0), (2.84, 0.0), (2.84, 1.3), (-0.6, 1.3)} <= places


def test_no_robot_is_asked_to_wait_on_a_flight(tmp_path):
    """A robot waited for the lift's answer at the foot of a flight, and plans might hold it halfway up."""
    robot = load_robot("spot")
    turn, straight = STAIRWAYS[0], STAIRWAYS[1]
    portals = make_portals([turn, straight], find_floors([turn, straight]), robot)
    graph = rmf_from_route_graph(make_route_graph(portals, robot, {}), robot, building_name="house")
    for level in graph["levels"].values():
        for x, y, options in level["vertices"]:
            is_on_stairs = not options["name"]
            assert options.get("is_passthrough_point", False) is is_on_stairs
            if is_on_stairs and "lift" not in options:
                assert x == pytest.approx(2.84, abs=0.01), (x, y)
    # Straight on from the staging pose to the lift, round the corner of the landing otherwise.
    assert len(graph["levels"]["floor_2"]["vertices"]) == 2
    assert len(graph["levels"]["floor_0"]["vertices"]) == 3


@pytest.mark.parametrize("direction", ["up", "down"])
def test_stairs_of_one_direction_are_lanes_of_one_direction(tmp_path, direction):
    waypoints, lanes = write(tmp_path, stairways=STAIRWAYS[:1], stair_directions=direction)
    low, high = named(waypoints, "stairway_1_lower"), named(waypoints, "stairway_1_upper")
    assert (high in reachable(lanes, low)) is (direction == "up")
    assert (low in reachable(lanes, high)) is (direction == "down")


def test_a_robot_that_climbs_nothing_has_no_graph(tmp_path):
    with pytest.raises(OutputError, match="none of 2 stairways can be used by wheeled robot"):
        write(tmp_path, robot="wheeled")


def test_floors_are_driven_at_the_floor_speed_and_stairs_at_that_of_stairs(tmp_path):
    robot = load_robot("spot")
    stairways = [make_stairway(make_flight(base=(0, y, 0), num_risers=17), stairway_id=1 + y) for y in (0, 4)]
    portals = make_portals(stairways, find_floors(stairways), robot)
    grid = OccupancyGrid(cells=np.zeros((150, 150), dtype=np.int8), resolution=0.1, origin=(-5.0, -5.0))
    graph = rmf_from_route_graph(make_route_graph(portals, robot, {0: grid}), robot, building_name="house")
    assert graph["building_name"] == "house"
    lower, upper = graph["levels"]["floor_0"], graph["levels"]["floor_1"]
    names = [options["name"] for _, _, options in lower["vertices"]]
    speed_of = {(names[start], names[end]): options["speed_limit"] for start, end, options in lower["lanes"]}
    pair = ("stairway_1_lower", "stairway_5_lower")
    assert speed_of[pair] == speed_of[pair[::-1]] == robot.floor_speed
    assert (
        sum(speed == robot.floor_speed for speed in (lane[2]["speed_limit"] for lane in lower["lanes"])) == 2
    )
    assert {lane[2]["speed_limit"] for lane in upper["lanes"]} == {robot.stair_speed}
    assert robot.floor_speed != robot.stair_speed


def test_a_lift_stands_where_its_waypoints_do_and_heads_up_the_stairs(tmp_path):
    stairway = make_stairway(make_flight(base=(2.0, 1.0, 0.0), heading=0.5, num_risers=17), stairway_id=7)
    robot = load_robot("spot")
    (portal,) = make_portals([stairway], find_floors([stairway]), robot)
    graph = rmf_from_route_graph(make_route_graph([portal], robot, {}), robot, building_name="house")
    assert list(graph["lifts"]) == ["stairway_7"]
    x, y, heading = graph["lifts"]["stairway_7"]["position"]
    # Halfway along the way, which is as long before the stairs as behind them.
    assert (x, y) == pytest.approx(tuple(portal.way[[0, -1], :2].mean(axis=0)), abs=0.06)
    assert heading == pytest.approx(0.5)
    for level in graph["levels"].values():
        (cabin,) = [vertex for vertex in level["vertices"] if "lift" in vertex[2]]
        assert cabin == [
            pytest.approx(x),
            pytest.approx(y),
            {"name": "", "lift": "stairway_7", "is_passthrough_point": True},
        ]
