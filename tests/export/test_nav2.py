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
from stairmap.export.nav2 import dump_keepout_masks, dump_route_graph, route_graph_from_portals
from stairmap.navigation.floors import find_floors
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
