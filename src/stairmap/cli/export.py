"""``stairmap export``: the stairways of a run in the formats of other programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import typer

from stairmap.cli.floor_grids import FloorMaps, load_floor_grids
from stairmap.cli.requests import ExportRequest
from stairmap.errors import ConfigError, OutputError, StairmapError
from stairmap.export.building import Building, load_building
from stairmap.export.geojson import EarthAnchor, osm_from_stairways
from stairmap.export.ifc import dump_ifc
from stairmap.export.loading import ResultsError, load_stairways
from stairmap.export.mesh import dump_obj, dump_ply
from stairmap.export.nav2 import (
    RMF_GRAPH_FILE,
    ROUTE_GRAPH_FILE,
    dump_json,
    dump_keepout_masks,
    dump_route_graph,
    nav2_from_route_graph,
    remove_navigation_files,
)
from stairmap.export.rmf import dump_rmf, rmf_from_route_graph
from stairmap.export.spot import dump_spot
from stairmap.export.stair_points import height_layer, ply_from_points, points_from_stairways
from stairmap.navigation.keepout import block_stairs, forbidden_ground
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.navigation.portals import ANY_ROBOT, make_portals
from stairmap.navigation.robot_profile import RobotProfile, load_robot
from stairmap.navigation.route_graph import RouteGraph, make_route_graph
from stairmap.output_files import check_new_file, output_error, write_whole

FILES = {
    "nav2-graph": ROUTE_GRAPH_FILE, "osm": "stairways_osm.geojson", "ifc": "stairways.ifc",
    "ply": "stairways.ply", "obj": "stairways.obj", "rmf": RMF_GRAPH_FILE,
    "cloud": "stairs_cloud.ply",
}  # fmt: skip
"""File that each format writes; keep-out masks are one a floor, Spot's staircases one a flight."""

_OVER_FLOORS = {"nav2-graph", "rmf"}
"""Formats that need maps of the floors."""


def export_stairways(request: ExportRequest) -> int:
    """Write the stairways of a run in each format that was asked for; return the exit code.

    A format that cannot be written does not keep the others from being written. Masks and graphs of an
    earlier export are removed from the folder: a robot must not obey those of another robot.

    Raises
    ------
    StairmapError
        If the run cannot be read or holds no stairway, a profile or anchor is missing or bad, or a
        file cannot be written.
    """
    robot = None if request.robot is None else load_robot(request.robot)
    if "osm" in request.formats and request.anchor is None:
        raise ConfigError(
            "GeoJSON needs the place on earth; pass --anchor LAT,LON[,BEARING] of the map's origin"
        )
    if (request.maps or request.recording) and not _OVER_FLOORS & set(request.formats):
        option = "--map" if request.maps else "--recording"
        raise ConfigError(f"{option} is for nav2-graph and rmf alone, which lead over floors; leave it out")
    anchor = None if request.anchor is None else EarthAnchor(
        latitude=request.anchor[0], longitude=request.anchor[1], bearing=request.anchor[2],
        height=request.anchor[3],
    )  # fmt: skip
    results = load_stairways(request.run)
    if not results.stairways and not (results.drops and set(request.formats) == {"keepout"}):
        raise ResultsError(f"{request.run} holds no stairway, so there is nothing to export")
    building = load_building(request.run)
    try:
        request.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise output_error(request.output, error) from error
    for name in request.formats:
        remove_navigation_files(request.output, name)
    grids, note = _grids(request, building)
    task = _Task(
        building=building, folder=request.output, robot=robot, anchor=anchor, grids=grids, grid_note=note
    )
    tried = [_try_export(name, task) for name in request.formats]
    errors = [outcome for outcome in tried if outcome is not None]
    for failure in errors[:-1]:
        typer.echo(f"error: {failure}", err=True)
    if errors:
        raise errors[-1]
    return 0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Task:
    """What is written where: a building, for a robot, with its floors' maps, or why there are none."""

    building: Building
    folder: Path
    robot: RobotProfile | None
    anchor: EarthAnchor | None
    grids: Mapping[int, OccupancyGrid]
    grid_note: str = ""


