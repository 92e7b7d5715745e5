"""Measure single frames of each kind of stairs and write the section "kinds" of BENCHMARKS.md.

Everything but times is drawn from seeds: the same commit gives the same tables.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from document import BenchmarkRun, describe_run, write_section
from goals import Goal

from stairmap.evaluation.frame_judging import FrameJudgement
from stairmap.evaluation.kind_tables import KindSummary, format_kinds, summarize_views
from stairmap.evaluation.table_format import format_table
from stairmap.evaluation.view_running import make_view_specs, run_views
from stairmap.pipeline import METHODS

MAX_FALSE_SHARE = 0.0002
"""Share of frames that may hold a false observation."""

MIN_CLOSE_SHARE, MIN_HONEST_SHARE = 0.95, 0.93
"""Shares of single risers within 4 mm, and within two of their deviations as everywhere in ``goals``."""


BEFORE = (
    "39 of 95 (41 %)",
    "rms 2.9 / 2.9 mm, 11 beyond",
    "not measured",
    "54 of 152 (36 %), upright all",
    "rms 4.4 mm",
    "18 of 24 (75 %)",
    "33 of 40, 40 with a wall",
    "0 of 1270",
    "rms 7.3 mm, worst 38.0 mm",
    "40 of 60",
)
"""What the detector of commit 73e5eef gave on the same views, before one profile took its place."""


def main() -> None:
    """Judge the methods on all kinds; write the section, or only print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cache", type=Path, default=None, help="keep rendered frames here")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--method", action="append", choices=tuple(METHODS), help="only this one")
    parser.add_argument("--quick", action="store_true", help="a quarter of the views, for a first look")
    parser.add_argument("--print", action="store_true", dest="is_dry", help="write nothing")
    arguments = parser.parse_args()
    run = BenchmarkRun()
    specs = make_view_specs(is_quick=arguments.quick)
    parts = ["## Kinds of stairs, single frames", ""]
    for method in arguments.method or METHODS:
        judgements = run_views(specs, METHODS[method][0], cache=arguments.cache, num_workers=arguments.jobs)
        if method == "stairmap":
            parts += ["### Goals, default method"]
            parts += [
                format_table(
                    ("goal", "at 73e5eef", "measured", "met"),
                    [
                        (goal.text, before, *goal.cells()[1:])
                        for goal, before in zip(find_kind_goals(judgements), BEFORE, strict=True)
                    ],
                )
            ]
        parts += [f"### By kind: {method}", format_kinds("kind", judgements)]
    parts[1] = describe_run(run)
    text = "\n\n".join(parts)
    if arguments.is_dry:
        print(text)
    else:
        write_section("kinds", text)


def find_kind_goals(judgements: Sequence[FrameJudgement]) -> list[Goal]:
    """Return the goals of single frames with what was measured."""

    def of(kind: str, is_in: Callable[[FrameJudgement], bool] = lambda _: True) -> KindSummary:
        return summarize_views(one for one in judgements if one.kind == kind and is_in(one))

    descending, overhang, irregular = of("descending"), of("overhang"), of("irregular")
    upright = of("roll", lambda one: one.group == "upright")
    rolled = of("roll", lambda one: one.group != "upright")
    sloping = of("sloping", lambda one: one.group.startswith("floor and treads"))
    far = of("far", lambda one: one.group == "4 m")
    walled = of("free-standing", lambda one: one.group == "wall behind")
    free = of("free-standing", lambda one: one.group != "wall behind")
    every = summarize_views(judgements)
    false = every.num_false_frames / max(every.num_views, 1)
    risers = irregular.riser_heights
    overhang_measures = (overhang.rise, overhang.run)
    return [
        Goal(
            text="descending, three treads of five rows or more: ≥ 95 % right",
            measured=_ratio(descending.num_clear_right, descending.num_clear),
            is_met=descending.num_clear_right >= 0.95 * descending.num_clear,
        ),
        Goal(
            text="overhang: rise and run ≤ 1.5 mm on average, no error beyond 3σ",
            measured=" / ".join(f"{1e3 * measure.mean_abs:.1f} mm" for measure in overhang_measures)
            + f", {overhang.calibrated.num_beyond_3} beyond",
            is_met=max(measure.mean_abs for measure in overhang_measures) <= 0.0015
            and overhang.calibrated.num_beyond_3 == 0,
        ),
        Goal(
            text="overhang: its own error ≤ 5 mm on average",
            measured=f"{1e3 * overhang.overhang.mean_abs:.1f} mm"
            if overhang.overhang.num
            else "not measured",
            is_met=overhang.overhang.num == overhang.num_found and overhang.overhang.mean_abs <= 0.005,
        ),
        Goal(
            text="rolled by any angle: right as often as upright",
            measured=f"{_ratio(rolled.num_clear_right, rolled.num_clear)}, upright "
            f"{_ratio(upright.num_clear_right, upright.num_clear)}",
            is_met=rolled.num_clear_right * upright.num_clear >= upright.num_clear_right * rolled.num_clear,
        ),
        Goal(
            text="floor and treads sloping to 4 %: rise ≤ 3 mm on average",
            measured=f"{1e3 * sloping.rise.mean_abs:.1f} mm",
            is_met=sloping.rise.mean_abs <= 0.003,
        ),
        Goal(
            text="at 4 m, rises of 8 rows and 5σ or more: ≥ 95 % found",
            measured=_ratio(far.num_clear - far.num_missed, far.num_clear),
            is_met=far.num_clear - far.num_missed >= 0.95 * far.num_clear,
        ),
        Goal(
            text="last nosing against nothing: found and right as with a wall",
            measured=f"{free.num_right} of {free.num_views}, {walled.num_right} with a wall; top nosing "
            f"{_ratio(free.num_tops_found, free.num_tops_shown)}",
            is_met=free.num_right >= walled.num_right,
        ),
        Goal(
            text="false observations in ≤ 0.02 % of frames",
            measured=_ratio(every.num_false_frames, every.num_views),
            is_met=false <= MAX_FALSE_SHARE,
        ),
        Goal(
            text="single risers from 1.5 m: ≥ 95 % within 4 mm, ≥ 93 % within 2σ",
            measured=f"{_ratio(irregular.num_risers_close, risers.num)}, worst {1e3 * risers.worst:.1f} mm, "
            + (f"{100 * risers.share_within_2:.0f} %" if risers.num_with_std else "no σ stated"),
            is_met=irregular.num_risers_close >= MIN_CLOSE_SHARE * risers.num
            and risers.share_within_2 >= MIN_HONEST_SHARE,
        ),
        Goal(
            text="a flight with one riser 12 mm off told from a regular one",
            measured=_ratio(irregular.num_odd_told, irregular.num_odd_judged),
            is_met=irregular.num_odd_told == irregular.num_odd_judged,
        ),
    ]


def _ratio(count: int, total: int) -> str:
    return f"{count} of {total}" + (f" ({100 * count / total:.1f} %)" if total else "")


if __name__ == "__main__":
    main()
