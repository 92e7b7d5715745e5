"""``stairmap demo``: a simulated robot drives up to a stairway of the report; estimated against true."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import typer

from stairmap.cli.exits import warn
from stairmap.cli.interrupts import Interrupt, noted_interrupts
from stairmap.cli.plain_table import format_columns
from stairmap.cli.progress import FrameProgress
from stairmap.cli.report_facts import report_facts
from stairmap.config import Config
from stairmap.export.results import RunFolder, create_run_folder, null_for_nan
from stairmap.export.summary import counted
from stairmap.map_levelling import find_level_map
from stairmap.pipeline import DEFAULT_METHOD, METHODS
from stairmap.recording_run import RecordingRun
from stairmap.recordings.base import Recording
from stairmap.recordings.open import open_recording
from stairmap.simulation.flight_scenes import TABLE_1
from stairmap.simulation.recording import write_simulation
from stairmap.simulation.render import RayCaster
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.stairway import Flight, Stairway

SCENE = "davis_rear"
SENSOR = "kinect_v1"
ROBOT = "turtlebot"
NUM_FRAMES = 60
SEED = 1

MEASURES = ("rise", "run", "width", "pitch")

PUBLISHED: Mapping[str, float] = {
    "rise": 0.169,
    "run": 0.311,
    "width": 1.048,
    "pitch": float(np.radians(29.4)),
}
"""What the report's own robot estimated at this stairway: ARL-TR-6381, table 1, Davis Rear (m, rad)."""

PUBLISHED_TRUTH: Mapping[str, float] = {
    **dict(zip(("rise", "run", "width"), TABLE_1[SCENE], strict=True)),
    "pitch": float(np.radians(29.5)),
}
"""What the report measured by hand there. Simulated steps differ from it, and among themselves, by 3 mm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """What one method gives for the stairway.

    Attributes
    ----------
    name
        Who estimated.
    measures
        Rise, run, width (m) and pitch (rad); empty if no stairway was found.
    truth
        What they would be without error.
    """

    name: str
    measures: Mapping[str, float]
    truth: Mapping[str, float]


def run_demo(*, output: Path | None, as_json: bool) -> int:
    """Simulate the drive, run all methods, write the run folder, print a table; return the exit code.

    Raises
    ------
    StairmapError
        If the simulator's package is missing or the folder cannot be written.
    """
    scene = make_scene(SCENE, SEED)
    truth = scene.stairways[0].flights[0]
    # Learn that the ray caster is not installed before a folder is made.
    RayCaster(scene.mesh)
    with create_run_folder(output, "demo") as folder:
        folder.on_failure = warn
        typer.echo(f"rendering {NUM_FRAMES} frames: {ROBOT}, {SENSOR}, odometry error", err=True)
        with FrameProgress(None) as progress:
            write_simulation(
                folder.path / "recording",
                scene,
                make_sensor(SENSOR),
                ROBOTS[ROBOT],
                seed=SEED,
                num_frames=NUM_FRAMES,
                on_frame=lambda _count, num_frames: progress.advance(num_frames=num_frames),
            )
        recording = open_recording(folder.path / "recording")
        methods = sorted(METHODS, key=lambda name: name != DEFAULT_METHOD)
        with noted_interrupts() as interrupt:
            estimates = [
                _run_method(name, recording, truth, folder if name == DEFAULT_METHOD else None, interrupt)
                for name in methods
            ]
        if interrupt:
            typer.echo("interrupted: not all frames were looked at", err=True)
        estimates.append(Estimate(name="the report's robot, 2013", measures=PUBLISHED, truth=PUBLISHED_TRUTH))
        if as_json:
            typer.echo(_format_json(folder, truth, estimates))
        else:
            typer.echo(_format_text(folder, truth, estimates))
        return interrupt.exit_code


def _run_method(
    method: str, recording: Recording, truth: Flight, folder: RunFolder | None, interrupt: Interrupt
) -> Estimate:
    typer.echo(f"running {method}", err=True)
    run = RecordingRun(recording, find_level_map(recording), config=Config(), method=method)
    with FrameProgress(recording.num_frames) as progress:
        run.process_frames(
            folder,
            should_stop=lambda: bool(interrupt),
            on_frame=lambda num_stairways: progress.advance(counted(num_stairways, "stairway")),
        )
    outcome = run.outcome()
    if folder is not None:
        run.write_results(folder, outcome)
        missing = run.write_report(
            folder,
            outcome,
            find_references=lambda stairways: _find_references(stairways, truth),
            facts=report_facts(folder.path / "recording"),
        )
        if missing:
            typer.echo(missing, err=True)
    flight = _find_flight(outcome.stairways, truth)
    return Estimate(name=method, measures={} if flight is None else _measures(flight), truth=_measures(truth))


def _find_flight(stairways: Sequence[Stairway], truth: Flight) -> Flight | None:
    """Return the flight whose base lies nearest to the true one."""
    flights = [flight for stairway in stairways for flight in stairway.flights]
    return min(flights, key=lambda flight: float(np.linalg.norm(flight.base - truth.base)), default=None)


def _find_references(stairways: Sequence[Stairway], truth: Flight) -> Mapping[int, Mapping[str, float]]:
    nearest = _find_flight(stairways, truth)
    # The drawing of a stairway follows its first flight.
    return {stairway.id: _measures(truth) for stairway in stairways if stairway.flights[0] is nearest}


def _measures(flight: Flight) -> dict[str, float]:
    return {name: float(getattr(flight, name)) for name in MEASURES}


def _format_text(folder: RunFolder, truth: Flight, estimates: Sequence[Estimate]) -> str:
    true_values = _measures(truth)
    rows = [("true", *(_in_units(name, true_values[name]) for name in MEASURES))]
    for estimate in estimates:
        cells = [
            f"{_in_units(name, estimate.measures[name])} "
            f"({_error_in_units(name, estimate.measures[name] - estimate.truth[name])})"
            if estimate.measures
            else "not found"
            for name in MEASURES
        ]
        rows.append((estimate.name, *cells))
    header = ("estimate (error)", "rise mm", "run mm", "width mm", "pitch deg")
    return "\n".join(
        [
            f"Davis Hall rear stairway of ARL-TR-6381, simulated: {truth.num_risers} risers",
            "",
            format_columns(header, rows, left_aligned=("estimate (error)",)),
            "",
            "pictures: report.html; the recording itself: recording/",
            str(folder.path),
        ]
    )


def _in_units(name: str, value: float) -> str:
    return f"{np.degrees(value):.1f}" if name == "pitch" else f"{value * 1e3:.0f}"


def _error_in_units(name: str, error: float) -> str:
    return f"{np.degrees(error) if name == 'pitch' else error * 1e3:+.1f}"


def _format_json(folder: RunFolder, truth: Flight, estimates: Sequence[Estimate]) -> str:
    values = {
        "output": str(folder.path),
        "true": _measures(truth),
        "estimates": {estimate.name: dict(estimate.measures) or None for estimate in estimates},
    }
    return json.dumps(null_for_nan(values), indent=1, allow_nan=False)
