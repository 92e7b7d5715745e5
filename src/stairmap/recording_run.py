"""Run one method over one recording and write what comes of it into a run folder.

with create_run_folder(None, recording.name) as folder:
    run = RecordingRun(recording, find_level_map(recording), config=Config())
    run.process_frames(folder)
    run.write_results(folder, run.outcome())
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.config import Config, dump_config
from stairmap.drop import Drop
from stairmap.errors import MapFullError, MissingPackageError, RecordingError
from stairmap.export.history import HISTORY_FILE, history_values
from stairmap.export.results import CONFIG_FILE, RunFolder
from stairmap.export.summary import counted, format_summary
from stairmap.map_levelling import LevelMap
from stairmap.pipeline import DEFAULT_METHOD
from stairmap.pose_mistakes import PoseWatch
from stairmap.recordings.base import Recording
from stairmap.recordings.depth_unit_watch import DepthUnitWatch
from stairmap.recordings.frame_iterators import NUM_AHEAD, numbered_frames
from stairmap.session import MapSession
from stairmap.stairway import Stairway
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
    drops
        Where the ground ends and goes on lower.
    num_frames, num_detections, num_without_pose
        Frames looked at, those with stair edges, and those left out because they have no pose.
    reasons
        Why frames had no stair edges, most frequent first.
    problems
        What a user should know of the recording, its map and the run, a sentence each.
    was_stopped
        Whether the run was stopped before the last frame.
    """

    stairways: tuple[Stairway, ...]
    drops: tuple[Drop, ...]
    num_frames: int
    num_detections: int
    num_without_pose: int
    reasons: tuple[str, ...]
    problems: tuple[str, ...]
    was_stopped: bool


