"""The route graph by nav2_route's own rules, and keep-out masks by nav2_map_server's."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
import yaml

from stairmap.errors import OutputError
from stairmap.export.nav2 import dump_json, dump_keepout_masks, dump_route_graph, route_graph_from_portals
from stairmap.navigation.floors import find_floors
from stairmap.navigation.occupancy import OccupancyGrid, load_map
from stairmap.navigation.portals import make_portals
from stairmap.navigation.robot_profile import load_robot
from walkable_stairways import make_flight, make_half_turn, make_stairway

FIRST = make_half_turn(height=3.0)
SECOND = make_stairway(
    make_flight(base=(0, 6, 3.0), rise=3.0 / 18, num_risers=18, heading=0.4), stairway_id=2
)


def load_as_nav2_route(path):
    """Read a graph by the rules of nav2_route's geojson_graph_file_loader.cpp; raise where it would."""
    features = json.loads(path.read_text())["features"]
    nodes = [feature for feature in features if feature["geometry"]["type"] == "Point"]
    # Versions before LineString came know MultiLineString alone.
    edges = [feature for feature in features if feature["geometry"]["type"] == "MultiLineString"]
    assert nodes, "malformed: no nodes"
    assert edges, "malformed: no edges"
    graph = {}
    for node in nodes:
        number = check_unsigned(node["properties"]["id"])
        x, y = node["geometry"]["coordinates"][:2]
        assert isinstance(node["properties"].get("frame", "map"), str)
        graph[number] = {
            "x": float(x), "y": float(y), "metadata": convert_metadata(node["properties"]), "edges": []
        }  # fmt: skip
    for edge in edges:
        properties = edge["properties"]
        start, end = check_unsigned(properties["startid"]), check_unsigned(properties["endid"])
        assert start in graph, "start id does not exist"
        assert end in graph, "end id does not exist"
        cost, overridable = properties.get("cost", 0.0), properties.get("overridable", True)
        assert isinstance(cost, int | float)
        assert isinstance(overridable, bool)
        graph[start]["edges"].append(
            {
                "id": check_unsigned(properties["id"]), "end": end, "cost": cost, "overridable": overridable,
                "metadata": convert_metadata(properties),
            }
        )  # fmt: skip
    return graph


def check_unsigned(value):
    assert isinstance(value, int)
    assert not isinstance(value, bool)
    assert value >= 0
    return value


def convert_metadata(properties):
    def primitive(value):
        assert isinstance(value, bool | int | float | str), f"failed to convert {value!r}"
        return value

    metadata = {}
    for key, value in properties.get("metadata", {}).items():
        if isinstance(value, dict):
            metadata[key] = convert_metadata({"metadata": value})
        elif isinstance(value, list):
            metadata[key] = [primitive(item) for item in value]
        else:
            metadata[key] = primitive(value)
    return metadata


def write_graph(tmp_path, stairways=(FIRST, SECOND), robot="spot", **options):
    profile = load_robot(robot)
    portals = make_portals(stairways, find_floors(stairways), profile)
    graph = route_graph_from_portals(portals, robot=profile, **options)
    dump_route_graph(graph, tmp_path / "graph.geojson")
    return portals, graph, tmp_path / "graph.geojson"


def test_nav2_route_would_load_the_graph(tmp_path):
    portals, _, path = write_graph(tmp_path)
    graph = load_as_nav2_route(path)
    assert len(graph) == 2 * len(portals)
    for portal in portals:
        for pose, level in ((portal.lower, portal.lower_level), (portal.upper, portal.upper_level)):
            (node,) = [
                node
                for node in graph.values()
                if np.hypot(*np.subtract((node["x"], node["y"]), pose.position[:2])) < 1e-5
            ]
            assert node["metadata"]["floor"] == level
            assert node["metadata"]["yaw"] == pytest.approx(pose.heading, abs=1e-5)


def test_a_node_at_an_end_that_nobody_saw_says_so(tmp_path):
    flight = replace(FIRST.flights[-1], top_seen=False)
    stairway = replace(FIRST, flights=(*FIRST.flights[:-1], flight))
    for used, expected in ((FIRST, [False, False]), (stairway, [False, True])):
        _, graph, _ = write_graph(tmp_path, stairways=(used,))
        nodes = [item for item in graph["features"] if item["geometry"]["type"] == "Point"]
        assert [node["properties"]["metadata"]["is_open"] for node in nodes] == expected


def test_there_is_an_edge_up_and_one_down_with_the_cost_of_the_portal(tmp_path):
    portals, _, path = write_graph(tmp_path)
    edges = [edge for node in load_as_nav2_route(path).values() for edge in node["edges"]]
    for portal in portals:
        mine = {
            edge["metadata"]["class"]: edge
            for edge in edges
            if edge["metadata"].get("stairway") == portal.stairway_id
        }
        assert set(mine) == {"stairs_up", "stairs_down"}
        assert mine["stairs_up"]["cost"] == pytest.approx(portal.cost_up, abs=1e-5)
        assert mine["stairs_down"]["cost"] == pytest.approx(portal.cost_down, abs=1e-5)
        assert not mine["stairs_up"]["overridable"]
        assert mine["stairs_up"]["metadata"]["height"] == -mine["stairs_down"]["metadata"]["height"]


