"""Options of ``stairmap batch``."""

from __future__ import annotations

from typing import Annotated

import typer

from stairmap.cli.options import (
    OUTPUT,
    CameraInfoTopicOption,
    CameraOption,
    CloudTopicOption,
    ConfigOption,
    DebugOption,
    DepthTopicOption,
    JsonOption,
    MapFrameOption,
    Method,
    MethodOption,
    OdometryOption,
    PoseFormatOption,
    PoseTopicOption,
    SetOption,
    UpOption,
)
from stairmap.cli.requests import BatchRequest
from stairmap.recordings.bag_options import BagOptions

_WORKERS = "Workers"


def batch(
    *,
    recordings: Annotated[
        list[str],
        typer.Argument(
            metavar="RECORDING...",
            help="Recordings, folders of them, globs, addresses (s3://...), @FILE for a list, one a line.",
            show_default=False,
        ),
    ],
    output: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Folder or address for run folders and tables; one with a batch goes on.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ],
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers",
            min=0,
            max=1024,
            metavar="N",
            help="Processes on this machine, a core each. Default: all cores. 0: one, without dask.",
            rich_help_panel=_WORKERS,
            show_default=False,
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS",
            help="A dask scheduler instead, such as tcp://10.0.0.1:8786 (docs/fleets.md).",
            rich_help_panel=_WORKERS,
            show_default=False,
        ),
    ] = None,
    memory_limit: Annotated[
        str,
        typer.Option(
            "--memory-limit",
            metavar="SIZE",
            help="Memory of each process on this machine, such as 4GiB. auto: an equal share.",
            rich_help_panel=_WORKERS,
        ),
    ] = "auto",
    robots: Annotated[
        list[str] | None,
        typer.Option(
            "--robot",
            metavar="NAME|FILE",
            help="A column with the verdict of this robot; may be repeated. 'stairmap check --list'.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    reports: Annotated[
        bool,
        typer.Option(
            "--reports",
            help="A report.html in each run folder; a second or two more.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    odometry: OdometryOption = False,
    up: UpOption = None,
    pose_format: PoseFormatOption = None,
    depth_topic: DepthTopicOption = None,
    camera_info_topic: CameraInfoTopicOption = None,
    camera: CameraOption = None,
    cloud_topic: CloudTopicOption = None,
    pose_topic: PoseTopicOption = None,
    map_frame: MapFrameOption = None,
    method: MethodOption = Method.stairmap,
    config: ConfigOption = None,
    overrides: SetOption = None,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Find the stairways of many recordings: a run folder for each, and one table of all results.

    \b
    Examples:
      stairmap batch recordings/ -o fleet --robot spot
      stairmap batch 'monday/*.mcap' @tuesday.txt -o fleet --workers 4
      stairmap batch s3://site/2026-11/ -o s3://site/stairs --scheduler tcp://10.0.0.1:8786

    Called again it does what is missing. A recording that fails is a row that says why.
    """
    from stairmap.cli.batch import run_batch  # noqa: PLC0415

    if workers is not None and scheduler is not None:
        raise typer.BadParameter(
            "--workers and --scheduler exclude each other: a cluster has its own workers"
        )
    request = BatchRequest(
        recordings=tuple(recordings),
        output=output,
        num_workers=workers,
        scheduler=scheduler,
        memory_limit=memory_limit,
        robots=tuple(robots or ()),
        with_reports=reports,
        with_odometry=odometry,
        up=None if up is None else up.value,
        pose_format=pose_format,
        bag=BagOptions(
            depth_topic=depth_topic,
            camera_info_topic=camera_info_topic,
            camera_file=None if camera is None else camera.absolute(),
            pose_topic=pose_topic,
            map_frame=map_frame,
            cloud_topic=cloud_topic,
        ),
        method=method.value,
        config_file=config,
        overrides=tuple(overrides or ()),
        as_json=as_json,
    )
    raise typer.Exit(run_batch(request))
