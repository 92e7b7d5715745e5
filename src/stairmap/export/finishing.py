"""Complete a run folder from its logs, as a run does that comes to its end."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from stairmap.errors import ResultsError
from stairmap.export.loading import (
    RunResults,
    SavedDetection,
    is_unfinished,
    load_detections,
    load_run_trajectory,
    load_stairways,
)
from stairmap.export.mesh import ply_from_stairways
from stairmap.export.results import (
    DETECTIONS_FILE,
    STAIRWAYS_FILE,
    SUMMARY_FILE,
    SURFACE_FILE,
    TRAJECTORY_FILE,
    stairways_json,
)
from stairmap.export.summary import counted, format_summary
from stairmap.input_files import shown
from stairmap.output_files import write_whole, write_whole_text
from stairmap.recordings.tum_trajectory import tum_text


@dataclass(frozen=True, slots=True, kw_only=True)
class FinishedRun:
    """A run folder that is complete now.

    Attributes
    ----------
    results
        What it holds.
    written
        Names of the files that were missing or cut short.
    """

    results: RunResults
    written: tuple[str, ...]


def finish_run_folder(run: Path) -> FinishedRun:
    """Write the files that a run would have written at its end, as far as its logs tell; replace none.

    ``trajectory.tum`` loses a last line that was cut off. There is no ``report.html``: it needs the frames.

    Raises
    ------
    ResultsError
        If it is no run folder, or its logs cannot be read.
    OutputError
        If a file cannot be written.
    """
    if not run.is_dir() or not (is_unfinished(run) or (run / STAIRWAYS_FILE).is_file()):
        raise ResultsError(
            f"expected the folder of a run, but {shown(run)} is not one; name one, or: stairmap run"
        )
    results = load_stairways(run)
    trajectory = load_run_trajectory(run)
    written = []
    if not results.is_finished:
        text = stairways_json(
            results.stairways,
            num_frames=results.num_frames,
            frame_id=results.frame_id,
            drops=results.drops,
            camera_height=results.camera_height,
        )
        write_whole_text(run / STAIRWAYS_FILE, text)
        written.append(STAIRWAYS_FILE)
    if trajectory is not None and not (run / TRAJECTORY_FILE).read_bytes().endswith(b"\n"):
        write_whole_text(run / TRAJECTORY_FILE, tum_text(trajectory))
        written.append(TRAJECTORY_FILE)
    if not (run / SUMMARY_FILE).exists():
        detections = load_detections(run) if (run / DETECTIONS_FILE).is_file() else ()
        write_whole_text(run / SUMMARY_FILE, _summary(results, detections))
        written.append(SUMMARY_FILE)
    if not (run / SURFACE_FILE).exists():
        write_whole(run / SURFACE_FILE, ply_from_stairways(results.stairways))
        written.append(SURFACE_FILE)
    return FinishedRun(results=results, written=tuple(written))


def _summary(results: RunResults, detections: Iterable[SavedDetection]) -> str:
    rules: Counter[str] = Counter()
    num_detections = 0
    for detection in detections:
        num_detections += bool(detection)
        if not detection:
            rules.update({rejection.rule for rejection in detection.rejections})
    return format_summary(
        results.stairways,
        num_frames=results.num_frames,
        num_detections=num_detections,
        reasons=[f"{rule} in {counted(number, 'frame')}" for rule, number in rules.most_common()],
        problems=[
            f"the run was killed after {counted(results.num_frames, 'frame')}; these are the last stairways "
            "that it wrote down, without single steps"
        ],
    )
