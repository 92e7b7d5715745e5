"""One method over one recording: frames through the pipeline, what comes of it into a run folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.cli.interrupts import Interrupt
from stairmap.cli.numbered_frames import numbered_frames
from stairmap.cli.progress import FrameProgress, counted
from stairmap.config import Config, dump_config
from stairmap.errors import MissingPackageError
from stairmap.export.history import HISTORY_FILE, history_values
from stairmap.export.results import RunFolder
from stairmap.export.summary import format_summary
from stairmap.pipeline import StairwayPipeline
from stairmap.recordings.base import Recording
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap.visualization.collecting import ReportCollector
from stairmap.visualization.frame_view import frame_view_from_detection
from stairmap.visualization.report import render_report, report_data
from stairmap.visualization.run_replay import RunView

FindReferences = Callable[[Sequence[Stairway]], Mapping[int, Mapping[str, float]]]
"""Gives the true measures of stairways by their id, where they are known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOutcome:
    """What came of a run.

    Attributes
    ----------
    stairways
        The stairways found.
    num_frames, num_detections, num_without_pose
        Frames looked at, those with stair edges, and those left out because they have no pose.
    reasons
        Why frames had no stair edges, most frequent first.
    """

    stairways: tuple[Stairway, ...]
    num_frames: int
    num_detections: int
    num_without_pose: int
    reasons: tuple[str, ...]


class RunLoop:
    """Runs one method over one recording.

    Parameters
    ----------
    recording
        Where frames come from; it has been found to have poses.
    trajectory
        Poses in a level map.
    config, method
        See ``StairwayPipeline``.

    Raises
    ------
    RecordingError
        If no image can be read.
    """

    def __init__(self, recording: Recording, trajectory: Trajectory, *, config: Config, method: str) -> None:
        self._recording, self._trajectory = recording, trajectory
        self._config, self._method = config, method
        self._pipeline = StairwayPipeline(config, method=method)
        self._collector = ReportCollector()
        self._num_without_pose = 0
        self._frames = numbered_frames(recording)
        self._last_frame = (0, 0)

    def process_frames(
        self, folder: RunFolder | None, interrupt: Interrupt, *, view: RunView | None = None
    ) -> None:
        """Look at frames until they end or an interrupt comes.

        Parameters
        ----------
        folder
            Where to write ``detections.jsonl`` and ``history.jsonl`` meanwhile.
        interrupt
            Ends the loop when it becomes true.
        view
            Where to show the run meanwhile.
        """
        num_stairways = 0
        with FrameProgress(self._recording.num_frames) as progress:
            for number, frame in self._frames:
                if interrupt:
                    return
                if not self._trajectory.has_pose(np.array([frame.stamp_ns]))[0]:
                    self._num_without_pose += 1
                    progress.advance(counted(num_stairways, "stairway"))
                    continue
                map_from_camera = self._trajectory.pose_at(frame.stamp_ns)
                detection = self._pipeline.process(frame, map_from_camera)
                self._collector.add(frame, detection, map_from_camera)
                if folder is not None:
                    folder.append_detection(detection)
                if view is not None:
                    view.show_frame(frame_view_from_detection(number, frame, map_from_camera, detection))
                self._last_frame = (number, frame.stamp_ns)
                if self._collector.convergence.is_due(self._collector.num_observations):
                    stairways = self._pipeline.stairways()
                    self._collector.convergence.add(stairways, self._collector.num_observations)
                    if folder is not None and stairways:
                        folder.append_json(HISTORY_FILE, history_values(frame.stamp_ns, stairways))
                    if view is not None:
                        view.show_stairways(stairways, number, frame.stamp_ns)
                    num_stairways = len(stairways)
                progress.advance(counted(num_stairways, "stairway"))

    def outcome(self) -> RunOutcome:
        """Return what came of the frames so far."""
        stairways = self._pipeline.stairways()
        reasons = [str(rule) for rule in self._collector.rule_statistics()]
        if self._collector.num_detections and not stairways:
            reasons.insert(0, self._describe_unconfirmed())
        return RunOutcome(
            stairways=stairways,
            num_frames=self._collector.num_frames,
            num_detections=self._collector.num_detections,
            num_without_pose=self._num_without_pose,
            reasons=tuple(reasons),
        )

    def show_outcome(self, view: RunView, outcome: RunOutcome) -> None:
        """Show what came of the frames so far, after the last of them, and close the view."""
        number, stamp_ns = self._last_frame
        view.show_stairways(outcome.stairways, number, stamp_ns)
        view.close()

    def _describe_unconfirmed(self) -> str:
        """Say why frames with stair edges made no stairway."""
        seen = f"{counted(self._collector.num_detections, 'frame')} with stair edges made no stairway: "
        rejection = getattr(self._pipeline.modeler, "rejection", None)
        if rejection is not None:
            return f"{seen}{rejection}"
        names = {"stairmap": "modeling.min_observations", "delmerico2013": "delmerico2013.detections_per_fit"}
        section, key = names[self._method].split(".")
        limit = getattr(getattr(self._config, section), key)
        return f"{seen}it takes {limit} observations that agree in the map ({section}.{key})"

    def write_results(self, folder: RunFolder, outcome: RunOutcome, problems: Sequence[str]) -> None:
        """Write everything but the report, the result itself first."""
        folder.write_stairways(
            outcome.stairways, num_frames=outcome.num_frames, frame_id=self._recording.frame_id
        )
        if outcome.num_frames:
            folder.write_trajectory(self._pipeline.trajectory())
        folder.write_config(self._config)
        folder.write_mesh(outcome.stairways)
        folder.write_summary(
            format_summary(
                outcome.stairways,
                num_frames=outcome.num_frames,
                num_detections=outcome.num_detections,
                reasons=outcome.reasons,
                problems=problems,
            )
        )

    def write_report(
        self,
        folder: RunFolder,
        outcome: RunOutcome,
        problems: Sequence[str],
        *,
        find_references: FindReferences | None = None,
    ) -> str | None:
        """Write ``report.html``; return a sentence instead if a package for it is missing."""
        data = report_data(
            self._collector,
            recording_name=self._recording.name,
            method=self._method,
            stairways=outcome.stairways,
            trajectory=self._pipeline.trajectory() if outcome.num_frames else None,
            config_yaml=dump_config(self._config),
            problems=problems,
            references=None if find_references is None else find_references(outcome.stairways),
            detector=self._pipeline.detector,
        )
        try:
            folder.write_report(render_report(data))
        except MissingPackageError as error:
            return f"report.html was left out: {error}"
        return None
