"""Stairways for Nav2: the graph of the Route Server, and keep-out masks.

Rules of nav2_route's GeoJSON parser that the graph keeps: points are nodes and ``MultiLineString`` are
edges (older versions know no ``LineString``); ``id``, ``startid`` and ``endid`` are unsigned integers, and
no id is used twice; at least one node and one edge; metadata hold numbers, booleans, texts, or flat arrays of
them, never ``null``. An ``overridable: false`` edge keeps its cost whatever the edge scorers say.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from stairmap.drop import Drop
from stairmap.errors import OutputError
from stairmap.export.results import null_for_nan
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.keepout import forbidden_ground, make_keepout_mask
from stairmap.navigation.occupancy import OccupancyGrid, dump_map
from stairmap.navigation.portals import ANY_ROBOT
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.navigation.route_graph import RouteEdge, RouteGraph, RouteNode
from stairmap.output_files import output_error, write_whole_text
from stairmap.stairway import Stairway, rounded

ROUTE_GRAPH_FILE, RMF_GRAPH_FILE = "route_graph.geojson", "rmf_graph.yaml"
_MASK_NAME = "keepout_floor_"


def nav2_from_route_graph(
    graph: RouteGraph, robot: RobotProfile = ANY_ROBOT, *, frame_id: str = "map"
) -> dict[str, Any]:
    """Return a graph for Nav2's Route Server.

    Stair edges keep their costs (``overridable: false``) and carry ``operations``: entering one calls the
    service ``stairs/begin_up`` or ``stairs/begin_down``, and leaving the last one ``stairs/end``, through
    nav2_route's ``TriggerEvent``. Each edge says it, because a route may begin on the stairs. All costs are
    seconds, so ``TimeScorer`` is the scorer that fits the edges of floors.

    Parameters
    ----------
    graph
        Places and ways.
    robot
        Its ``floor_speed`` is the speed limit on floors.
    frame_id
        Coordinate frame of the nodes.

    Raises
    ------
    OutputError
        If no stairway is left: nav2_route refuses a graph without edges.
    """
    if not graph.edges:
        raise OutputError(
            f"none of {graph.num_stairways} stairways can be used by {robot.name}, and nav2_route refuses a "
            "graph without edges"
        )
    nodes = [_node(number, node, frame_id) for number, node in enumerate(graph.nodes)]
    edges = [_edge(number, edge, graph, robot) for number, edge in enumerate(graph.edges, start=len(nodes))]
    return {"type": "FeatureCollection", "name": "stairmap", "features": [*nodes, *edges]}


def dump_route_graph(graph: Mapping[str, Any], path: Path) -> None:
    """Write a graph for Nav2's Route Server; see ``nav2_from_route_graph``.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    dump_json(graph, path)


def dump_keepout_masks(
    stairways: Sequence[Stairway],
    floors: FloorStack,
    folder: Path,
    *,
    drops: Sequence[Drop] = (),
    robot: RobotProfile | None = None,
    grids: Mapping[int, OccupancyGrid] | None = None,
) -> tuple[Path, ...]:
    """Write a Nav2 keep-out mask for each floor that stairs or drops touch.

    The files are ``keepout_floor_<level>.yaml`` and ``.pgm``. Black ground is forbidden: stairs, the space
    under them, and the strip before each edge. The rest is grey, of which Nav2 takes no note.

    Parameters
    ----------
    stairways, floors
        What there is.
    folder
        Where to write; created if needed.
    drops
        Where the ground ends.
    robot
        Stairs that it can climb stay open, and so do their own edges, but not the sides of their wells.
        ``None``: all are forbidden, as for wheels.
    grids
        Maps whose extent and resolution the masks take, by level.

    Returns
    -------
    Paths of the YAML files, lowest floor first.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    ground = forbidden_ground(stairways, drops, robot)
    paths = []
    for floor in floors.floors:
        like = None if grids is None else grids.get(floor.level)
        mask = make_keepout_mask(ground, floors, floor.level, like=like)
        if mask is not None:
            paths.append(dump_map(mask, folder, f"{_MASK_NAME}{floor.level}"))
    return tuple(paths)


def remove_navigation_files(folder: Path, name: str) -> None:
    """Remove what an earlier export of a format wrote into a folder.

    Only the formats that robots obey: an old mask of a floor beside new ones, or the graph of a robot that
    climbs beside the masks of one that does not, would lead a robot over an edge.

    Parameters
    ----------
    folder
        Where exports are written.
    name
        ``keepout``, ``nav2-graph``, ``rmf`` or ``spot``; for others, nothing is removed.

    Raises
    ------
    OutputError
        If a file cannot be removed.
    """
    patterns = {
        "keepout": (f"{_MASK_NAME}*.yaml", f"{_MASK_NAME}*.pgm"),
        "nav2-graph": (ROUTE_GRAPH_FILE,),
        "rmf": (RMF_GRAPH_FILE,),
        "spot": ("spot_stairway_*.pb",),
    }
    try:
        for pattern in patterns.get(name, ()):
            for path in sorted(folder.glob(pattern)):
                path.unlink()
    except OSError as error:
        raise output_error(folder, error) from error


def dump_json(values: Mapping[str, Any], path: Path) -> None:
    """Write JSON types to a file.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_whole_text(path, json.dumps(null_for_nan(values), indent=1, allow_nan=False) + "\n")


