"""``stairmap plan``: a way over the floors of a run, or where to explore next."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import typer

from stairmap.cli.floor_grids import FloorMaps, load_floor_grids
from stairmap.cli.plain_table import format_columns
from stairmap.cli.requests import PlanRequest
from stairmap.errors import ConfigError
from stairmap.export.building import load_building
from stairmap.export.nav2 import dump_json
from stairmap.export.results import null_for_nan
from stairmap.navigation.exploration import Candidate, find_candidates
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.keepout import block_stairs
from stairmap.navigation.occupancy import OccupancyGrid, dump_map
from stairmap.navigation.planner import FloorPlanner, Route
from stairmap.navigation.portals import Portal, make_portals, note_obstacles
from stairmap.navigation.robot_profile import load_robot
from stairmap.output_files import check_new_folder, output_error, write_whole
from stairmap.trajectory import Trajectory
from stairmap.visualization.floor_map import draw_floor_maps
from stairmap.visualization.plots import png_from_figure

NOTHING_FOUND = 3
"""Exit code of a plan without a way, or with nothing left to explore: an answer, and no mistake."""


def plan_way(request: PlanRequest) -> int:
    """Print a way or the places to explore; return the exit code: ``NOTHING_FOUND`` where there is none.

    Raises
    ------
    StairmapError
        If the run, the recording, a map or a profile cannot be used, or an end of the way is no place
        where the robot can be.
    """
    if request.output is not None:
        check_new_folder(request.output)
    robot = load_robot(request.robot)
    building = load_building(request.run, camera_height=request.camera_height)
    stairways, floors, trajectory = building.stairways, building.floors, building.trajectory
    grids = load_floor_grids(
        FloorMaps(run=request.run, recording=request.recording, maps=request.maps), floors, trajectory
    )
    portals = tuple(note_obstacles(p, grids) for p in make_portals(stairways, floors, robot, building.drops))
    blocked = {
        level: block_stairs(grid, stairways, floors, level, drops=building.drops)
        for level, grid in grids.items()
    }
    planner = FloorPlanner(blocked, portals, robot, allow_unknown=request.allow_unknown)
    x, y, level = _start(request, floors, trajectory)
    route: Route | None = None
    candidates: tuple[Candidate, ...] = ()
    if request.goal is None:
        candidates = find_candidates(planner, level, (x, y))
    else:
        route = planner.find_route(level, (x, y), request.goal[2], request.goal[:2])
    values = _describe(floors, portals, route, candidates)
    for portal in portals:
        for note in portal.notes:
            typer.echo(note, err=True)
    if request.as_json:
        typer.echo(json.dumps(null_for_nan(values), indent=1, allow_nan=False))
    else:
        typer.echo(_format_text(route, candidates))
    if request.output is not None:
        figure = draw_floor_maps(
            floors, stairways, portals, grids=grids, route=route, candidates=candidates, drops=building.drops
        )
        _write(request.output, values, grids, png_from_figure(figure))
        if not request.as_json:
            typer.echo(str(request.output))
    is_found = bool(candidates) if route is None else bool(route)
    return 0 if is_found else NOTHING_FOUND


def _start(
    request: PlanRequest, floors: FloorStack, trajectory: Trajectory | None
) -> tuple[float, float, int]:
    if request.start is not None:
        return request.start
    if trajectory is None:
        raise ConfigError(f"{request.run} has no trajectory.tum; pass --from X,Y,LEVEL")
    x, y, z = (float(value) for value in trajectory.map_from_camera[-1, :3, 3])
    floor = min(floors.floors, key=lambda floor: abs(floor.height - (z - floors.camera_height)))
    return x, y, floor.level


def _describe(
    floors: FloorStack, portals: tuple[Portal, ...], route: Route | None, candidates: tuple[Candidate, ...]
) -> dict[str, Any]:
    values: dict[str, Any] = {
        "floors": [
            {
                "level": floor.level,
                "height": floor.height,
                "is_explored": floor.is_explored,
                "is_open": floor.is_open,
            }
            for floor in floors.floors
        ],
        "portals": [portal.to_dict() for portal in portals],
    }
    if route is None:
        return {**values, "candidates": [candidate.to_dict() for candidate in candidates]}
    legs = [
        {
            "kind": leg.kind,
            "level": leg.level,
            "stairway": leg.stairway_id,
            "cost": leg.cost,
            "points": leg.points.tolist(),
        }
        for leg in route.legs
    ]
    return {**values, "route": {"cost": route.cost, "reason": route.reason, "legs": legs}}


def _format_text(route: Route | None, candidates: tuple[Candidate, ...]) -> str:
    if route is None:
        if not candidates:
            return "there is nothing left to explore that this robot can reach"
        header = ("rank", "what", "floor", "x, y m", "cost s", "size m")
        rows = [
            (
                str(rank),
                "frontier" if candidate.kind == "frontier" else f"stairway {candidate.stairway_id}",
                str(candidate.level),
                ", ".join(f"{value:.2f}" for value in candidate.position),
                f"{candidate.cost:.0f}",
                f"{candidate.size:.1f}" if candidate.kind == "frontier" else "",
            )
            for rank, candidate in enumerate(candidates, start=1)
        ]
        return format_columns(header, rows, left_aligned=("what",))
    if not route:
        return f"no way: {route.reason}"
    legs = [
        (
            "floor" if leg.kind == "floor" else f"stairway {leg.stairway_id} {leg.kind}",
            str(leg.level),
            ", ".join(f"{value:.2f}" for value in leg.points[-1, :2]),
            f"{leg.cost:.0f}",
        )
        for leg in route.legs
    ]
    table = format_columns(("leg", "from floor", "ends at x, y m", "cost s"), legs, left_aligned=("leg",))
    return f"{table}\n\n{route.cost:.0f} s in all"


def _write(output: Path, values: dict[str, Any], grids: dict[int, OccupancyGrid], picture: bytes) -> None:
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise output_error(output, error) from error
    dump_json(values, output / "plan.json")
    write_whole(output / "plan.png", picture)
    for level, grid in grids.items():
        dump_map(grid, output, f"floor_{level}")
