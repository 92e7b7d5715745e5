"""Stairways for Nav2: the graph of the Route Server, and keep-out masks.

Rules of nav2_route's GeoJSON parser that the graph keeps: points are nodes and ``MultiLineString`` are
edges (older versions know no ``LineString``); ``id``, ``startid`` and ``endid`` are unsigned integers, and
no id is used twice; at least one node and one edge; metadata hold numbers, booleans, texts, or flat arrays of
them, never ``null``. An ``overridable: false`` edge keeps its cost whatever the edge scorers say.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.drop import Drop
from stairmap.errors import OutputError
from stairmap.export.results import null_for_nan
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.footprints import forbidden_ground, make_keepout_mask
from stairmap.navigation.occupancy import OccupancyGrid, dump_map
from stairmap.navigation.portals import ANY_ROBOT, Portal, StagingPose
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.output_files import output_error, write_whole_text
from stairmap.stairway import Stairway, rounded

ROUTE_GRAPH_FILE = "route_graph.geojson"
_MASK_NAME = "keepout_floor_"


def route_graph_from_portals(
    portals: Sequence[Portal],
    *,
    robot: RobotProfile = ANY_ROBOT,
    frame_id: str = "map",
    allow_unknown: bool = True,
) -> dict[str, Any]:
    """Return the portals as a graph for Nav2's Route Server.

    A node for each staging pose; an edge up and one down for each stairway; edges both ways between
    staging poses of one floor, straight and open to edge scorers. All costs are seconds, so
    ``TimeScorer`` is the scorer that fits them.

    Parameters
    ----------
    portals
        The stairways.
    robot
        Its ``floor_speed`` makes the costs on floors.
    frame_id
        Coordinate frame of the nodes.
    allow_unknown
        Whether stairs with the verdict ``unknown`` get edges. Impassable ones never do.

    Raises
    ------
    OutputError
        If no stairway is left: nav2_route refuses a graph without edges.
    """
    used = [
        portal
        for portal in portals
        if portal.verdict == "passable" or (allow_unknown and portal.verdict == "unknown")
    ]
    if not used:
        raise OutputError(
            f"none of {len(portals)} stairways can be used by {robot.name}, and nav2_route refuses a graph "
            "without edges"
        )
    nodes: list[dict[str, Any]] = []
    edges: list[dict[str, Any]] = []
    on_floor: dict[int, list[int]] = {}
    for portal in used:
        ends = []
        for name, level, pose in (
            ("lower", portal.lower_level, portal.lower),
            ("upper", portal.upper_level, portal.upper),
        ):
            on_floor.setdefault(level, []).append(len(nodes))
            ends.append(len(nodes))
            is_open = portal.is_lower_open if name == "lower" else portal.is_upper_open
            nodes.append(_node(len(nodes), portal, name, level, pose, frame_id))
            nodes[-1]["properties"]["metadata"]["is_open"] = is_open
        edges += [
            _stair_edge(portal, "up", ends[0], ends[1], portal.cost_up, portal.way),
            _stair_edge(portal, "down", ends[1], ends[0], portal.cost_down, portal.way[::-1]),
        ]
    for level, members in sorted(on_floor.items()):
        for first, second in combinations(members, 2):
            edges += _floor_edges(nodes, level, first, second, robot.floor_speed)
    for number, edge in enumerate(edges, start=len(nodes)):
        edge["properties"]["id"] = number
    return {"type": "FeatureCollection", "name": "stairmap", "features": [*nodes, *edges]}


def dump_route_graph(graph: Mapping[str, Any], path: Path) -> None:
    """Write a graph for Nav2's Route Server; see ``route_graph_from_portals``.

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
    under them, and the strip before each edge.

    Parameters
    ----------
    stairways, floors
        What there is.
    folder
        Where to write; created if needed.
    drops
        Where the ground ends.
    robot
        Stairs that it can climb stay open, and so do their own edges. ``None``: all are forbidden, as for
        wheels.
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
    forbidden, edges = forbidden_ground(stairways, drops, robot)
    paths = []
    for floor in floors.floors:
        like = None if grids is None else grids.get(floor.level)
        mask = make_keepout_mask(forbidden, floors, floor.level, drops=edges, like=like)
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
        ``keepout`` or ``nav2-graph``; for others, nothing is removed.

    Raises
    ------
    OutputError
        If a file cannot be removed.
    """
    patterns = {"keepout": (f"{_MASK_NAME}*.yaml", f"{_MASK_NAME}*.pgm"), "nav2-graph": (ROUTE_GRAPH_FILE,)}
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


def _node(
    number: int, portal: Portal, end: str, level: int, pose: StagingPose, frame_id: str
) -> dict[str, Any]:
    return {
        "type": "Feature",
        "properties": {
            "id": number,
            "frame": frame_id,
            "metadata": {
                "class": "stair_staging",
                "end": end,
                "floor": level,
                "stairway": portal.stairway_id,
                "z": rounded(pose.position[2]),
                "yaw": rounded(pose.heading),
            },
        },
        "geometry": {"type": "Point", "coordinates": rounded(pose.position[:2])},
    }


def _stair_edge(portal: Portal, kind: str, start: int, end: int, cost: float, way: Any) -> dict[str, Any]:
    up = kind == "up"
    return {
        "type": "Feature",
        "properties": {
            "startid": start,
            "endid": end,
            "cost": rounded(cost),
            "overridable": False,
            "metadata": {
                "class": f"stairs_{kind}",
                "stairway": portal.stairway_id,
                "floor_start": portal.lower_level if up else portal.upper_level,
                "floor_end": portal.upper_level if up else portal.lower_level,
                "length": rounded(portal.length),
                "height": rounded(portal.height if up else -portal.height),
                "verdict": portal.verdict,
                "probability": rounded(portal.assessment.probability[0]),
                "leads_to_unexplored": portal.leads_to_unexplored,
                "way_z": rounded(way[:, 2]),
            },
        },
        "geometry": {"type": "MultiLineString", "coordinates": [rounded(way[:, :2])]},
    }


def _floor_edges(
    nodes: Sequence[Mapping[str, Any]], level: int, first: int, second: int, speed: float
) -> list[dict[str, Any]]:
    ends = {number: nodes[number]["geometry"]["coordinates"] for number in (first, second)}
    length = float(np.linalg.norm(np.subtract(ends[first], ends[second])))
    return [
        {
            "type": "Feature",
            "properties": {
                "startid": start,
                "endid": end,
                "cost": rounded(length / speed),
                "overridable": True,
                "metadata": {
                    "class": "floor",
                    "floor_start": level,
                    "floor_end": level,
                    "length": rounded(length),
                    "abs_speed_limit": speed,
                },
            },
            "geometry": {"type": "MultiLineString", "coordinates": [[ends[start], ends[end]]]},
        }
        for start, end in ((first, second), (second, first))
    ]
