"""The run folder of a mission: what grows while it goes on, and what is written at its end.

Beside what ``stairmap run`` writes: ``decisions.jsonl``, ``exploration.json``, ``coverage.csv``, a Nav2 map
for each level, and the robot's own recording (``recording/``, without the looks at full resolution).
"""

from __future__ import annotations

import json
import math
from typing import Any

from stairmap.arrays import Transform
from stairmap.detection.observation import Detection
from stairmap.errors import MissingPackageError, OutputError
from stairmap.exploration.outcome import ExplorationOutcome
from stairmap.exploration.report import render_mission_report
from stairmap.exploration.simulated_exploration import SimulatedExploration
from stairmap.exploration.simulated_robot import View
from stairmap.export.results import RunFolder, null_for_nan
from stairmap.export.summary import format_summary
from stairmap.navigation.occupancy import MapError, dump_map
from stairmap.recordings.image_folder_writer import ImageFolderWriter
from stairmap.simulation.recording import DEPTH_SCALE

EXPLORATION_FILE = "exploration.json"
DECISIONS_FILE = "decisions.jsonl"
COVERAGE_FILE = "coverage.csv"
RECORDING_FOLDER = "recording"


class MissionFolder:
    """Writes what a mission leaves behind.

    Parameters
    ----------
    folder
        An empty run folder.
    exploration
        The mission, before it begins.
    """

    def __init__(self, folder: RunFolder, exploration: SimulatedExploration) -> None:
        self._folder, self._exploration = folder, exploration
        self._camera = exploration.robot.sensor.camera
        self._recording: ImageFolderWriter | None = ImageFolderWriter(
            folder.path / RECORDING_FOLDER, self._camera, depth_scale=DEPTH_SCALE
        )
        folder.write_config(exploration.known.session.config)
        exploration.log.write = self._note
        exploration.known.on_frame = self._add_frame

    def close(self, outcome: ExplorationOutcome, *, with_report: bool) -> list[str]:
        """Write the results, most valuable first; return what could not be made, a sentence each."""
        folder, known = self._folder, self._exploration.known
        folder.release_reserve()
        self._close_recording()
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
                dump_map(grid, self._folder.path / "maps", f"level_{level.number}")
            except (MapError, OutputError) as error:
                notes.append(str(error))
        return notes
