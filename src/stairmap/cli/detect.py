"""``stairmap detect``: each frame by itself."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import typer

import stairmap
from stairmap.cli.exits import warn
from stairmap.cli.interrupts import Interrupt, noted_interrupts
from stairmap.cli.opening import open_requested
from stairmap.cli.plain_table import format_columns
from stairmap.cli.progress import FrameProgress
from stairmap.cli.requests import DetectRequest
from stairmap.config import load_config
from stairmap.detection.observation import Detection
from stairmap.errors import RecordingError
from stairmap.export.recording_reference import RECORDING_FILE, RecordingReference
from stairmap.export.results import RunFolder, create_run_folder, null_for_nan
from stairmap.export.summary import counted
from stairmap.pipeline import Detector, make_detector
from stairmap.recordings.base import Recording
from stairmap.recordings.frame_iterators import numbered_frames
from stairmap.recordings.identity import identify_recording
from stairmap.visualization.collecting import ReportCollector, RuleStatistics
from stairmap.visualization.overlay_writer import OverlayWriter

MAX_FRAMES_LISTED = 10
"""Recordings of at most this many frames are listed frame by frame."""


def detect_recording(request: DetectRequest) -> int:
    """Look at each frame by itself, write what it shows, print a summary; return the exit code.

    Raises
    ------
    StairmapError
        If the recording or the output folder cannot be used.
    """
    given = request.input
    config = load_config(given.config_file, given.overrides)
    recording = open_requested(given)
    loop = _DetectLoop(recording, make_detector(config, method=given.method))
    with create_run_folder(request.output, recording.name) as folder, noted_interrupts() as interrupt:
        folder.on_failure = warn
        folder.log(f"stairmap {stairmap.__version__} detect {given.recording} --method {given.method}")
        reference = RecordingReference.from_arguments(
            given.recording,
            trajectory=given.trajectory,
            up=given.up,
            pose_format=given.pose_format,
            bag=given.bag,
            identity=identify_recording(recording),
        )
        folder.write_text(RECORDING_FILE, reference.to_json())
        folder.write_config(config)
        loop.process_frames(folder, interrupt, with_overlays=request.with_overlays)
        folder.release_reserve()
        collector = loop.collector
        problems = list(recording.problems.to_lines())
        problems += [str(loop.failure)] if loop.failure is not None else []
        if interrupt:
            problems.append(f"interrupted after {counted(collector.num_frames, 'frame')}")
        text = _format_text(collector, loop.listed if recording.num_frames <= MAX_FRAMES_LISTED else [])
        folder.write_summary("\n".join([text, *problems, ""]))
        for line in problems:
            folder.log(line)
            typer.echo(line, err=True)
        if request.as_json:
            typer.echo(_format_json(folder, collector, problems, interrupt))
        else:
            typer.echo(f"{text}\n{folder.path}")
        if loop.failure is not None:
            raise loop.failure
        return interrupt.exit_code


class _DetectLoop:
    """Looks at the frames one by one and remembers what the summary tells."""

    def __init__(self, recording: Recording, detector: Detector) -> None:
        self._num_frames = recording.num_frames
        self._frames = numbered_frames(recording)
        self._detector = detector
        self.collector = ReportCollector()
        self.listed: list[tuple[int, Detection]] = []
        self.failure: RecordingError | None = None

    def process_frames(self, folder: RunFolder, interrupt: Interrupt, *, with_overlays: bool) -> None:
        try:
            self._process_frames(folder, interrupt, with_overlays)
        except (RecordingError, OSError) as error:
            if not self.collector.num_frames:
                raise
            read = counted(self.collector.num_frames, "frame")
            self.failure = RecordingError(f"the recording could not be read beyond {read}: {error}")

    def _process_frames(self, folder: RunFolder, interrupt: Interrupt, with_overlays: bool) -> None:
        with (
            FrameProgress(self._num_frames) as progress,
            OverlayWriter(folder.write_overlay) as overlays,
        ):
            for number, frame in self._frames:
                if interrupt:
                    return
                detection = self._detector.detect(frame)
                self.collector.add(frame, detection)
                folder.append_detection(detection)
                if with_overlays:
                    overlays.add(number, frame, detection)
                if len(self.listed) < MAX_FRAMES_LISTED:
                    self.listed.append((number, detection))
                progress.advance(f"detected in {self.collector.num_detections}")


def _format_text(collector: ReportCollector, listed: Sequence[tuple[int, Detection]]) -> str:
    rate = 100 * collector.num_detections / max(collector.num_frames, 1)
    lines = [
        f"{counted(collector.num_frames, 'frame')}, "
        f"stair edges detected in {collector.num_detections} ({rate:.1f} %)",
        "",
    ]
    if listed:
        lines += [_format_frames(listed), ""]
    rules = collector.rule_statistics()
    if rules:
        lines += [_format_rules(rules), ""]
    return "\n".join(lines)


def _format_frames(listed: Sequence[tuple[int, Detection]]) -> str:
    header = ("frame", "view", "steps", "rise mm", "run mm", "width mm", "pitch deg", "reason against")
    rows = []
    for number, detection in listed:
        for observation in detection.observations:
            measures = (observation.rise, observation.run, observation.width)
            rows.append(
                (
                    str(number),
                    observation.view,
                    str(observation.num_steps),
                    *(f"{value * 1e3:.0f}" for value in measures),
                    f"{np.degrees(observation.pitch):.1f}",
                    "",
                )
            )
        if not detection:
            reason = str(detection.rejections[0]) if detection.rejections else ""
            rows.append((str(number), *("-",) * 6, reason))
    return format_columns(header, rows, left_aligned=("view", "reason against"))


def _format_rules(rules: Sequence[RuleStatistics]) -> str:
    header = ("frames", "rule against", "measured, median", "limit", "unit")
    rows = [
        (
            str(rule.num_frames),
            rule.rule,
            "nothing" if np.isnan(rule.measured) else f"{rule.measured:.4g}",
            f"{rule.limit:.4g}",
            rule.unit,
        )
        for rule in rules
    ]
    return format_columns(header, rows, left_aligned=("rule against", "unit"))


def _format_json(
    folder: RunFolder, collector: ReportCollector, problems: Sequence[str], interrupt: Interrupt
) -> str:
    values = {
        "output": str(folder.path),
        "interrupted": bool(interrupt),
        "num_frames": collector.num_frames,
        "num_detections": collector.num_detections,
        "rules": [
            {
                "rule": rule.rule,
                "num_frames": rule.num_frames,
                "measured": rule.measured,
                "limit": rule.limit,
                "unit": rule.unit,
            }
            for rule in collector.rule_statistics()
        ],
        "problems": list(problems),
    }
    return json.dumps(null_for_nan(values), indent=1, allow_nan=False)