class RecordingRun:
    """Runs one method over one recording.

    Parameters
    ----------
    recording
        Where frames come from.
    level_map
        Its poses in a level map.
    config, method
        See ``MapSession``.
    num_ahead
        See ``numbered_frames``.

    Attributes
    ----------
    session
        What has been found so far.
    failure
        Why the recording could not be read to its end; ``None`` unless it could not. What was found before
        counts.

    Raises
    ------
    RecordingError
        If no image can be read.
    """

    def __init__(
        self,
        recording: Recording,
        level_map: LevelMap,
        *,
        config: Config,
        method: str = DEFAULT_METHOD,
        num_ahead: int = NUM_AHEAD,
    ) -> None:
        self._recording, self._level_map = recording, level_map
        self.session = MapSession(config, method=method)
        self._collector = ReportCollector()
        self._num_without_pose = 0
        self._frames = numbered_frames(recording, num_ahead=num_ahead)
        self._last_frame = (0, 0)
        self._was_stopped = False
        self._notes: tuple[str, ...] = ()
        self._num_known = 0
        self._pose_watch = PoseWatch(
            recording.num_frames,
            map_from_recorded=level_map.map_from_recorded,
            max_depth=config.detection.max_depth,
            knows_up=level_map.is_by_floor,
        )
        self._unit_watch = DepthUnitWatch()
        self.failure: RecordingError | None = None

    def process_frames(
        self,
        folder: RunFolder | None = None,
        *,
        should_stop: Callable[[], bool] = lambda: False,
        on_frame: Callable[[int], None] = lambda _: None,
        view: RunView | None = None,
    ) -> None:
        """Look at frames until they end, or until the map is full.

        Parameters
        ----------
        folder
            Where to write ``config.yaml`` at once and ``detections.jsonl``, ``history.jsonl`` and
            ``trajectory.tum`` meanwhile.
        should_stop
            Asked before each frame; the run ends there when it says so.
        on_frame
            Called after each frame with the number of stairways so far.
        view
            Where to show the run meanwhile.
        """
        if folder is not None:
            folder.write_config(self.session.config)
        try:
            self._process_frames(folder, should_stop, on_frame, view)
        except (RecordingError, OSError) as error:
            if not self._collector.num_frames:
                raise
            # A cable that was pulled, a disk that went away: it must not cost what was found before.
            self.failure = RecordingError(
                f"the recording could not be read beyond frame {self._last_frame[0]}: {error}"
            )
            self._notes = (str(self.failure),)

    def _process_frames(
        self,
        folder: RunFolder | None,
        should_stop: Callable[[], bool],
        on_frame: Callable[[int], None],
        view: RunView | None,
    ) -> None:
        trajectory = self._level_map.trajectory
        num_stairways = 0
        for number, frame in self._frames:
            if should_stop():
                self._was_stopped = True
                return
            if trajectory.has_pose(np.array([frame.stamp_ns]))[0]:
                map_from_camera = trajectory.pose_at(frame.stamp_ns)
                try:
                    detection = self.session.add(frame, map_from_camera)
                except MapFullError as error:
                    self._notes = (f"the run ended early: {error}",)
                    return
                self._collector.add(frame, detection, map_from_camera)
                self._pose_watch.add(frame, map_from_camera)
                self._unit_watch.add(frame.depth, frame.camera, frame.stamp_ns, map_from_camera)
                if folder is not None:
                    folder.append_detection(detection)
                    folder.append_pose(frame.stamp_ns, map_from_camera)
                if view is not None:
                    view.show_frame(frame_view_from_detection(number, frame, map_from_camera, detection))
                self._last_frame = (number, frame.stamp_ns)
                if self._collector.convergence.is_due(self._collector.num_observations):
                    num_stairways = self._note_stairways(folder, view)
            else:
                self._num_without_pose += 1
            on_frame(num_stairways)

    def _note_stairways(self, folder: RunFolder | None, view: RunView | None) -> int:
        """Write and show the stairways as they are after this frame; return how many there are."""
        number, stamp_ns = self._last_frame
        stairways = self.session.stairways()
        self._collector.convergence.add(stairways, self._collector.num_observations)
        if folder is not None and (stairways or self._num_known):
            folder.append_json(HISTORY_FILE, history_values(stamp_ns, stairways))
        self._num_known = len(stairways)
        if view is not None:
            view.show_stairways(stairways, number, stamp_ns)
        return len(stairways)

    def outcome(self) -> RunOutcome:
        """Return what came of the frames so far."""
        stairways = self.session.stairways()
        reasons = [str(rule) for rule in self._collector.rule_statistics()]
        if self._collector.num_detections and not stairways:
            reasons.insert(0, self._describe_unconfirmed())
        return RunOutcome(
            stairways=stairways,
            drops=self.session.drops(),
            num_frames=self._collector.num_frames,
            num_detections=self._collector.num_detections,
            num_without_pose=self._num_without_pose,
            reasons=tuple(reasons),
            problems=self._describe_problems(),
            was_stopped=self._was_stopped,
        )

    def _describe_problems(self) -> tuple[str, ...]:
        mistakes = [self._pose_watch.mistake(), self._unit_watch.advice(), self._level_map.note]
        lines = [*filter(None, mistakes)]
        lines += [*self._recording.problems.to_lines(), *self._notes]
        if self._was_stopped:
            lines.append(f"the run was interrupted after {counted(self._collector.num_frames, 'frame')}")
        return tuple(lines)

    def show_outcome(self, view: RunView, outcome: RunOutcome) -> None:
        """Show what came of the frames so far, after the last of them, and close the view."""
        number, stamp_ns = self._last_frame
        view.show_stairways(outcome.stairways, number, stamp_ns)
        view.close()

    def _describe_unconfirmed(self) -> str:
        """Say why frames with stair edges made no stairway."""
        seen = f"{counted(self._collector.num_detections, 'frame')} with stair edges made no stairway: "
        rejection = getattr(self.session.modeler, "rejection", None)
        if rejection is not None:
            return f"{seen}{rejection}"
        names = {"stairmap": "modeling.min_observations", "delmerico2013": "delmerico2013.detections_per_fit"}
        section, key = names[self.session.method].split(".")
        limit = getattr(getattr(self.session.config, section), key)
        return f"{seen}it takes {limit} observations that agree in the map ({section}.{key})"

    def write_results(self, folder: RunFolder, outcome: RunOutcome) -> None:
        """Write everything but the report, most valuable first: a disk may have room for some of it only."""
        folder.release_reserve()
        folder.write_stairways(
            outcome.stairways,
            num_frames=outcome.num_frames,
            frame_id=self._recording.frame_id,
            drops=outcome.drops,
            camera_height=self.session.camera_height,
        )
        if outcome.num_frames:
            folder.write_trajectory(self.session.trajectory())
        folder.write_summary(
            format_summary(
                outcome.stairways,
                num_frames=outcome.num_frames,
                num_detections=outcome.num_detections,
                reasons=outcome.reasons,
                problems=(*outcome.problems, *folder.failures),
            )
        )
        if not (folder.path / CONFIG_FILE).exists():
            folder.write_config(self.session.config)
        folder.write_mesh(outcome.stairways)

    def write_report(
        self,
        folder: RunFolder,
        outcome: RunOutcome,
        *,
        find_references: FindReferences | None = None,
        facts: Mapping[str, str] | None = None,
    ) -> str | None:
        """Write ``report.html``; return a sentence instead if a package for it is missing.

        ``facts`` say where it comes from: date, recording, command.
        """
        data = report_data(
            self._collector,
            recording_name=self._recording.name,
            method=self.session.method,
            stairways=outcome.stairways,
            trajectory=self.session.trajectory() if outcome.num_frames else None,
            config_yaml=dump_config(self.session.config),
            problems=outcome.problems,
            references=None if find_references is None else find_references(outcome.stairways),
            detector=self.session.detector,
            facts=facts,
            drops=outcome.drops,
        )
        try:
            folder.write_report(render_report(data))
        except MissingPackageError as error:
            return f"report.html was left out: {error}"
        return None
