"""Options of ``stairmap export``."""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import DebugOption, parse_map
from stairmap.cli.requests import ExportRequest

_MAX_ANGLE_DEG = 360.0


class Format(str, Enum):
    """What ``--format`` takes."""

    nav2_graph = "nav2-graph"
    keepout = "keepout"
    osm = "osm"
    ifc = "ifc"
    spot = "spot"
    rmf = "rmf"
    ply = "ply"
    obj = "obj"
    cloud = "cloud"
    elevation = "elevation"


def export(
    *,
    run: Annotated[Path, typer.Argument(help="Run folder, or its stairways.json.", show_default=False)],
    formats: Annotated[
        list[Format],
        typer.Option(
            "--format",
            "-f",
            metavar="NAME",
            help="nav2-graph, rmf, keepout, spot, osm, ifc, ply, obj, cloud or elevation; may be repeated.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Folder for the files. Default: 'export' in the run folder, or the next free 'export_<n>'.",
            show_default=False,
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            metavar="NAME|FILE",
            help="nav2-graph, rmf, spot: stairs that it can climb, its costs (s). keepout: all other stairs.",
            show_default=False,
        ),
    ] = None,
    anchor: Annotated[
        str | None,
        typer.Option(
            "--anchor",
            metavar="LAT,LON[,BEARING[,HEIGHT]]",
            help="osm, ifc: map's origin, bearing of its x axis (default 90: east), deg; height, m.",
            show_default=False,
        ),
    ] = None,
    recording: Annotated[
        Path | None,
        typer.Option(
            "--recording",
            metavar="DIR",
            help="nav2-graph, rmf: recording of the run, to map its floors. Default: where the run read it.",
            show_default=False,
        ),
    ] = None,
    maps: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="LEVEL=FILE",
            help="nav2-graph, rmf: Nav2 map (YAML) of a floor, such as 0=ground.yaml; may be repeated.",
            show_default=False,
        ),
    ] = None,
    debug: DebugOption = False,
) -> None:
    """Write the stairways of a run in the formats of planners, maps and building models.

    \b
    Examples:
      stairmap export results/hall_1 -f nav2-graph -f keepout --robot spot
      stairmap export results/hall_1 -f osm --anchor 48.2628,11.6681,90
      stairmap export results/hall_1 -f ifc -f obj -o hall_model
    """
    from stairmap.cli.export import export_stairways  # noqa: PLC0415

    request = ExportRequest(
        run=run,
        formats=tuple(item.value for item in formats),
        output=_default_output(run) if output is None else output,
        robot=robot,
        anchor=None if anchor is None else _parse_anchor(anchor),
        recording=recording,
        maps=tuple(parse_map(text) for text in maps or ()),
    )
    raise typer.Exit(export_stairways(request))


def _default_output(run: Path) -> Path:
    """The first of ``export``, ``export_2``, … in the run folder that is new or empty."""
    folder = run if run.is_dir() else run.parent
    number = 1
    while True:
        path = folder / (f"export_{number}" if number > 1 else "export")
        if not path.exists() or (path.is_dir() and not any(path.iterdir())):
            return path
        number += 1


def _parse_anchor(text: str) -> tuple[float, float, float, float | None]:
    expected = f"--anchor: expected LAT,LON, LAT,LON,BEARING or LAT,LON,BEARING,HEIGHT, got {text!r}"
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError as error:
        raise typer.BadParameter(expected) from error
    is_number = all(abs(value) <= _MAX_ANGLE_DEG for value in values[:3])
    if len(values) not in (2, 3, 4) or not is_number or not all(map(math.isfinite, values)):
        raise typer.BadParameter(expected)
    bearing = values[2] if len(values) > 2 else 90.0
    return values[0], values[1], bearing, values[3] if len(values) > 3 else None
