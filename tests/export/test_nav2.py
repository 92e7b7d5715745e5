"""The route graph by nav2_route's own rules, and keep-out masks by nav2_map_server's."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
import pytest
import yaml

from stairmap.errors import OutputError
from stairmap.export.nav2 import dump_json, dump_keepout_masks, dump_route_graph, nav2_from_route_graph
from stairmap.navigation.floors import find_floors
from stairmap.navigation.keepout import block_stairs, forbidden_ground, make_keepout_mask
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.navigation.portals import make_portals
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.route_graph import make_route_graph
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
        check_operations(node["properties"])
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
        check_operations(properties)
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


def check_operations(properties):
    """As convertOperationFromJson and OperationsManager: graphs may only call operations that are clients."""
    for operation in properties.get("operations", {}).values():
        assert operation["type"] == "TriggerEvent"
        assert operation["trigger"] in ("NODE", "ON_ENTER", "ON_EXIT")
        assert isinstance(convert_metadata(operation)["service_name"], str)


def time_scorer_cost(edge, ends, max_vel=0.5):
    """As TimeScorer::score: what is no float throws std::bad_any_cast in Metadata::getValue<float>."""
    time = edge["metadata"].get("abs_time_taken", 0.0)
    velocity = edge["metadata"].get("abs_speed_limit", 0.0)
    assert type(time) is float and type(velocity) is float
    if time > 0:
        return time
    return math.dist(*ends) / (velocity if velocity > 0 else max_vel)


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


def free_floors(stairways, levels=(0, 1, 2)):
    """Maps of floors that are free but for the stairs."""
    floors = find_floors(stairways)
    grid = OccupancyGrid(cells=np.zeros((400, 400), dtype=np.int8), resolution=0.1, origin=(-15.0, -15.0))
    known = {floor.level for floor in floors.floors}
    return {level: block_stairs(grid, stairways, floors, level) for level in levels if level in known}


def write_graph(tmp_path, stairways=(FIRST, SECOND), robot="spot", grids=None, frame_id="map", **options):
    profile = load_robot(robot)
    portals = make_portals(stairways, find_floors(stairways), profile)
    grids = free_floors(stairways) if grids is None else grids
    graph = make_route_graph(portals, profile, grids, **options)
    values = nav2_from_route_graph(graph, profile, frame_id=frame_id)
    dump_route_graph(values, tmp_path / "graph.geojson")
    return portals, values, tmp_path / "graph.geojson"


def nodes_of(graph, kind=None):
    return [
        item["properties"]
        for item in graph["features"]
        if item["geometry"]["type"] == "Point" and kind in (None, item["properties"]["metadata"]["class"])
    ]


def test_nav2_route_would_load_the_graph(tmp_path):
    portals, _, path = write_graph(tmp_path)
    graph = load_as_nav2_route(path)
    staging = [node for node in graph.values() if node["metadata"]["class"] == "stair_staging"]
    assert len(staging) == 2 * len(portals)
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
        nodes = nodes_of(graph, "stair_staging")
        assert [node["metadata"]["is_open"] for node in nodes] == expected


def test_the_edges_over_a_stairway_have_the_cost_of_the_portal_together(tmp_path):
    portals, _, path = write_graph(tmp_path)
    edges = [edge for node in load_as_nav2_route(path).values() for edge in node["edges"]]
    for portal in portals:
        for kind, cost, sign in (("up", portal.cost_up, 1), ("down", portal.cost_down, -1)):
            mine = [
                edge for edge in edges
                if edge["metadata"].get("stairway") == portal.stairway_id
                and edge["metadata"]["class"] == f"stairs_{kind}"
            ]  # fmt: skip
            assert len(mine) == len(portal.way) - 1
            assert sum(edge["cost"] for edge in mine) == pytest.approx(cost, abs=1e-4)
            assert sum(edge["metadata"]["height"] for edge in mine) == pytest.approx(sign * portal.height)
            assert sum(edge["metadata"]["length"] for edge in mine) == pytest.approx(portal.length, abs=1e-4)
            assert not any(edge["overridable"] for edge in mine)


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
    assert not free.any(), "Nav2 makes unknown ground of a costmap free there"
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


def test_a_robot_that_can_climb_has_the_stairs_open_and_only_their_sides_forbidden_above(tmp_path):
    floors = find_floors([SECOND])
    (above,) = dump_keepout_masks([SECOND], floors, tmp_path, robot=load_robot("spot"))
    assert above.name == "keepout_floor_1.yaml"
    along, left = np.array([math.cos(0.4), math.sin(0.4)]), np.array([-math.sin(0.4), math.cos(0.4)])
    for share in np.linspace(-0.3, 17.0 * 0.28 + 0.6, 60):
        assert not is_forbidden(above, *(np.array([0.0, 6.0]) + share * along))
    for side in (-0.75, 0.75):
        assert is_forbidden(above, *(np.array([0.0, 6.0]) + 2.0 * along + side * left))
    unknown = dump_keepout_masks([SECOND], floors, tmp_path / "unknown", robot=load_robot("anymal"))
    assert len(unknown) == 2


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write"):
        dump_keepout_masks([SECOND], find_floors([SECOND]), tmp_path / "file")


def test_nodes_come_first_and_every_id_counts_on_from_them(tmp_path):
    _, graph, _ = write_graph(tmp_path)
    features = graph["features"]
    assert [feature["properties"]["id"] for feature in features] == list(range(len(features)))
    kinds = [feature["geometry"]["type"] for feature in features]
    assert kinds == sorted(kinds, reverse=True)


def test_a_node_tells_its_stairway_end_floor_height_and_frame(tmp_path):
    (first, second), graph, _ = write_graph(tmp_path, frame_id="odom")
    assert {node["frame"] for node in nodes_of(graph)} == {"odom"}
    metadata = [node["metadata"] for node in nodes_of(graph, "stair_staging")]
    assert [(item["stairway"], item["end"], item["floor"]) for item in metadata] == [
        (1, "lower", 0), (1, "upper", 1), (2, "lower", 1), (2, "upper", 2)
    ]  # fmt: skip
    poses = [first.lower, first.upper, second.lower, second.upper]
    assert [item["z"] for item in metadata] == pytest.approx([pose.position[2] for pose in poses], abs=1e-6)


def test_straight_edges_follow_the_way_over_a_half_turn(tmp_path):
    """It was one straight edge of 1.44 m between the staging poses, across the open well."""
    _, graph, path = write_graph(tmp_path, stairways=(FIRST,))
    kinds = [node["metadata"]["class"] for node in nodes_of(graph)]
    assert kinds == [
        "stair_staging", "stair_foot", "stair_top", "stair_corner", "stair_corner", "stair_foot", "stair_top",
        "stair_staging",
    ]  # fmt: skip
    places = [
        (*feature["geometry"]["coordinates"], feature["properties"]["metadata"]["z"])
        for feature in graph["features"][:8]
    ]
    lower, upper = FIRST.flights
    for place, flight in ((places[1], lower), (places[5], upper)):
        assert place == pytest.approx(flight.base, abs=1e-6)
    corners = np.array(places[3:5])
    # In the middle of the landing, before each flight, and level.
    assert corners[:, 0] == pytest.approx([8 * 0.28 + 0.6] * 2)
    assert corners[:, 1] == pytest.approx([0.0, 1.3])
    assert corners[:, 2] == pytest.approx([1.5, 1.5])
    for node in load_as_nav2_route(path).values():
        for edge in node["edges"]:
            assert edge["metadata"]["length"] < 3.5


def stairs_edges(graph, stairway):
    return [
        feature
        for feature in graph["features"]
        if feature["properties"]["metadata"].get("stairway") == stairway
        and feature["geometry"]["type"] == "MultiLineString"
    ]


def test_an_edge_over_stairs_leads_from_node_to_node_along_the_portals_way(tmp_path):
    (_, portal), graph, _ = write_graph(tmp_path)
    edges = stairs_edges(graph, 2)
    first = nodes_of(graph).index(
        next(node for node in nodes_of(graph) if node["metadata"].get("stairway") == 2)
    )
    chain = [first + index for index in range(4)]
    ends = [(edge["properties"]["startid"], edge["properties"]["endid"]) for edge in edges]
    assert ends == [*pairwise(chain), *pairwise(chain[::-1])]
    for edge, (start, end) in zip(edges, ends, strict=True):
        way = portal.way[[start - first, end - first]]
        assert edge["geometry"]["coordinates"] == [pytest.approx(way[:, :2], abs=1e-6)]
        metadata = edge["properties"]["metadata"]
        sign = 1 if end > start else -1
        assert metadata["way_z"] == pytest.approx(way[:, 2], abs=1e-6)
        assert (metadata["floor_start"], metadata["floor_end"]) == (1, 2)[::sign]
        assert metadata["verdict"] == "passable"
        assert metadata["probability"] == pytest.approx(portal.assessment.probability[0], abs=1e-6)
        assert metadata["leads_to_unexplored"] is True


def test_stair_edges_trigger_the_robot_and_the_last_one_ends_it(tmp_path):
    _, graph, _ = write_graph(tmp_path, stairways=(FIRST,))
    edges = [edge["properties"] for edge in stairs_edges(graph, 1)]
    for kind in ("up", "down"):
        mine = [edge["operations"] for edge in edges if edge["metadata"]["class"] == f"stairs_{kind}"]
        assert [list(operations) for operations in mine] == [["begin"]] * (len(mine) - 1) + [["begin", "end"]]
        for operations in mine:
            assert operations["begin"]["trigger"] == "ON_ENTER"
            assert operations["begin"]["metadata"]["service_name"] == f"stairs/begin_{kind}"
        assert mine[-1]["end"] == {
            "type": "TriggerEvent", "trigger": "ON_EXIT", "metadata": {"service_name": "stairs/end"},
        }  # fmt: skip


def test_time_scorer_can_read_every_edge_whatever_numbers_a_profile_holds(tmp_path):
    """``abs_speed_limit: 1`` is an integer to nlohmann's JSON, and TimeScorer threw."""
    profile = replace(load_robot("spot"), floor_speed=1, stair_speed=1)
    portals = make_portals((FIRST, SECOND), find_floors((FIRST, SECOND)), profile)
    graph = make_route_graph(portals, profile, free_floors((FIRST, SECOND)))
    dump_route_graph(nav2_from_route_graph(graph, profile), tmp_path / "graph.geojson")
    loaded = load_as_nav2_route(tmp_path / "graph.geojson")
    floors = 0
    for node in loaded.values():
        for edge in node["edges"]:
            ends = [(place["x"], place["y"]) for place in (node, loaded[edge["end"]])]
            cost = time_scorer_cost(edge, ends)
            assert type(edge["cost"]) is float
            if edge["metadata"]["class"] == "floor":
                floors += 1
                assert cost == pytest.approx(edge["cost"], abs=1e-4)
    assert floors


