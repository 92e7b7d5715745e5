"""Look at one input as ``stairmap run`` does, into a run folder: the one seam between batches and inputs.

A new kind of input gets its branch in ``look_at_input``; nothing else in this package knows of kinds.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from stairmap.batch.cloud_task import look_at_cloud, look_at_sweeps
from stairmap.batch.inputs import is_cloud
from stairmap.batch.job import BatchSettings
from stairmap.batch.look import Look, finish_look
from stairmap.config import Config, load_config
from stairmap.detection.observation import Detection
from stairmap.export.recording_reference import RECORDING_FILE, RecordingReference
from stairmap.export.results import RunFolder, create_run_folder
from stairmap.frame import DepthFrame
from stairmap.input_files import parse_yaml
from stairmap.map_levelling import find_level_map
from stairmap.pipeline import Detector
from stairmap.recording_run import RecordingRun
from stairmap.recordings.base import Recording
from stairmap.recordings.identity import identify_recording
from stairmap.recordings.odometry import OdometryRecording, config_with_drift, open_without_poses
from stairmap.recordings.open import has_only_sweeps, open_recording

Detections = Mapping[int, Detection]
"""Detections that were made before, by the stamps of their frames, nanoseconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenedRecording:
    """A recording and how it is looked at."""

    recording: Recording
    up: str | None
    config: Config


def look_at_input(
    path: Path, settings: BatchSettings, output: Path, *, max_frames: int = 0, known: Detections | None = None
) -> Look:
    """Look at one input and write its run folder.

    Parameters
    ----------
    path
        A recording or a point cloud on this machine.
    settings
        How to look at it.
    output
        Its run folder, new.
    max_frames
        A recording with more than one and a half times as many frames is not looked at, but told to be too
        long; 0: none is.
    known
        What was found in its frames already, see ``detect_piece``.

    Raises
    ------
    StairmapError
        If the input cannot be used, or the folder not be written.
    """
    if is_cloud(str(path)):
        return look_at_cloud(path, settings, config_of(settings), output)
    bag = settings.bag
    if bag.cloud_topic is not None or (bag.depth_topic is None and has_only_sweeps(path)):
        return look_at_sweeps(path, settings, config_of(settings), output)
    opened = open_for_batch(path, settings)
    num_frames = opened.recording.num_frames
    if max_frames and num_frames > 1.5 * max_frames and not settings.with_odometry:
        return Look(num_to_split=num_frames)
    return _look_at_recording(path, opened, settings, output, known)


def open_for_batch(path: Path, settings: BatchSettings) -> OpenedRecording:
    """Open a recording as the settings say.

    Raises
    ------
    StairmapError
        If it cannot be opened.
    """
    config = config_of(settings)
    if settings.with_odometry:
        recording = OdometryRecording(open_without_poses(path, bag=settings.bag), up=settings.up)
        return OpenedRecording(
            recording=recording, up=recording.up, config=config_with_drift(config, recording.odometry)
        )
    opened = open_recording(path, up=settings.up, pose_format=settings.pose_format, bag=settings.bag)
    return OpenedRecording(recording=opened, up=settings.up, config=config)


def config_of(settings: BatchSettings) -> Config:
    """Return the configuration of a batch."""
    return Config.model_validate(parse_yaml(settings.config_yaml)) if settings.config_yaml else load_config()


class RememberingDetector:
    """Answers with detections that were made before; frames that are not among them are looked at.

    Parameters
    ----------
    detector
        Looks at the others, and at frames that pictures are made of.
    known
        The detections.
    """

    def __init__(self, detector: Detector, known: Detections) -> None:
        self._detector, self._known = detector, known

    def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
        """Return the observations of one frame, or the reasons why there are none."""
        known = None if trace else self._known.get(frame.stamp_ns)
        return self._detector.detect(frame, trace=trace) if known is None else known


def _look_at_recording(
    path: Path, opened: OpenedRecording, settings: BatchSettings, output: Path, known: Detections | None
) -> Look:
    recording, config = opened.recording, opened.config
    level_map = find_level_map(recording, opened.up, max_depth=config.detection.max_depth)
    # Nothing is read ahead: each process has one core, and the next core has a process of its own.
    run = RecordingRun(recording, level_map, config=config, method=settings.method, num_ahead=0)
    if known is not None:
        run.session.detector = RememberingDetector(run.session.detector, known)
    with create_run_folder(output, recording.name) as folder:
        folder.log(f"stairmap {settings.version} batch, method {settings.method}")
        _write_reference(path, recording, settings, folder)
        run.process_frames(folder)
        return finish_look(run, folder, with_report=settings.with_reports)


def _write_reference(path: Path, recording: Recording, settings: BatchSettings, folder: RunFolder) -> None:
    reference = RecordingReference.from_arguments(
        path,
        up=settings.up,
        pose_format=settings.pose_format,
        bag=settings.bag,
        identity=identify_recording(recording),
        with_odometry=settings.with_odometry,
    )
    folder.write_text(RECORDING_FILE, reference.to_json())


def remove_folder(folder: Path) -> None:
    """Remove what a look left that did not come to its end."""
    shutil.rmtree(folder, ignore_errors=True)
