"""``stairmap export``: the stairways of a run in the formats of other programs."""

from __future__ import annotations

from pathlib import Path

import typer

from stairmap.cli.requests import ExportRequest
from stairmap.errors import ConfigError, StairmapError
from stairmap.export.building import Building, load_building
from stairmap.export.geojson import EarthAnchor, osm_from_stairways
from stairmap.export.ifc import dump_ifc
from stairmap.export.loading import ResultsError, load_stairways
from stairmap.export.mesh import dump_obj, dump_ply
from stairmap.export.nav2 import (
    ROUTE_GRAPH_FILE,
    dump_json,
    dump_keepout_masks,
    dump_route_graph,
    remove_navigation_files,
    route_graph_from_portals,
)
from stairmap.navigation.portals import ANY_ROBOT, make_portals
from stairmap.navigation.robot_profile import RobotProfile, load_robot
from stairmap.output_files import check_new_file, output_error


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
    anchor = None if request.anchor is None else EarthAnchor(
        latitude=request.anchor[0], longitude=request.anchor[1], bearing=request.anchor[2]
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
    tried = [_try_export(name, building, request.output, robot, anchor) for name in request.formats]
    errors = [outcome for outcome in tried if outcome is not None]
    for failure in errors[:-1]:
        typer.echo(f"error: {failure}", err=True)
    if errors:
        raise errors[-1]
    return 0


def _try_export(
    name: str, building: Building, folder: Path, robot: RobotProfile | None, anchor: EarthAnchor | None
) -> StairmapError | None:
    """Write one format and print its files; return what went wrong."""
    try:
        for path in _export(name, building, folder, robot, anchor):
            typer.echo(str(path))
    except StairmapError as error:
        return error
    return None


def _export(
    name: str,
    building: Building,
    folder: Path,
    robot: RobotProfile | None,
    anchor: EarthAnchor | None,
) -> tuple[Path, ...]:
    stairways, floors = building.stairways, building.floors
    if name == "keepout":
        paths = dump_keepout_masks(stairways, floors, folder, drops=building.drops, robot=robot)
        if not paths:
            typer.echo("no keep-out mask: the robot can climb every stairway, and no drop was seen", err=True)
        return paths
    path = folder / {
        "nav2-graph": ROUTE_GRAPH_FILE, "osm": "stairways_osm.geojson", "ifc": "stairways.ifc",
        "ply": "stairways.ply", "obj": "stairways.obj",
    }[name]  # fmt: skip
    check_new_file(path, option="-f " + name + ":")
    if name == "nav2-graph":
        profile = ANY_ROBOT if robot is None else robot
        portals = make_portals(stairways, floors, profile, building.drops)
        dump_route_graph(
            route_graph_from_portals(
                portals, robot=profile, frame_id=building.frame_id, allow_unknown=robot is None
            ),
            path,
        )
    elif name == "osm" and anchor is not None:
        dump_json(osm_from_stairways(stairways, floors, anchor), path)
    elif name == "ifc":
        dump_ifc(stairways, floors, path)
    elif name == "ply":
        dump_ply(stairways, path)
    else:
        dump_obj(stairways, path)
    return (path,)