def floor_edges(graph, level):
    return [
        feature
        for feature in graph["features"]
        if feature["properties"]["metadata"]["class"] == "floor"
        and feature["properties"]["metadata"]["floor_start"] == level
    ]


def test_staging_poses_of_one_floor_are_joined_straight_both_ways_at_the_robots_speed(tmp_path):
    beside = make_stairway(make_flight(base=(0, 6.0, 0.0), num_risers=18), stairway_id=2)
    other = make_stairway(make_flight(base=(0, 0.0, 0.0), num_risers=18), stairway_id=1)
    (first, second), graph, _ = write_graph(tmp_path, stairways=(other, beside))
    edges = floor_edges(graph, 0)
    assert len(edges) == 2
    length = float(np.linalg.norm(first.lower.position[:2] - second.lower.position[:2]))
    points = [first.lower.position[:2], second.lower.position[:2]]
    for edge, sign in zip(edges, (1, -1), strict=True):
        properties = edge["properties"]
        assert properties["cost"] == pytest.approx(length / 0.5, abs=1e-5)
        assert properties["overridable"] is True
        assert properties["metadata"]["length"] == pytest.approx(length, abs=1e-5)
        assert properties["metadata"]["abs_speed_limit"] == 0.5
        assert (properties["metadata"]["floor_start"], properties["metadata"]["floor_end"]) == (0, 0)
        assert edge["geometry"]["coordinates"] == [pytest.approx(np.array(points[::sign]), abs=1e-5)]