def _node(number: int, node: RouteNode, frame_id: str) -> dict[str, Any]:
    metadata: dict[str, Any] = {
        "class": {"staging": "stair_staging", "waypoint": "waypoint"}.get(node.kind, f"stair_{node.kind}"),
        "floor": node.level,
        "z": rounded(node.position[2]),
    }
    if node.stairway_id is not None:
        metadata["stairway"] = node.stairway_id
    if node.kind == "staging":
        metadata |= {"end": node.end, "yaw": rounded(node.heading), "is_open": node.is_open}
    return {
        "type": "Feature",
        "properties": {"id": number, "frame": frame_id, "metadata": metadata},
        "geometry": {"type": "Point", "coordinates": rounded(node.position[:2])},
    }


def _edge(number: int, edge: RouteEdge, graph: RouteGraph, robot: RobotProfile) -> dict[str, Any]:
    start, end = graph.nodes[edge.start], graph.nodes[edge.end]
    properties: dict[str, Any] = {
        "id": number,
        "startid": edge.start,
        "endid": edge.end,
        "cost": rounded(edge.cost),
        "overridable": edge.portal is None,
    }
    metadata: dict[str, Any] = {"class": edge.kind, "length": rounded(edge.length)}
    if edge.portal is None:
        # nav2_route reads a whole number as an integer, and TimeScorer then throws: it asks for a float.
        metadata |= {
            "floor_start": start.level, "floor_end": end.level, "abs_speed_limit": float(robot.floor_speed),
        }  # fmt: skip
    else:
        portal, up = edge.portal, edge.kind == "stairs_up"
        ends = (portal.lower_level, portal.upper_level)[:: 1 if up else -1]
        metadata |= {
            "stairway": portal.stairway_id,
            "floor_start": ends[0],
            "floor_end": ends[1],
            "height": rounded(edge.height),
            "verdict": portal.verdict,
            "probability": rounded(portal.assessment.probability[0]),
            "leads_to_unexplored": portal.leads_to_unexplored,
            "abs_speed_limit": float(robot.stair_speed),
            "way_z": rounded([start.position[2], end.position[2]]),
        }
        properties["operations"] = _operations(edge)
    return {
        "type": "Feature",
        "properties": {**properties, "metadata": metadata},
        "geometry": {
            "type": "MultiLineString",
            "coordinates": [[rounded(start.position[:2]), rounded(end.position[:2])]],
        },
    }


def _operations(edge: RouteEdge) -> dict[str, Any]:
    """What nav2_route triggers on a stair edge."""

    def event(trigger: str, service: str) -> dict[str, Any]:
        return {"type": "TriggerEvent", "trigger": trigger, "metadata": {"service_name": f"stairs/{service}"}}

    begin = event("ON_ENTER", "begin_up" if edge.kind == "stairs_up" else "begin_down")
    return {"begin": begin, "end": event("ON_EXIT", "end")} if edge.is_last else {"begin": begin}