def _grids(request: ExportRequest, building: Building) -> tuple[dict[int, OccupancyGrid], str]:
    """Maps of floors for the formats that lead over them; without a recording none, and a sentence why."""
    if not _OVER_FLOORS & set(request.formats):
        return {}, ""
    maps = FloorMaps(run=request.run, recording=request.recording, maps=request.maps)
    try:
        grids = load_floor_grids(maps, building.floors, building.trajectory)
    except StairmapError as error:
        if request.recording is not None or request.maps:
            raise
        return {}, f"the graph gets no edges on floors: {error}"
    blocked = {
        level: block_stairs(grid, building.stairways, building.floors, level, drops=building.drops)
        for level, grid in grids.items()
    }
    return blocked, ""


def _try_export(name: str, task: _Task) -> StairmapError | None:
    """Write one format and print its files; return what went wrong."""
    try:
        for path in _export(name, task):
            typer.echo(str(path))
    except StairmapError as error:
        return error
    return None


def _export(name: str, task: _Task) -> tuple[Path, ...]:
    stairways, floors, drops = task.building.stairways, task.building.floors, task.building.drops
    if name == "keepout":
        paths = dump_keepout_masks(stairways, floors, task.folder, drops=drops, robot=task.robot)
        if not paths:
            typer.echo("no keep-out mask: no stairway and no drop forbids any ground to the robot", err=True)
        return paths
    if name == "spot":
        return _export_spot(task)
    if name == "elevation":
        return _export_heights(task)
    path = task.folder / FILES[name]
    check_new_file(path, option="-f " + name + ":")
    if name == "nav2-graph":
        profile = ANY_ROBOT if task.robot is None else task.robot
        dump_route_graph(
            nav2_from_route_graph(_route_graph(task), profile, frame_id=task.building.frame_id), path
        )
    elif name == "osm" and task.anchor is not None:
        dump_json(osm_from_stairways(stairways, floors, task.anchor), path)
    elif name == "ifc":
        dump_ifc(stairways, floors, path, anchor=task.anchor)
    elif name == "rmf":
        profile = ANY_ROBOT if task.robot is None else task.robot
        values = rmf_from_route_graph(_route_graph(task), profile, building_name=task.building.frame_id)
        dump_rmf(values, path)
    elif name == "ply":
        dump_ply(stairways, path)
    elif name == "cloud":
        write_whole(path, ply_from_points(points_from_stairways(stairways)))
    else:
        dump_obj(stairways, path)
    return (path,)


def _export_spot(task: _Task) -> tuple[Path, ...]:
    """Write the stairways that a robot can climb, all of them without a robot."""
    stairways = task.building.stairways
    if task.robot is not None:
        stairways = forbidden_ground(stairways, (), task.robot).climbed
        if not stairways:
            raise OutputError(
                f"none of {len(task.building.stairways)} stairways can be used by {task.robot.name}"
            )
    return dump_spot(stairways, task.folder, floors=task.building.floors, frame_id=task.building.frame_id)


def _route_graph(task: _Task) -> RouteGraph:
    """The graph of the building; what is missing in it, or was seen by nobody, is told."""
    profile = ANY_ROBOT if task.robot is None else task.robot
    portals = make_portals(task.building.stairways, task.building.floors, profile, task.building.drops)
    graph = make_route_graph(portals, profile, task.grids, allow_unknown=task.robot is None)
    used = {edge.portal.stairway_id for edge in graph.edges if edge.portal is not None}
    open_ends = [note for portal in portals if portal.stairway_id in used for note in portal.notes]
    for note in (task.grid_note, *graph.notes, *open_ends) if graph.edges else ():
        if note:
            typer.echo(note, err=True)
    return graph


def _export_heights(task: _Task) -> tuple[Path, ...]:
    """Write a height layer for each stairway: those of two storeys lie one above the other."""
    paths = []
    for stairway in task.building.stairways:
        path = task.folder / f"elevation_{stairway.id}.npz"
        check_new_file(path, option="-f elevation:")
        paths.append(write_whole(path, height_layer(stairway).to_npz()))
    return tuple(paths)
