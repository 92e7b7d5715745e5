"""Run over the sweeps or elevation maps of a bag and write a run folder, as for depth images.

with create_run_folder(None, recording.name) as folder:
    run = SweepRun(recording, config=Config())
    run.process_sweeps(folder)
    run.write_results(folder, run.outcome())

Where a run of depth images counts frames, this one counts windows: some sweeps gathered together, or an
elevation map that was looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import chain, islice
from typing import Any

from stairmap.config import Config, dump_config
from stairmap.elevation_session import ElevationSession, GridResult
from stairmap.errors import MapFullError, MissingPackageError, RecordingError
from stairmap.export.history import HISTORY_FILE, history_values
from stairmap.export.results import CONFIG_FILE, RunFolder
from stairmap.export.summary import counted, format_summary
from stairmap.pipeline import DEFAULT_METHOD
from stairmap.recording_run import RunOutcome
from stairmap.recordings.bags.elevation import ElevationRecording
from stairmap.recordings.bags.sweeps import SweepRecording
from stairmap.sweep_session import SweepSession, WindowResult
from stairmap.visualization.collecting import ReportCollector
from stairmap.visualization.report import render_report, report_data


class SweepRun:
    """Looks at the sweeps, or elevation maps, of one recording.

    Parameters
    ----------
    recording
        Where sweeps and poses come from.
    config
        Configuration of all stages.

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
        If no sweep can be read; as TrajectoryError if none has a pose.
    """

    def __init__(self, recording: SweepRecording | ElevationRecording, *, config: Config) -> None:
        self._recording = recording
        self._trajectory: Any = recording.check_poses()
        self.session: Any = (
            SweepSession(config) if isinstance(recording, SweepRecording) else ElevationSession(config)
        )
        self.failure: RecordingError | None = None
        self._collector = ReportCollector()
        self._was_stopped = False
        self._notes: tuple[str, ...] = ()
        self._num_known = 0
        sweeps = iter(recording)
        # The first is read at once: an unreadable recording makes no results folder.
        self._sweeps: Iterator[Any] = chain(list(islice(sweeps, 1)), sweeps)

    def process_sweeps(
        self,
        folder: RunFolder | None = None,
        *,
        should_stop: Callable[[], bool] = lambda: False,
        on_sweep: Callable[[int], None] = lambda _: None,
    ) -> None:
        """Look at sweeps until they end, or until the map is full.

        Parameters
        ----------
        folder
            Where to write ``config.yaml`` at once and ``detections.jsonl``, ``history.jsonl`` and
            ``trajectory.tum`` meanwhile, a line for each window.
        should_stop
            Asked before each sweep; the run ends there when it says so.
        on_sweep
            Called after each sweep with the number of stairways so far.
        """
        if folder is not None:
            folder.write_config(self.session.config)
        try:
            for sweep in self._sweeps:
                if should_stop():
                    self._was_stopped = True
                    break
                self._take(folder, self.session.add(sweep, self._trajectory))
                on_sweep(self._num_known)
            self._take(folder, self.session.finish())
        except MapFullError as error:
            self._notes = (f"the run ended early: {error}",)
        except (RecordingError, OSError) as error:
            if not self.session.num_sweeps:
                raise
            # A disk that went away must not cost what was found before.
            self.failure = RecordingError(
                f"the recording could not be read beyond sweep {self.session.num_sweeps - 1}: {error}"
            )
            self._notes = (str(self.failure),)

    def _take(self, folder: RunFolder | None, result: WindowResult | GridResult | None) -> None:
        if result is None:
            return
        pose = result.window.map_from_sensor
        self._collector.add_points(result.detection, pose)
        if folder is not None:
            folder.append_detection(result.detection)
            folder.append_pose(result.detection.stamp_ns, pose)
        if not self._collector.convergence.is_due(self._collector.num_observations):
            return
        stairways = self.session.stairways()
        self._collector.convergence.add(stairways, self._collector.num_observations)
        if folder is not None and (stairways or self._num_known):
            folder.append_json(HISTORY_FILE, history_values(result.detection.stamp_ns, stairways))
        self._num_known = len(stairways)

    def outcome(self) -> RunOutcome:
        """Return what came of the sweeps so far; its frames are windows."""
        stairways = self.session.stairways()
        reasons = [str(rule) for rule in self._collector.rule_statistics()]
        if self._collector.num_detections and not stairways:
            limit = self.session.config.modeling.min_observations
            reasons.insert(
                0,
                f"{counted(self._collector.num_detections, 'window')} with stair edges made no stairway: it "
                f"takes {limit} observations that agree in the map (modeling.min_observations)",
            )
        problems = [*self._recording.problems.to_lines(), *self._notes]
        if self.session.num_without_pose:
            problems.append(
                f"{self.session.num_without_pose} of {self.session.num_sweeps} sweeps have no pose and were "
                "left out"
            )
        if self._was_stopped:
            problems.append(f"the run was interrupted after {counted(self.session.num_sweeps, 'sweep')}")
        return RunOutcome(
            stairways=stairways,
            drops=(),
            num_frames=self._collector.num_frames,
            num_detections=self._collector.num_detections,
            num_without_pose=self.session.num_without_pose,
            reasons=tuple(reasons),
            problems=tuple(problems),
            was_stopped=self._was_stopped,
        )

    def write_results(self, folder: RunFolder, outcome: RunOutcome) -> None:
        """Write everything but the report, most valuable first: a disk may have room for some of it only."""
        folder.release_reserve()
        folder.write_stairways(
            outcome.stairways, num_frames=outcome.num_frames, frame_id=self._recording.frame_id
        )
        if outcome.num_frames:
            folder.write_trajectory(self.session.map_session.trajectory())
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
        self, folder: RunFolder, outcome: RunOutcome, *, facts: Mapping[str, str] | None = None
    ) -> str | None:
        """Write ``report.html``; return a sentence instead if a package for it is missing."""
        data = report_data(
            self._collector,
            recording_name=self._recording.name,
            method=DEFAULT_METHOD,
            stairways=outcome.stairways,
            trajectory=self.session.map_session.trajectory() if outcome.num_frames else None,
            config_yaml=dump_config(self.session.config),
            problems=outcome.problems,
            facts=facts,
        )
        try:
            folder.write_report(render_report(data))
        except MissingPackageError as error:
            return f"report.html was left out: {error}"
        return None
