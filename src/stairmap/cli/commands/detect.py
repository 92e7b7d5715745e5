"""Options of ``stairmap detect``."""

from __future__ import annotations

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
    OutputOption,
    PoseFormatOption,
    PoseTopicOption,
    RecordingArgument,
    SetOption,
    TrajectoryOption,
    UpOption,
    method_request,
)
from stairmap.cli.requests import DetectRequest
from stairmap.recordings.bag_options import BagOptions


def detect(
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
    method: MethodOption = Method.stairmap,
    config: ConfigOption = None,
    overrides: SetOption = None,
    output: OutputOption = None,
    no_overlays: Annotated[
        bool, typer.Option("--no-overlays", help="Draw no picture of each frame.", rich_help_panel=OUTPUT)
    ] = False,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Look for stairs in each frame by itself. Needs no poses; if there are any, they give the direction up.

    \b
    Examples:
      stairmap detect my_recording
      stairmap detect my_recording --up=auto -o results/hall
      stairmap detect my_recording --method delmerico2013 --no-overlays
    """
    from stairmap.cli.detect import detect_recording  # noqa: PLC0415

    request = DetectRequest(
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
        output=output,
        with_overlays=not no_overlays,
        as_json=as_json,
    )
    raise typer.Exit(detect_recording(request))
