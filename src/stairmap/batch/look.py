"""What was seen in one input of a batch, and how a look at frames or sweeps ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stairmap.export.history import history_values
from stairmap.export.results import RunFolder
from stairmap.recording_run import RecordingRun
from stairmap.stairway import Stairway
from stairmap.sweep_run import SweepRun


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What was seen in one input.

    Attributes
    ----------
    num_frames, num_detections
        Frames looked at (windows of sweeps; 1 for a cloud), and those with stair edges.
    stairways
        JSON types as in ``history.jsonl``: without single steps.
    failure
        Why the recording broke off; empty if it did not.
    num_to_split
        Frames of a recording that is too long; it was not looked at then.
    """

    num_frames: int = 0
    num_detections: int = 0
    stairways: tuple[Mapping[str, Any], ...] = ()
    failure: str = ""
    num_to_split: int = 0


def without_steps(stairways: Sequence[Stairway]) -> tuple[Mapping[str, Any], ...]:
    """Return stairways as ``Look`` holds them."""
    return tuple(history_values(0, stairways)["stairways"])


def finish_look(run: RecordingRun | SweepRun, folder: RunFolder, *, with_report: bool) -> Look:
    """Write the results of a run that came to its end, and return what was seen.

    Raises
    ------
    StairmapError
        If the folder cannot be written.
    """
    outcome = run.outcome()
    run.write_results(folder, outcome)
    if with_report:
        run.write_report(folder, outcome)
    for line in outcome.problems:
        folder.log(line)
    return Look(
        num_frames=outcome.num_frames,
        num_detections=outcome.num_detections,
        stairways=without_steps(outcome.stairways),
        failure="" if run.failure is None else str(run.failure),
    )