def crosses(edge, grid):
    """Whether a straight edge touches an occupied cell."""
    start, end = np.array(edge["geometry"]["coordinates"][0])
    shares = np.linspace(0, 1, 500)[:, None]
    index, inside = grid.cells_at(start + shares * (end - start))
    return bool((grid.cells[index[inside, 0], index[inside, 1]] == 100).any())


def test_no_floor_edge_crosses_a_wall_and_nodes_lead_around_it(tmp_path):
    stairways = [
        make_stairway(make_flight(base=(0, y, 0.0), num_risers=18), stairway_id=number)
        for number, y in ((1, 0.0), (2, 6.0))
    ]
    grids = free_floors(stairways)
    cells = grids[0].cells.copy()
    # A wall at y = 3 from x = -6 on; the way is around its end.
    cells[178:182, 90:] = 100
    grids[0] = replace(grids[0], cells=cells)
    _, graph, path = write_graph(tmp_path, stairways=stairways, grids=grids)
    edges = floor_edges(graph, 0)
    assert len(edges) > 2
    assert not any(crosses(edge, grids[0]) for edge in edges)
    loaded = load_as_nav2_route(path)
    reached, queue = set(), [0]
    while queue:
        number = queue.pop()
        if number not in reached:
            reached.add(number)
            queue += [edge["end"] for edge in loaded[number]["edges"] if edge["metadata"]["class"] == "floor"]
    ends = {number for number, node in loaded.items() if node["metadata"].get("end") == "lower"}
    assert ends <= reached
    assert len([node for node in nodes_of(graph, "waypoint") if node["metadata"]["floor"] == 0]) <= 6


