"""Measure what finished maps and the sweeps of LiDARs give, and write sections of BENCHMARKS.md.

Everything but times is drawn from seeds: the same commit gives the same tables.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from document import BenchmarkRun, describe_run, write_section

from stairmap.evaluation.cloud_suites import make_cloud_specs
from stairmap.evaluation.cloud_trials import FINISHED_MAPS, METHOD, SWEEPS, run_cloud_trial
from stairmap.evaluation.data_folder import DATA_FOLDER
from stairmap.evaluation.drift import find_observed_flight
from stairmap.evaluation.running import TrialSettings, run_trials
from stairmap.evaluation.suites import TrialChoice
from stairmap.evaluation.summary import group_results, summarize
from stairmap.evaluation.table_format import format_table
from stairmap.evaluation.tables import format_groups
from stairmap.evaluation.trials import TrialResult
from stairmap.geometry import wrapped_angle
from stairmap.simulation.lidars import LIDARS
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sweeps import LidarDrive
from stairmap.sweep_session import SweepSession

WINDOW_SCENES, WINDOW_ROBOTS = ("free_standing", "one_wall", "shallow"), ("turtlebot", "spot", "humanoid")
"""What single windows are judged on: stairs that fill the view, from 0.3, 0.6 and 1.3 m."""

DISTANCES = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)
"""Ends of the distances by which windows are told apart, m."""


WINDOWS = "windows"

TITLES = {
    FINISHED_MAPS: "Finished maps (`stairmap evaluate clouds`)",
    SWEEPS: "Drives with a LiDAR (`stairmap evaluate sweeps`)",
    WINDOWS: "LiDARs: single windows of a second, by distance",
}
"""What is measured, each for a section of its own."""


def main() -> None:
    """Run the suites and the windows; write the sections, or only print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=DATA_FOLDER, help="folder with the folder buildings")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", action="append", default=[], help="only scenes whose name holds this")
    parser.add_argument("--suite", action="append", choices=tuple(TITLES))
    parser.add_argument("--print", action="store_true", dest="is_dry", help="write nothing")
    arguments = parser.parse_args()
    for suite in arguments.suite or TITLES:
        run = BenchmarkRun()
        if suite == WINDOWS:
            text = describe_windows()
        else:
            choice = TrialChoice(only=tuple(arguments.only))
            specs = make_cloud_specs(suite, choice, buildings=arguments.data / "buildings")
            settings = TrialSettings(methods=(METHOD,), buildings=arguments.data / "buildings")
            text = describe_results(
                run_trials(specs, settings, num_workers=arguments.jobs, trial=run_cloud_trial)
            )
        section = "\n\n".join([f"## {TITLES[suite]}", describe_run(run), text])
        print(section, flush=True)
        if not arguments.is_dry:
            write_section(suite, section)


def describe_results(results: Sequence[TrialResult]) -> str:
    """Return sums by sensor and kind of scene, and what was missed, invented or crashed."""
    by_sensor = group_results(results, lambda result: f"{result.spec.sensor}, {_place(result)}")
    table = format_groups("map or LiDAR", {name: summarize(some) for name, some in by_sensor.items()})
    lines = []
    for result in results:
        if result.crash is not None:
            lines.append(f"{result.spec}: crashed, {result.crash}")
        missed = sum(flight.is_missed for flight in result.flights)
        if missed:
            lines.append(f"{result.spec}: {missed} of {len(result.flights)} flights missed")
        for false in result.false_flights:
            size = f"{1e3 * false['rise']:.0f} x {1e3 * false['run']:.0f} mm"
            lines.append(f"{result.spec}: {false['reason']}, {false['num_risers']} risers of {size}")
    return "\n\n".join([table, "\n".join(f"* {line}" for line in lines)]).strip()


def _place(result: TrialResult) -> str:
    return "buildings" if result.spec.scene.startswith("building:") else "scenes"


def describe_windows() -> str:
    """Return how often a window of one second sees a flight, and how well, by LiDAR and distance."""
    rows = []
    for name in LIDARS:
        seen = np.array([row for scene in WINDOW_SCENES for row in _windows(name, scene)])
        for low, high in pairwise(DISTANCES):
            mine = seen[(seen[:, 0] >= low) & (seen[:, 0] < high)]
            found = mine[np.isfinite(mine[:, 1])]
            cells = [name, f"{low:g} to {high:g}", f"{len(found)} of {len(mine)}"]
            if len(found):
                cells += [f"{1e3 * np.median(np.abs(found[:, column])):.1f}" for column in (1, 2)]
                cells += [f"{np.degrees(np.median(np.abs(found[:, 3]))):.1f}"]
                cells += [f"{100 * np.mean(np.abs(found[:, 1]) < 2 * found[:, 4]):.0f} %"]
            rows.append([*cells, *[""] * (7 - len(cells))])
    header = (
        "LiDAR",
        "distance, m",
        "windows that see it",
        "rise, mm",
        "run, mm",
        "heading, °",
        "rise in 2σ",
    )
    table = format_table(header, rows, num_left=2)
    return (
        f"Windows of a second of drives with odometry error: {', '.join(WINDOW_SCENES)}; robots "
        f"{', '.join(WINDOW_ROBOTS)}. Errors are medians of single windows, which a map averages.\n\n{table}"
    )


def _windows(lidar: str, scene_name: str) -> list[tuple[float, ...]]:
    """Distance, errors of rise, run and heading, and stated deviation of the rise; NaN where not seen."""
    rows = []
    for robot in WINDOW_ROBOTS:
        scene = make_scene(scene_name, 0)
        drive = LidarDrive(scene, LIDARS[lidar], ROBOTS[robot], seed=0)
        (flight,) = scene.stairways[0].flights
        session = SweepSession()
        results = [session.add(found.sweep, drive.odometry_path) for found in drive.sweeps()]
        for result in filter(None, [*results, session.finish()]):
            pose = drive.true_path.pose_at(result.window.stamp_ns)
            distance = float(np.linalg.norm((pose[:3, 3] - flight.base)[:2]))
            mine = [
                item
                for item in result.detection.observations
                if find_observed_flight(item, pose, (flight,)) is not None
            ]
            if not mine:
                rows.append((distance, *[np.nan] * 4))
                continue
            item = max(mine, key=lambda item: item.num_steps)
            forward = pose[:3, :3] @ item.forward
            heading = wrapped_angle(float(np.arctan2(forward[1], forward[0])) - flight.heading)
            std = float(np.sqrt(item.covariance[0, 0]))
            rows.append((distance, item.rise - flight.rise, item.run - flight.run, heading, std))
    return rows


if __name__ == "__main__":
    main()