def test_no_id_is_used_twice_by_nodes_and_edges(tmp_path):
    _, graph, _ = write_graph(tmp_path)
    ids = [feature["properties"]["id"] for feature in graph["features"]]
    assert len(set(ids)) == len(ids)


def test_the_graph_leads_from_the_lowest_floor_to_the_highest(tmp_path):
    _, _, path = write_graph(tmp_path)
    graph = load_as_nav2_route(path)
    reached, queue = set(), [number for number, node in graph.items() if node["metadata"]["floor"] == 0]
    while queue:
        number = queue.pop()
        if number not in reached:
            reached.add(number)
            queue += [edge["end"] for edge in graph[number]["edges"]]
    assert {graph[number]["metadata"]["floor"] for number in reached} == {0, 1, 2}


def test_what_is_written_is_read_back_equal(tmp_path):
    _, graph, path = write_graph(tmp_path)
    assert json.loads(path.read_text()) == graph


def test_impassable_stairs_get_no_edge_and_a_graph_without_edges_is_refused(tmp_path):
    steep = make_stairway(make_flight(base=(0, 6, 3.0), rise=0.25, num_risers=12), stairway_id=2)
    _, graph, _ = write_graph(tmp_path, stairways=(FIRST, steep))
    stairs = {feature["properties"]["metadata"].get("stairway") for feature in graph["features"]}
    assert stairs == {1}
    with pytest.raises(OutputError, match="none of 2 stairways can be used by wheeled robot"):
        write_graph(tmp_path, robot="wheeled")


def test_unknown_stairs_can_be_left_out(tmp_path):
    with pytest.raises(OutputError, match="refuses a graph without edges"):
        write_graph(tmp_path, robot="anymal", allow_unknown=False)


def read_mask(path):
    """Read a mask as nav2_map_server does, mode trinary: rows from the lowest y."""
    doc = yaml.safe_load(path.read_text())
    image = cv2.imread(str(path.parent / doc["image"]), cv2.IMREAD_UNCHANGED)
    assert image.dtype == np.uint8
    occupancy = 1.0 - image[::-1] / 255.0
    return occupancy > doc["occupied_thresh"], occupancy < doc["free_thresh"], doc


def is_forbidden(path, x, y):
    forbidden, free, doc = read_mask(path)
    assert np.array_equal(forbidden, ~free)
    column, row = (np.array([x, y]) - doc["origin"][:2]) // doc["resolution"]
    return bool(forbidden[int(row), int(column)])


def test_masks_forbid_the_stairs_and_above_all_the_descending_edge(tmp_path):
    floors = find_floors([SECOND])
    lower, upper = dump_keepout_masks([SECOND], floors, tmp_path)
    assert [path.name for path in (lower, upper)] == ["keepout_floor_0.yaml", "keepout_floor_1.yaml"]
    along = np.array([math.cos(0.4), math.sin(0.4)])
    foot = np.array([0.0, 6.0])
    edge = foot + 17 * 0.28 * along
    assert is_forbidden(lower, *(foot + 0.3 * along))
    assert not is_forbidden(lower, *(foot - 0.3 * along))
    assert is_forbidden(upper, *(edge + 0.2 * along))
    assert is_forbidden(upper, *(edge - 1.0 * along))
    assert not is_forbidden(upper, *(edge + 0.5 * along))


def test_a_robot_that_can_climb_is_not_forbidden_to(tmp_path):
    floors = find_floors([SECOND])
    assert dump_keepout_masks([SECOND], floors, tmp_path, robot=load_robot("spot")) == ()
    assert len(dump_keepout_masks([SECOND], floors, tmp_path, robot=load_robot("anymal"))) == 2


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write"):
        dump_keepout_masks([SECOND], find_floors([SECOND]), tmp_path / "file")


def test_nodes_come_first_and_every_id_counts_on_from_them(tmp_path):
    _, graph, _ = write_graph(tmp_path)
    features = graph["features"]
    assert [feature["properties"]["id"] for feature in features] == list(range(len(features)))
    assert [feature["geometry"]["type"] for feature in features[:4]] == ["Point"] * 4


def test_a_node_tells_its_stairway_end_floor_height_and_frame(tmp_path):
    (first, second), graph, _ = write_graph(tmp_path, frame_id="odom")
    nodes = [feature["properties"] for feature in graph["features"][:4]]
    assert {node["frame"] for node in nodes} == {"odom"}
    metadata = [node["metadata"] for node in nodes]
    assert [(item["stairway"], item["end"], item["floor"]) for item in metadata] == [
        (1, "lower", 0), (1, "upper", 1), (2, "lower", 1), (2, "upper", 2)
    ]  # fmt: skip
    assert {item["class"] for item in metadata} == {"stair_staging"}
    poses = [first.lower, first.upper, second.lower, second.upper]
    assert [item["z"] for item in metadata] == pytest.approx([pose.position[2] for pose in poses], abs=1e-6)