def test_a_floor_has_no_edges_where_no_free_way_or_no_map_is_known(tmp_path):
    stairways = [
        make_stairway(make_flight(base=(0, y, 0.0), num_risers=18), stairway_id=number)
        for number, y in ((1, 0.0), (2, 6.0))
    ]
    grids = free_floors(stairways)
    cells = grids[0].cells.copy()
    cells[178:182] = 100
    closed = {**grids, 0: replace(grids[0], cells=cells)}
    profile = load_robot("spot")
    portals = make_portals(stairways, find_floors(stairways), profile)
    for maps, words in ((closed, "floor 0: no free way was seen"), ({}, "floor 0 has no map")):
        graph = make_route_graph(portals, profile, maps)
        assert not [
            edge for edge in graph.edges if edge.kind == "floor" and graph.nodes[edge.start].level == 0
        ]
        assert any(words in note for note in graph.notes)


def test_no_floor_edge_begins_through_a_wall_behind_a_staging_pose(tmp_path):
    """The nearest place where the robot fits is on the other side of the wall."""
    stairways = [
        make_stairway(make_flight(base=(0, y, 0.0), num_risers=18), stairway_id=number)
        for number, y in ((1, 0.0), (2, 6.0))
    ]
    grids = free_floors(stairways)
    cells = grids[0].cells.copy()
    # From x = -0.8 to -0.7 along the whole first stairway's front.
    cells[120:180, 142] = 100
    grids[0] = replace(grids[0], cells=cells)
    _, graph, _ = write_graph(tmp_path, stairways=stairways, grids=grids)
    assert floor_edges(graph, 0) == []


@pytest.mark.parametrize(("directions", "kinds"), [("up", {"stairs_up"}), ("down", {"stairs_down"})])
def test_stairs_that_a_robot_takes_in_one_direction_have_edges_in_that_alone(directions, kinds):
    profile = replace(load_robot("spot"), stair_directions=directions)
    portals = make_portals((FIRST,), find_floors((FIRST,)), profile)
    graph = make_route_graph(portals, profile, {})
    assert {edge.kind for edge in graph.edges} == kinds


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
        make_stairway(make_flight(base=(0, 4.0 * number, 0)), stairway_id=number) for number in (1, 2, 3)
    ]
    _, graph, _ = write_graph(tmp_path, stairways=stairways)
    lower = [node["id"] for node in nodes_of(graph) if node["metadata"].get("end") == "lower"]
    pairs = {(edge["properties"]["startid"], edge["properties"]["endid"]) for edge in floor_edges(graph, 0)}
    assert {(first, second) for first in lower for second in lower if first != second} <= pairs


