"""Options of ``stairmap run``."""

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
    OutputOption,
    PoseFormatOption,
    PoseTopicOption,
    RecordingArgument,
    SetOption,
    TrajectoryOption,
    UpOption,
    method_request,
)
from stairmap.cli.requests import RunRequest
from stairmap.recordings.bag_options import BagOptions


def run(
    *,
    recording: RecordingArgument,
    trajectory: TrajectoryOption = None,
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
    robots: Annotated[
        list[str] | None,
        typer.Option(
            "--robot",
            metavar="NAME|FILE",
            help="Also check if this robot can climb them; may be repeated. Names: 'stairmap check --list'.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    output: OutputOption = None,
    no_report: Annotated[
        bool, typer.Option("--no-report", help="Write no report.html.", rich_help_panel=OUTPUT)
    ] = False,
    view: Annotated[
        bool,
        typer.Option("--view", help="Watch the run in the rerun viewer (a window).", rich_help_panel=OUTPUT),
    ] = False,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Find the stairways of a recording and place them in the map.

    \b
    Examples:
      stairmap run my_recording --robot spot
      stairmap run my_recording --trajectory slam.tum --up=-y -o results/hall
      stairmap run without_poses --odometry
      stairmap run walk.mcap --cloud-topic /livox/lidar
      stairmap run my_recording --set envelope.max_rise=0.30 --json

    Ctrl-C writes what was found so far.
    """
    from stairmap.cli.run import run_recording  # noqa: PLC0415

    request = RunRequest(
        input=method_request(
            recording,
            trajectory,
            up,
            pose_format=pose_format,
            method=method,
            config=config,
            overrides=overrides,
            bag=BagOptions(
                depth_topic=depth_topic,
                camera_info_topic=camera_info_topic,
                camera_file=camera,
                pose_topic=pose_topic,
                map_frame=map_frame,
                cloud_topic=cloud_topic,
            ),
        ),
        output=output,
        with_report=not no_report,
        as_json=as_json,
        robots=tuple(robots or ()),
        with_view=view,
        with_odometry=odometry,
    )
    raise typer.Exit(run_recording(request))
