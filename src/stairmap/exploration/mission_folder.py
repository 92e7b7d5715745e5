"""The run folder of a mission: what grows while it goes on, and what is written at its end.

Beside what ``stairmap run`` writes: ``decisions.jsonl``, ``exploration.json``, ``coverage.csv``, a Nav2 map
for each level, and the robot's own recording (``recording/``, without the looks at full resolution).
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Any

from stairmap.arrays import Transform
from stairmap.detection.observation import Detection
from stairmap.errors import MissingPackageError, OutputError, ResultsError
from stairmap.exploration.mission import INTERRUPTED_REASON
from stairmap.exploration.mission_state import STATE_FILE, SavedMission, bytes_from_mission, restore_mission
from stairmap.exploration.outcome import ExplorationOutcome
from stairmap.exploration.report import render_mission_report
from stairmap.exploration.simulated_exploration import SimulatedExploration
from stairmap.exploration.simulated_robot import View
from stairmap.export.results import (
    DETECTIONS_FILE,
    REPORT_FILE,
    STAIRWAYS_FILE,
    SUMMARY_FILE,
    SURFACE_FILE,
    TRAJECTORY_FILE,
    RunFolder,
    null_for_nan,
)
from stairmap.export.summary import format_summary
from stairmap.input_files import parse_json, read_lines
from stairmap.navigation.occupancy import MapError, dump_map
from stairmap.output_files import keep_lines
from stairmap.recordings.image_folder_writer import ImageFolderWriter
from stairmap.simulation.recording import DEPTH_SCALE

EXPLORATION_FILE = "exploration.json"
DECISIONS_FILE = "decisions.jsonl"
COVERAGE_FILE = "coverage.csv"
RECORDING_FOLDER = "recording"
MAPS_FOLDER = "maps"

MAX_SAVING_SHARE = 0.05
"""A mission spends at most this part of its time on being saved before decisions."""


class MissionFolder:
    """Writes what a mission leaves behind.

    Parameters
    ----------
    folder
        An empty run folder, or that of the saved mission.
    exploration
        The mission, before it begins.
    identity
        What it must have in common with a mission that is resumed (``mission_state.identity_of``).
    saved
        The mission to go on from: what the folder holds beyond it is removed.

    Raises
    ------
    ResultsError
        If the saved mission is damaged; the folder stays as it was.
    OutputError
        If the recording cannot be written.
    """

    def __init__(
        self,
        folder: RunFolder,
        exploration: SimulatedExploration,
        identity: Mapping[str, Any],
        saved: SavedMission | None = None,
    ) -> None:
        self._folder, self._exploration, self._identity = folder, exploration, identity
        self._camera = exploration.robot.sensor.camera
        self._free_from = -math.inf
        if saved is not None:
            restore_mission(exploration, saved, _entries(folder.path / DECISIONS_FILE, saved.num_entries))
            self._go_back(saved)
        self._recording: ImageFolderWriter | None = None
        if saved is None or saved.num_recorded is not None:
            self._recording = ImageFolderWriter(
                folder.path / RECORDING_FOLDER,
                self._camera,
                depth_scale=DEPTH_SCALE,
                num_kept=None if saved is None else saved.num_recorded,
            )
        folder.write_config(exploration.known.session.config)
        exploration.log.write = self._note
        exploration.known.on_frame = self._add_frame
        exploration.mission.on_rest = self._save
        if saved is not None:
            exploration.mission.note("resumed")

    def close(self, outcome: ExplorationOutcome, *, with_report: bool) -> list[str]:
        """Write the results, most valuable first; return what could not be made, a sentence each."""
        folder, known = self._folder, self._exploration.known
        folder.release_reserve()
        self._close_recording()
        if self._exploration.mission.stopped != INTERRUPTED_REASON:
            folder.remove(STATE_FILE)
        folder.write_text(EXPLORATION_FILE, json.dumps(null_for_nan(outcome.to_dict()), indent=1) + "\n")
        stairways = known.session.stairways()
        num_frames = known.session.num_frames
        folder.write_stairways(stairways, num_frames=num_frames)
        if num_frames:
            folder.write_trajectory(known.session.trajectory())
        lines = ["time_s,area_m2,level", *(f"{t:.2f},{a:.3f},{n}" for t, a, n in outcome.coverage)]
        folder.write_text(COVERAGE_FILE, "\n".join(lines) + "\n")
        folder.write_summary(
            format_summary(
                stairways, num_frames=num_frames, num_detections=known.num_detections,
                reasons=(), problems=folder.failures,
            )
        )  # fmt: skip
        folder.write_mesh(stairways)
        notes = self._write_maps()
        if with_report:
            try:
                folder.write_report(render_mission_report(self._exploration, outcome))
            except MissingPackageError as error:
                notes.append(f"report.html was left out: {error}")
        return notes

    def _save(self, is_last: bool) -> None:
        """Save the mission, unless that was done just now and it goes on."""
        begun = time.monotonic()
        if not is_last and begun < self._free_from:
            return
        num_recorded = None if self._recording is None else self._recording.num_frames
        content = bytes_from_mission(self._exploration, self._identity, num_recorded=num_recorded)
        self._folder.write_bytes(STATE_FILE, content)
        self._free_from = begun + (time.monotonic() - begun) / MAX_SAVING_SHARE

    def _go_back(self, saved: SavedMission) -> None:
        """Remove the results, and what the logs hold beyond the saved mission."""
        path = self._folder.path
        for name in (
            EXPLORATION_FILE,
            COVERAGE_FILE,
            STAIRWAYS_FILE,
            SUMMARY_FILE,
            SURFACE_FILE,
            REPORT_FILE,
        ):
            self._folder.remove(name)
        self._folder.remove(MAPS_FOLDER)
        keep_lines(path / DECISIONS_FILE, saved.num_entries)
        keep_lines(path / DETECTIONS_FILE, saved.num_frames)
        keep_lines(path / TRAJECTORY_FILE, saved.num_frames + 1)

    def _note(self, entry: dict[str, Any]) -> None:
        self._folder.append_json(DECISIONS_FILE, entry)

    def _add_frame(self, view: View, map_from_camera: Transform, detection: Detection) -> None:
        self._folder.append_detection(detection)
        self._folder.append_pose(view.frame.stamp_ns, map_from_camera)
        if self._recording is None or view.frame.camera != self._camera:
            return
        try:
            self._recording.write(view.frame, map_from_camera)
        except OutputError as error:
            # The mission is worth more than its film.
            self._close_recording()
            self._folder.on_failure(f"{error}; the recording ends here, the mission goes on")

    def _close_recording(self) -> None:
        if self._recording is not None:
            self._recording.close()
            self._recording = None

    def _write_maps(self) -> list[str]:
        notes = []
        for level in self._exploration.known.levels.levels:
            grid = level.map.grid()
            if math.prod(grid.cells.shape) < 2:
                continue
            try:
                dump_map(grid, self._folder.path / MAPS_FOLDER, f"level_{level.number}")
            except (MapError, OutputError) as error:
                notes.append(str(error))
        return notes


def _entries(path: Path, num: int) -> list[dict[str, Any]]:
    """Return the first entries of a log of decisions.

    Raises
    ------
    ResultsError
        If it cannot be read, or has fewer.
    """
    try:
        lines = islice(read_lines(path, error_type=ResultsError), num)
        entries = [parse_json(line) for line, _ in lines]
    except ValueError as error:
        raise ResultsError(f"cannot go on from {path}: {error}; begin anew") from error
    if len(entries) != num:
        raise ResultsError(f"{path} has {len(entries)} entries, the saved mission {num}; begin anew")
    return entries