def test_masks_take_the_extent_of_the_maps_that_are_given(tmp_path):
    grid = OccupancyGrid(cells=np.zeros((90, 80), dtype=np.int8), resolution=0.1, origin=(-1.0, 4.0))
    lower, upper = dump_keepout_masks([SECOND], find_floors([SECOND]), tmp_path, grids={0: grid})
    forbidden, _, doc = read_mask(lower)
    assert forbidden.shape == (90, 80)
    assert doc["origin"][:2] == [-1.0, 4.0]
    assert read_mask(upper)[2]["resolution"] == 0.05


def test_a_number_that_is_not_known_is_null_in_a_file(tmp_path):
    dump_json({"a": float("nan"), "b": [1.5, float("inf")]}, tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text()) == {"a": None, "b": [1.5, None]}


def test_no_floor_edge_passes_a_wall_right_beside_a_staging_pose(tmp_path):
    stairways = [
        make_stairway(make_flight(base=(0, y, 0.0), num_risers=18), stairway_id=number)
        for number, y in ((1, 0.0), (2, 6.0))
    ]
    profile = load_robot("spot")
    portals = make_portals(stairways, find_floors(stairways), profile)
    x, y = portals[0].lower.position[:2]
    grids = free_floors(stairways)
    cells = grids[0].cells.copy()
    row, column = int((y + 15) / 0.1), int((x + 15) / 0.1)
    # A box of walls round the pose: its nearest free ground lies outside.
    cells[row - 2 : row + 3, column - 2] = cells[row - 2 : row + 3, column + 2] = 100
    cells[row - 2, column - 2 : column + 3] = cells[row + 2, column - 2 : column + 3] = 100
    walled = {**grids, 0: replace(grids[0], cells=cells)}
    graph = make_route_graph(portals, profile, walled)
    assert not [edge for edge in graph.edges if edge.kind == "floor" and graph.nodes[edge.start].level == 0]


@pytest.mark.parametrize("value", [0, -1])
def test_no_floor_edge_leads_over_ground_that_nobody_saw(value):
    """Half a metre of it before a staging pose was taken for free."""
    stairways = [
        make_stairway(make_flight(base=(0, y, 0.0), num_risers=18), stairway_id=number)
        for number, y in ((1, 0.0), (2, 6.0))
    ]
    profile = load_robot("spot")
    portals = make_portals(stairways, find_floors(stairways), profile)
    grids = free_floors(stairways)
    row, column = grids[0].cells_at(portals[0].lower.position)[0][0]
    cells = grids[0].cells.copy()
    cells[row - 2 : row + 3, column - 2 : column + 3] = value
    graph = make_route_graph(portals, profile, {**grids, 0: replace(grids[0], cells=cells)})
    edges = [edge for edge in graph.edges if edge.kind == "floor" and graph.nodes[edge.start].level == 0]
    assert bool(edges) == (value == 0)


def keepout_filter(costs, mask):
    """As nav2_costmap_2d's KeepoutFilter::process, for a mask as large as the costmap; costs as there."""
    no_information, lethal = 255, 254
    data = np.where(mask == -1, no_information, np.round(mask * (lethal / 100.0))).astype(np.uint8)
    is_taken = (data != no_information) & ((data > costs) | (costs == no_information))
    return np.where(is_taken, data, costs)


def test_a_mask_leaves_unknown_ground_of_a_costmap_unknown_and_forbids_what_it_forbids():
    """Its white ground, a metre around all stairs, became free in Nav2 where nobody had seen any."""
    ground = forbidden_ground([SECOND], [], None)
    mask = make_keepout_mask(ground, find_floors([SECOND]), 1).cells
    for before in (0, 100, 253, 254, 255):
        after = keepout_filter(np.full(mask.shape, before, dtype=np.uint8), mask)
        assert (after[mask == 100] == 254).all()
        assert (after[mask != 100] == before).all()
    assert (mask == 100).any() and (mask != 100).any()
