"""``stairmap inspect``: what a recording holds, and how a method comes to its result in one frame."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import typer

from stairmap.cli.bag_listing import (
    describe_bag,
    describe_topics,
    find_topics,
    format_bag_rows,
    format_topics,
)
from stairmap.cli.interrupts import noted_interrupts
from stairmap.cli.opening import open_requested
from stairmap.cli.progress import FrameProgress
from stairmap.cli.requests import InspectRequest
from stairmap.config import load_config
from stairmap.detection.observation import Detection
from stairmap.errors import RecordingError, StairmapError
from stairmap.export.results import null_for_nan
from stairmap.frame import DepthFrame
from stairmap.input_files import shown
from stairmap.inspection import FrameStatistics, measure_frames
from stairmap.kernels import describe_kernels
from stairmap.output_files import check_new_file, write_whole
from stairmap.pipeline import make_detector
from stairmap.recordings.bags.recording import BagRecording
from stairmap.recordings.base import Recording
from stairmap.recordings.frame_iterators import numbered_frames
from stairmap.visualization.detection_steps import trace_png
from stairmap.visualization.overlay import describe_detection


def inspect_recording(request: InspectRequest) -> int:
    """Print what a recording, or one frame of it, holds; return the exit code.

    Raises
    ------
    StairmapError
        If the recording cannot be used, the frame is not there, or the picture cannot be written.
    """
    if request.output is not None:
        check_new_file(request.output, option="--output")
    recording = _open(request)
    if request.frame_number is not None:
        _inspect_frame(recording, request, request.frame_number)
        return 0
    max_depth = load_config(request.input.config_file, request.input.overrides).detection.max_depth
    with noted_interrupts() as interrupt:
        with FrameProgress(recording.num_frames) as progress:
            statistics = measure_frames(
                recording,
                max_depth=max_depth,
                knows_up=request.input.up == "auto",
                should_stop=lambda: bool(interrupt),
                on_frame=progress.advance,
            )
        values = _describe_recording(recording, statistics)
        if request.as_json:
            typer.echo(json.dumps(null_for_nan(values), indent=1, allow_nan=False))
        else:
            typer.echo(_format_text(values))
        return interrupt.exit_code


def _open(request: InspectRequest) -> Recording:
    """Open a recording; of a bag that cannot be used tell at least which topics it has."""
    given = request.input
    try:
        return open_requested(given)
    except StairmapError:
        topics = describe_topics(find_topics(given.recording))
        if topics and request.as_json:
            typer.echo(json.dumps({"bag": {"topics": topics}}, indent=1))
        elif topics:
            typer.echo(format_topics(topics))
        raise


def _describe_recording(recording: Recording, statistics: FrameStatistics) -> dict[str, Any]:
    camera, trajectory = recording.camera, recording.trajectory
    first_ns, last_ns = recording.time_range_ns
    return {
        "name": recording.name,
        "num_frames": recording.num_frames,
        "num_frames_read": statistics.num_read,
        "num_frames_all_invalid": statistics.num_all_invalid,
        "first_stamp_ns": first_ns,
        "duration_s": (last_ns - first_ns) * 1e-9,
        "camera": {
            "width": camera.width,
            "height": camera.height,
            "fx": camera.fx,
            "fy": camera.fy,
            "cx": camera.cx,
            "cy": camera.cy,
        },
        "valid_share": statistics.valid_share,
        "depth_m": [round(value, 3) for value in statistics.depth_quartiles.tolist()],
        "num_poses": 0 if trajectory is None else len(trajectory),
        "num_frames_without_pose": recording.problems.num_frames_without_pose,
        "num_up_from_pose": statistics.num_up_from_pose,
        "num_up_from_camera": statistics.num_up_from_camera,
        "num_up_from_floor": statistics.num_up_unknown,
        "kernels": describe_kernels(),
        "problems": [
            *filter(None, [statistics.pose_mistake, statistics.unit_mistake]),
            *recording.problems.to_lines(),
        ],
    } | ({"bag": describe_bag(recording)} if isinstance(recording, BagRecording) else {})


def _format_text(values: dict[str, Any]) -> str:
    camera, duration = values["camera"], values["duration_s"]
    rate = f", {(values['num_frames'] - 1) / duration:.1f} Hz" if duration > 0 else ""
    fields = np.degrees(
        [
            2 * np.arctan2(camera[size] / 2, camera[focal])
            for size, focal in (("width", "fx"), ("height", "fy"))
        ]
    )
    intrinsics = ", ".join(f"{key} {camera[key]:g}" for key in ("fx", "fy", "cx", "cy"))
    depth = "nothing measured"
    if not np.isnan(values["depth_m"][0]):
        smallest, lower, median, upper, largest = values["depth_m"]
        depth = f"{smallest:.2f} to {largest:.2f} m, quartiles {lower:.2f}, {median:.2f}, {upper:.2f} m"
    num_posed = values["num_frames"] - values["num_frames_without_pose"]
    poses = f"{values['num_poses']}; {num_posed} of {values['num_frames']} frames have one"
    sources = {
        "the poses (map z)": values["num_up_from_pose"],
        "camera.json": values["num_up_from_camera"],
        "the floor, frame by frame": values["num_up_from_floor"],
    }
    ups = ", ".join(f"{source} in {number}" for source, number in sources.items() if number)
    rows = {
        "recording": values["name"],
        "frames": f"{values['num_frames']}, {values['num_frames_read']} read, "
        f"{values['num_frames_all_invalid']} of these all invalid",
        "duration": f"{duration:.2f} s{rate}",
        "image": f"{camera['width']} x {camera['height']} px",
        "intrinsics": f"{intrinsics} px ({fields[0]:.0f} x {fields[1]:.0f} deg)",
        "depth": depth,
        "valid pixels": f"{100 * values['valid_share']:.1f} %",
        "poses": poses
        if values["num_poses"]
        else "none: pass --trajectory or --odometry, or use 'stairmap detect'",
        "up": f"from {ups}" if ups else "unknown",
        "kernels": values["kernels"],
    } | (format_bag_rows(values["bag"]) if "bag" in values else {})
    lines = [f"{name:<13} {shown(text)}" for name, text in rows.items()]
    if values["problems"]:
        lines += ["problems", *(f"  {line}" for line in values["problems"])]
    if "bag" in values:
        lines += ["", format_topics(values["bag"]["topics"])]
    return "\n".join(lines)


def _inspect_frame(recording: Recording, request: InspectRequest, number: int) -> None:
    given = request.input
    config = load_config(given.config_file, given.overrides)
    frame = _find_frame(recording, number)
    detector = make_detector(config, method=given.method)
    detection = detector.detect(frame, trace=True)
    if request.as_json:
        typer.echo(json.dumps(null_for_nan(detection.to_dict()), indent=1, allow_nan=False))
    else:
        typer.echo(f"frame {number} of {recording.name}, stamp {frame.stamp_ns} ns, method {given.method}")
        for line in _describe_detection(detection):
            typer.echo(line)
    if request.output is not None:
        write_whole(request.output, trace_png(frame, detection))
        if not request.as_json:
            typer.echo(str(request.output))


def _describe_detection(detection: Detection) -> list[str]:
    if detection:
        return describe_detection(detection)
    return ["no stairway; rules against it:", *(f"  {rejection}" for rejection in detection.rejections)]


def _find_frame(recording: Recording, number: int) -> DepthFrame:
    """Return the frame of this number, counted from 0 as ``numbered_frames`` does.

    Raises
    ------
    RecordingError
        If there is no such frame, or it cannot be read.
    """
    if not 0 <= number < recording.num_frames:
        raise RecordingError(
            f"expected a frame from 0 to {recording.num_frames - 1}, got {number}; {recording.name} has "
            f"{recording.num_frames}"
        )
    for found, frame in numbered_frames(recording):
        if found == number:
            return frame
        if found > number:
            break
    reason = recording.problems.skipped[-1].reason
    raise RecordingError(f"frame {number} cannot be read: {reason}")
