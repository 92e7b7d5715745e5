"""Measure how good the methods are on all suites and write the section "accuracy" of BENCHMARKS.md.

Everything is drawn from seeds: the same commit gives the same tables. Pictures go to benchmarks/pictures,
the rows of all trials to benchmarks/trials.md.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from document import ROOT, BenchmarkRun, describe_run, write_section
from goals import find_goals, sensor_of, summarize_by
from kept_results import run_kept_trials

from stairmap.evaluation.convergence import draw_convergences, record_convergence
from stairmap.evaluation.data_folder import DATA_FOLDER
from stairmap.evaluation.detection_rates import QUICK_GRID, RateGrid, RatePanel, measure_panels
from stairmap.evaluation.rate_plots import Rate, draw_rates
from stairmap.evaluation.real import RealResult, run_real_suite
from stairmap.evaluation.running import TrialSettings
from stairmap.evaluation.suites import SIMULATED_SUITES, TrialChoice, make_specs
from stairmap.evaluation.summary import group_results, summarize
from stairmap.evaluation.table1 import format_table_1
from stairmap.evaluation.table_format import format_table
from stairmap.evaluation.tables import format_groups, format_real, format_summary, format_trials
from stairmap.evaluation.trials import TrialResult, TrialSpec
from stairmap.visualization.plots import png_from_figure

METHODS = ("stairmap", "delmerico2013")
PICTURES = ROOT / "benchmarks" / "pictures"
TRIALS = ROOT / "benchmarks" / "trials.md"

CONVERGENCE_TRIALS = ("davis_front", "davis_rear")
"""The report's figure 8 shows these two stairs."""

KIND_DRIVES = "kind-drives"
"""A suite apart: the goals were set without it."""

WORST_ERRORS = {"rise": 0.006, "run": 0.006}
"""Goals for the worst error, m; flights beyond are listed."""


