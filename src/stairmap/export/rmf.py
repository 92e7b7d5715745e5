"""Stairways as a navigation graph of Open-RMF, by the rules of rmf_fleet_adapter's parser.

That parser knows one way from level to level: a *lift*, whose waypoints stand above each other. So a stairway
is a lift: lanes lead up to a waypoint halfway over the stairs on the lower level, and on from one at the same
place on the upper level. RMF then lets one robot at a time onto the stairs, and asks the lift's adapter,
which for stairs always says yes. A robot waits for its answer where the lane into the lift begins: before
the stairs, or on a landing, for there are no vertices on flights but the lift's. RMF plans to hold at none of
them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from stairmap.arrays import Points, Vector
from stairmap.errors import OutputError
from stairmap.navigation.portals import Portal
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.navigation.route_graph import RouteGraph
from stairmap.output_files import write_whole_text
from stairmap.stairway import rounded

STRAIGHT = 0.02
"""A place so near to the straight way past it is no turn, m."""


class _Level:
    """Vertices and lanes of one level, as they come."""

    def __init__(self) -> None:
        self.vertices: list[list[Any]] = []
        self.lanes: list[list[Any]] = []

    def add(self, place: Vector, **options: Any) -> int:
        self.vertices.append([*rounded(place[:2]), {"name": "", **options}])
        return len(self.vertices) - 1

    def link(self, start: int, end: int, speed: float) -> None:
        self.lanes.append([start, end, {"speed_limit": float(speed)}])


def rmf_from_route_graph(graph: RouteGraph, robot: RobotProfile, *, building_name: str) -> dict[str, Any]:
    """Return a graph as Open-RMF's fleet adapters read it: YAML types.

    Parameters
    ----------
    graph
        Stairs and floors.
    robot
        Its speeds, and in which directions it takes stairs.
    building_name
        Name of the building.

    Raises
    ------
    OutputError
        If no stairway is left.
    """
    portals = _portals_of(graph)
    if not portals:
        raise OutputError(f"none of {graph.num_stairways} stairways can be used by {robot.name}")
    levels: dict[int, _Level] = {}
    lifts: dict[str, Any] = {}
    place_of: dict[int, int] = {}
    for number, node in enumerate(graph.nodes):
        if node.kind in ("staging", "waypoint"):
            level = levels.setdefault(node.level, _Level())
            name = f"stairway_{node.stairway_id}_{node.end}" if node.kind == "staging" else ""
            place_of[number] = level.add(node.position, name=name)
    for edge in graph.edges:
        if edge.portal is None:
            level = levels[graph.nodes[edge.start].level]
            level.link(place_of[edge.start], place_of[edge.end], robot.floor_speed)
    for portal in portals:
        name = f"stairway_{portal.stairway_id}"
        ends = [
            number for number, node in enumerate(graph.nodes)
            if node.kind == "staging" and node.stairway_id == portal.stairway_id
        ]  # fmt: skip
        middle, index = _middle_of(portal.way)
        lifts[name] = {"position": [*rounded(middle[:2]), rounded(portal.lower.heading)], "dims": [1.0, 1.0]}
        for number, level_number, inner in (
            (ends[0], portal.lower_level, portal.way[1:index]),
            (ends[1], portal.upper_level, portal.way[index:-1][::-1]),
        ):
            level = levels[level_number]
            turns = _turns_of([graph.nodes[number].position, *inner, middle])
            chain = [place_of[number], *(level.add(place, is_passthrough_point=True) for place in turns)]
            chain.append(level.add(middle, lift=name, is_passthrough_point=True))
            is_lower = number == ends[0]
            for first, second in pairwise(chain):
                # Onto the stairs from below one goes up, from above down.
                if robot.takes_stairs(up=is_lower):
                    level.link(first, second, robot.stair_speed)
                if robot.takes_stairs(up=not is_lower):
                    level.link(second, first, robot.stair_speed)
    return {
        "building_name": building_name,
        "levels": {
            f"floor_{number}": {"lanes": level.lanes, "vertices": level.vertices}
            for number, level in sorted(levels.items())
        },
        "lifts": lifts,
    }


def dump_rmf(values: dict[str, Any], path: Path) -> None:
    """Write a navigation graph of Open-RMF.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_whole_text(path, yaml.safe_dump(values, sort_keys=False, default_flow_style=None))


def _portals_of(graph: RouteGraph) -> Sequence[Portal]:
    found = {edge.portal.stairway_id: edge.portal for edge in graph.edges if edge.portal is not None}
    return list(found.values())


def _turns_of(places: Sequence[Vector]) -> list[Vector]:
    """Places between the first and the last of a way at which it turns."""
    kept = [places[0]]
    for place, after in pairwise(places[1:]):
        along, offset = (after - kept[-1])[:2], (place - kept[-1])[:2]
        off = abs(along[0] * offset[1] - along[1] * offset[0]) / max(float(np.hypot(*along)), 1e-9)
        if off > STRAIGHT:
            kept.append(place)
    return kept[1:]


def _middle_of(way: Points) -> tuple[Vector, int]:
    """Place halfway along a way, and the index of the first point behind it."""
    lengths = np.linalg.norm(np.diff(way, axis=0), axis=1)
    reached = np.concatenate([[0.0], np.cumsum(lengths)])
    half = reached[-1] / 2
    index = int(np.searchsorted(reached, half, side="right"))
    share = (half - reached[index - 1]) / lengths[index - 1]
    return way[index - 1] + share * (way[index] - way[index - 1]), index
