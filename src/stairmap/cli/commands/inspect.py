"""Options of ``stairmap inspect``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import (
    OUTPUT,
    CameraInfoTopicOption,
    CameraOption,
    ConfigOption,
    DebugOption,
    DepthTopicOption,
    JsonOption,
    MapFrameOption,
    Method,
    MethodOption,
    PoseFormatOption,
    PoseTopicOption,
    RecordingArgument,
    SetOption,
    TrajectoryOption,
    UpOption,
    check_ending,
    method_request,
)
from stairmap.cli.requests import InspectRequest
from stairmap.recordings.bag_options import BagOptions


def inspect(
    *,
    recording: RecordingArgument,
    trajectory: TrajectoryOption = None,
    up: UpOption = None,
    pose_format: PoseFormatOption = None,
    depth_topic: DepthTopicOption = None,
    camera_info_topic: CameraInfoTopicOption = None,
    camera: CameraOption = None,
    pose_topic: PoseTopicOption = None,
    map_frame: MapFrameOption = None,
    frame: Annotated[
        int | None,
        typer.Option(
            "--frame",
            metavar="N",
            help="Judge one frame, counted from 0, and tell all rules against a stairway.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    method: MethodOption = Method.stairmap,
    config: ConfigOption = None,
    overrides: SetOption = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="PNG that shows how the method came to its result in that frame (extra report).",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Show what a recording holds, or how one of its frames is judged.

    \b
    Examples:
      stairmap inspect my_recording
      stairmap inspect my_recording --frame 120 -o frame.png
    """
    from stairmap.cli.inspect import inspect_recording  # noqa: PLC0415

    if output is not None and frame is None:
        raise typer.BadParameter("--output draws one frame; say which with --frame N")
    check_ending(output, ".png", option="--output")
    request = InspectRequest(
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
            ),
        ),
        frame_number=frame,
        output=output,
        as_json=as_json,
    )
    raise typer.Exit(inspect_recording(request))