def stairs_edges(graph, stairway):
    return [
        feature
        for feature in graph["features"]
        if feature["properties"]["metadata"].get("stairway") == stairway
        and feature["geometry"]["type"] == "MultiLineString"
    ]


def test_an_edge_over_stairs_leads_from_end_to_end_along_the_portals_way(tmp_path):
    (_, portal), graph, _ = write_graph(tmp_path)
    up, down = stairs_edges(graph, 2)
    ends = [(edge["properties"]["startid"], edge["properties"]["endid"]) for edge in (up, down)]
    assert ends == [(2, 3), (3, 2)]
    for edge, sign in ((up, 1), (down, -1)):
        way = portal.way[::sign]
        assert edge["geometry"]["coordinates"] == [pytest.approx(way[:, :2], abs=1e-6)]
        metadata = edge["properties"]["metadata"]
        assert metadata["way_z"] == pytest.approx(way[:, 2], abs=1e-6)
        assert (metadata["floor_start"], metadata["floor_end"]) == (1, 2)[::sign]
        assert metadata["height"] == pytest.approx(sign * 3.0)
        assert metadata["length"] == pytest.approx(portal.length, abs=1e-6)
        assert metadata["verdict"] == "passable"
        assert metadata["probability"] == pytest.approx(portal.assessment.probability[0], abs=1e-6)
        assert metadata["leads_to_unexplored"] is True


def test_staging_poses_of_one_floor_are_joined_straight_both_ways_at_the_robots_speed(tmp_path):
    (first, second), graph, _ = write_graph(tmp_path)
    floors = [
        feature for feature in graph["features"] if feature["properties"]["metadata"]["class"] == "floor"
    ]
    ends = [(edge["properties"]["startid"], edge["properties"]["endid"]) for edge in floors]
    assert ends == [(1, 2), (2, 1)]
    length = float(np.linalg.norm(first.upper.position[:2] - second.lower.position[:2]))
    points = [first.upper.position[:2], second.lower.position[:2]]
    for edge, sign in zip(floors, (1, -1), strict=True):
        properties = edge["properties"]
        assert properties["cost"] == pytest.approx(length / 0.5, abs=1e-5)
        assert properties["overridable"] is True
        assert properties["metadata"]["length"] == pytest.approx(length, abs=1e-5)
        assert properties["metadata"]["abs_speed_limit"] == 0.5
        assert (properties["metadata"]["floor_start"], properties["metadata"]["floor_end"]) == (1, 1)
        assert edge["geometry"]["coordinates"] == [pytest.approx(np.array(points[::sign]), abs=1e-5)]


def test_unknown_stairs_get_edges_unless_they_are_left_out(tmp_path):
    """An impassable stairway never does, whatever is allowed."""
    unknown = make_stairway(make_flight(base=(0, 6, 3.0), rise=0.178, num_risers=17), stairway_id=2)
    for options, stairways in (
        ({}, {1, 2}),
        ({"allow_unknown": True}, {1, 2}),
        ({"allow_unknown": False}, {1}),
    ):
        _, graph, _ = write_graph(tmp_path, stairways=(FIRST, unknown), **options)
        found = {feature["properties"]["metadata"].get("stairway") for feature in graph["features"]}
        assert found - {None} == stairways


def test_three_stairs_on_a_floor_are_joined_in_every_pair(tmp_path):
    stairways = [
        make_stairway(make_flight(base=(0, 6.0 * number, 0)), stairway_id=number) for number in (1, 2, 3)
    ]
    _, graph, _ = write_graph(tmp_path, stairways=stairways)
    pairs = [
        (edge["properties"]["startid"], edge["properties"]["endid"])
        for edge in graph["features"]
        if edge["properties"]["metadata"]["class"] == "floor"
        and edge["properties"]["metadata"]["floor_start"] == 0
    ]
    assert sorted(pairs) == [(0, 2), (0, 4), (2, 0), (2, 4), (4, 0), (4, 2)]


def test_masks_take_the_extent_of_the_maps_that_are_given(tmp_path):
    grid = OccupancyGrid(cells=np.zeros((90, 80), dtype=np.int8), resolution=0.1, origin=(-1.0, 4.0))
    lower, upper = dump_keepout_masks([SECOND], find_floors([SECOND]), tmp_path, grids={0: grid})
    assert load_map(lower).cells.shape == (90, 80)
    assert load_map(lower).origin == (-1.0, 4.0)
    assert load_map(upper).resolution == 0.05


def test_a_number_that_is_not_known_is_null_in_a_file(tmp_path):
    dump_json({"a": float("nan"), "b": [1.5, float("inf")]}, tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text()) == {"a": None, "b": [1.5, None]}
