"""Options that several commands share, with their help texts."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from stairmap.cli.exits import remember_debug
from stairmap.cli.requests import MethodRequest

INPUT = "Input"
METHOD = "Method"
OUTPUT = "Output"


class Method(str, Enum):
    """Names of the methods; ``stairmap.pipeline.METHODS`` is too heavy to import for ``--help``."""

    stairmap = "stairmap"
    delmerico2013 = "delmerico2013"


class Up(str, Enum):
    """What ``--up`` takes; ``stairmap.recordings.map_up`` is too heavy to import for ``--help``."""

    plus_x = "+x"
    minus_x = "-x"
    plus_y = "+y"
    minus_y = "-y"
    plus_z = "+z"
    minus_z = "-z"
    auto = "auto"


RecordingArgument: TypeAlias = Annotated[
    Path,
    typer.Argument(help="Folder with depth.txt, camera.json and PNG images.", show_default=False),
]
TrajectoryOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--trajectory",
        metavar="FILE",
        help="Poses to use instead of the recording's own: TUM file, s and m.",
        rich_help_panel=INPUT,
        show_default=False,
    ),
]
UpOption: TypeAlias = Annotated[
    Up | None,
    typer.Option(
        "--up",
        metavar="AXIS",
        help="Axis of the poses' map that points up: +x -x +y -y +z -z, or auto: from the floor. Default +z.",
        rich_help_panel=INPUT,
        show_default=False,
    ),
]
MethodOption: TypeAlias = Annotated[
    Method,
    typer.Option(
        "--method",
        metavar="NAME",
        help="stairmap, or delmerico2013: the method of ARL-TR-6381.",
        rich_help_panel=METHOD,
    ),
]
ConfigOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--config",
        metavar="FILE",
        help="YAML file with values to change; 'stairmap config' prints all.",
        rich_help_panel=METHOD,
        show_default=False,
    ),
]
SetOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change one value, such as detection.max_depth=4 (m); may be repeated.",
        rich_help_panel=METHOD,
        show_default=False,
    ),
]
OutputOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="DIR",
        help="New or empty folder for the results. Default: results/<recording>_<n>, the next free n.",
        rich_help_panel=OUTPUT,
        show_default=False,
    ),
]
JsonOption: TypeAlias = Annotated[
    bool,
    typer.Option("--json", help="Print JSON and nothing else on stdout (m, rad).", rich_help_panel=OUTPUT),
]
DebugOption: TypeAlias = Annotated[
    bool, typer.Option("--debug", help="Show the traceback of an error.", callback=remember_debug)
]


def method_request(
    recording: Path,
    trajectory: Path | None,
    up: Up | None,
    *,
    method: Method,
    config: Path | None,
    overrides: list[str] | None,
) -> MethodRequest:
    """Return what the options that ``run``, ``detect`` and ``inspect`` share ask for."""
    return MethodRequest(
        recording=recording,
        trajectory=trajectory,
        up=None if up is None else up.value,
        method=method.value,
        config_file=config,
        overrides=tuple(overrides or ()),
    )
