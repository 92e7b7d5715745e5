"""Options that several commands share, with their help texts."""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from stairmap.cli.exits import remember_debug
from stairmap.cli.requests import MethodRequest
from stairmap.recordings.bag_options import BagOptions

INPUT = "Input"
METHOD = "Method"
OUTPUT = "Output"
BAG = "Bags"


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
    typer.Argument(
        help="Bag (.bag, .mcap, .db3), or folder with depth.txt, camera.json and PNG images.",
        show_default=False,
    ),
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
OdometryOption: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--odometry",
        help="Find the poses from the depth itself (extra odometry). They drift by some % of the path.",
        rich_help_panel=INPUT,
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
PoseFormatOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--pose-format",
        metavar="WORDS",
        help="How poses are written: wxyz, mm, inverse, body; several: wxyz,mm. Default: xyzw, m, optical.",
        rich_help_panel=INPUT,
        show_default=False,
    ),
]
DepthTopicOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--depth-topic",
        metavar="TOPIC",
        help="Depth images, if there are several. 'stairmap inspect BAG' lists all topics.",
        rich_help_panel=BAG,
        show_default=False,
    ),
]
CameraInfoTopicOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--camera-info-topic",
        metavar="TOPIC",
        help="Their CameraInfo. Default: the one beside the depth topic.",
        rich_help_panel=BAG,
        show_default=False,
    ),
]
CameraOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--camera",
        metavar="FILE",
        help="camera.json with the intrinsics, for a bag without CameraInfo.",
        rich_help_panel=BAG,
        show_default=False,
    ),
]
CloudTopicOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--cloud-topic",
        metavar="TOPIC",
        help="Sweeps of a LiDAR (PointCloud2, Livox CustomMsg) or a GridMap, instead of depth images.",
        rich_help_panel=BAG,
        show_default=False,
    ),
]
PoseTopicOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--pose-topic",
        metavar="TOPIC",
        help="Poses: transforms, Odometry or PoseStamped. Default: /tf, else the only odometry or pose.",
        rich_help_panel=BAG,
        show_default=False,
    ),
]
MapFrameOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--map-frame",
        metavar="NAME",
        help="Coordinate frame of the results. Default: map, else odom, else the root.",
        rich_help_panel=BAG,
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
    pose_format: str | None = None,
    method: Method,
    config: Path | None,
    overrides: list[str] | None,
    bag: BagOptions,
) -> MethodRequest:
    """Return what the options that ``run``, ``detect`` and ``inspect`` share ask for."""
    return MethodRequest(
        recording=recording,
        trajectory=trajectory,
        up=None if up is None else up.value,
        pose_format=pose_format,
        method=method.value,
        config_file=config,
        overrides=tuple(overrides or ()),
        bag=bag,
    )


def check_ending(path: Path | None, ending: str, *, option: str) -> None:
    """Refuse a file that would be written over one of another kind, such as notes.txt."""
    if path is not None and path.suffix.lower() != ending:
        raise typer.BadParameter(f"{option}: expected a name that ends in {ending}, got '{path}'")


def parse_map(text: str) -> tuple[int, Path]:
    """Return level and file of ``--map LEVEL=FILE``."""
    level, separator, path = text.partition("=")
    try:
        number = int(level)
    except ValueError:
        separator = ""
    if not separator or not path:
        raise typer.BadParameter(f"--map: expected LEVEL=FILE such as 0=ground.yaml, got {text!r}")
    return number, Path(path)


def check_finite(value: float | None) -> float | None:
    """Refuse NaN and infinity, which compare with no limit; for ``callback`` of a number's option."""
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"expected a number, got {value}")
    return value