def main() -> None:
    """Run all suites and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cache", type=Path, default=None, help="keep rendered frames here")
    parser.add_argument("--data", type=Path, default=ROOT / DATA_FOLDER, help="buildings and real recordings")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--keep", type=Path, default=None, help="file of results: a killed run goes on here")
    parser.add_argument("--quick", action="store_true", help="one short drive per scene, for a first look")
    arguments = parser.parse_args()
    run = BenchmarkRun()
    choice = TrialChoice(is_quick=arguments.quick)
    buildings = arguments.data / "buildings"
    specs = [spec for suite in SIMULATED_SUITES for spec in make_specs(suite, choice, buildings=buildings)]
    settings = TrialSettings(methods=METHODS, buildings=buildings, cache=arguments.cache)
    results = run_kept_trials(
        specs, settings, num_workers=arguments.jobs, path=arguments.keep, commit=run.commit
    )
    real = run_real_suite(arguments.data / "real", METHODS)
    grid = QUICK_GRID if arguments.quick else RateGrid()
    panels = measure_panels(grid, METHODS, num_workers=arguments.jobs)
    PICTURES.mkdir(parents=True, exist_ok=True)
    text = [
        "## Accuracy",
        "",
        *describe_accuracy(results, real),
        *draw_all_rates(panels, grid),
        *draw_all_convergences(specs, arguments.cache),
    ]
    text[1] = describe_run(run)
    TRIALS.write_text("# All trials\n\n" + format_trials(results) + "\n", encoding="utf-8")
    write_section("accuracy", "\n\n".join(text))


def describe_accuracy(results: Sequence[TrialResult], real: Sequence[RealResult]) -> list[str]:
    """Return the tables of trials and real recordings."""
    usual = [result for result in results if result.spec.suite != KIND_DRIVES]
    by_method = group_results(usual, lambda result: result.method)
    mine = by_method["stairmap"]
    parts = [
        f"{len(mine)} simulated drives with odometry error, and real frames. "
        "[benchmarks/trials.md](benchmarks/trials.md) has a row for each drive and method.",
        "### Goals, default method",
        format_table(("goal", "measured", "met"), [goal.cells() for goal in find_goals(mine, real)]),
        "### Both methods, all drives",
        format_summary({method: summarize(every) for method, every in by_method.items()}),
    ]
    for method, every in by_method.items():
        parts += [f"### By suite and by sensor: {method}"]
        parts += [format_groups("suite", summarize_by(every, lambda result: result.spec.suite))]
        parts += [format_groups("sensor", summarize_by(every, sensor_of))]
    parts += describe_kind_drives([result for result in results if result.spec.suite == KIND_DRIVES])
    parts += ["### What the default method missed, invented, or measured badly", list_failures(mine)]
    parts += ["### The report's Table 1", format_table_1(usual, METHODS)]
    parts += ["### Real frames", "Estimates with what was measured by hand in brackets.", format_real(real)]
    return parts


def describe_kind_drives(results: Sequence[TrialResult]) -> list[str]:
    """Return the tables of the drives that show one kind each; they are in none of the sums above."""
    parts = ["### Drives of single kinds, which are in none of the tables above"]
    for method, every in group_results(results, lambda result: result.method).items():
        parts += [format_groups(method, summarize_by(every, lambda result: result.spec.scene))]
    mine = [result for result in results if result.method == "stairmap"]
    return [*parts, "Of these the default method missed, invented or measured badly:", list_failures(mine)]


def list_failures(results: Sequence[TrialResult]) -> str:
    """Return a line for each crashed trial, missed or false flight, and bad rise or run."""
    lines = []
    for result in results:
        if result.crash is not None:
            lines.append(f"* {result.spec}: crashed, {result.crash}")
        for flight in result.flights:
            which = f"stairway {flight.stairway_id}, flight {flight.flight_index + 1}"
            if flight.is_missed:
                lines.append(
                    f"* {result.spec}: missed {which}, observed in {flight.num_observed_frames} frames, "
                    f"near in {flight.truth['near_frames']:.0f}"
                )
            for name, limit in WORST_ERRORS.items() if flight.errors is not None else ():
                error = flight.errors.errors[name] if flight.errors is not None else 0.0
                if abs(error) > limit and not flight.is_optional:
                    lines.append(f"* {result.spec}: {name} of {which} off by {1e3 * error:+.1f} mm")
        for entry in result.false_flights:
            size = f"rise {1e3 * entry['rise']:.0f}, run {1e3 * entry['run']:.0f} mm"
            lines.append(f"* {result.spec}: false ({entry['reason']}), {size}, {entry['num_risers']} risers")
    return "\n".join(lines) or "Nothing."


def draw_all_rates(panels: Sequence[RatePanel], grid: RateGrid) -> list[str]:
    """Write the heat maps; return the paragraphs that show them."""
    parts = [
        "### Detection in single frames over distance, view angle, sensor and camera height",
        "The camera aims at the stairs' lower half, and up is known to 0.4°. False detections are those in "
        "the same views of look-alikes.",
    ]
    for method in METHODS:
        mine = [panel for panel in panels if panel.method == method]
        rates: tuple[tuple[Rate, str], ...] = (("recall", "recall"), ("false_rate", "false"))
        for rate, name in rates:
            path = PICTURES / f"{name}_{method}.png"
            path.write_bytes(png_from_figure(draw_rates(mine, grid, rate=rate)))
            mean = np.mean([getattr(panel, rate) for panel in mine])
            parts.append(f"{method}, mean {name} of all cells {100 * mean:.1f} %:")
            parts.append(f"![{name} of {method}]({path.relative_to(ROOT)})")
    return parts


def draw_all_convergences(specs: Sequence[TrialSpec], cache: Path | None) -> list[str]:
    """Write the pictures after the report's figure 8; return the paragraphs that show them."""
    parts = ["### Convergence (the report's figure 8)"]
    for scene in CONVERGENCE_TRIALS:
        spec = next(spec for spec in specs if spec.scene == scene)
        convergence = record_convergence(spec, METHODS, cache=cache)
        if convergence is None:
            continue
        path = PICTURES / f"convergence_{scene}.png"
        path.write_bytes(png_from_figure(draw_convergences(convergence)))
        parts.append(f"![convergence on {scene}]({path.relative_to(ROOT)})")
    return parts


if __name__ == "__main__":
    main()
