"""Results as Markdown tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from stairmap.evaluation.metrics import CALIBRATED, MEASURES
from stairmap.evaluation.real import RealResult
from stairmap.evaluation.summary import ErrorStatistics, Summary, group_results, summarize
from stairmap.evaluation.table1 import format_table_1
from stairmap.evaluation.table_format import format_table
from stairmap.evaluation.trials import TrialResult

UNITS: dict[str, tuple[float, str, int]] = {
    **dict.fromkeys(MEASURES, (1e3, "mm", 1)),
    "pitch": (float(np.degrees(1)), "°", 2),
    "heading": (float(np.degrees(1)), "°", 2),
}
"""Factor, unit and decimals in which each measure is printed."""

_TRIAL_HEADER = (
    "scene", "sensor", "robot", "seed", "method", "found", "missed", "false", "seen in", "false in",
    "rise mm", "run mm", "width mm", "pitch °", "heading °", "across mm", "along mm", "up mm",
    "overhang mm", "place mm", "open width mm",
    "drift mm", "steps", "ms",
)  # fmt: skip


def format_all(results: Sequence[TrialResult], methods: Sequence[str]) -> str:
    """Return all tables of simulated trials: each trial, sums, sums by sensor and by suite, Table 1."""
    by_method = group_results(results, lambda result: result.method)
    parts = [format_trials(results)]
    parts.append(format_summary({method: summarize(mine) for method, mine in by_method.items()}))
    for method, mine in by_method.items():
        for title, key in (("sensor", _sensor_of), ("suite", _suite_of)):
            groups = {name: summarize(some) for name, some in group_results(mine, key).items()}
            if len(groups) > 1:
                parts.append(format_groups(f"{method}, by {title}", groups))
    if any(result.spec.suite == "table1" for result in results):
        parts.append(format_table_1(results, methods))
    return "\n\n".join(parts)


def _sensor_of(result: TrialResult) -> str:
    spec = result.spec
    return spec.sensor if spec.width is None else f"{spec.sensor} {spec.width}"


def _suite_of(result: TrialResult) -> str:
    return result.spec.suite


def format_trials(results: Iterable[TrialResult]) -> str:
    """Return one line per trial and method; where several flights were found, the largest errors.

    ``found`` is of those that had to be found, ``+1`` one more; ``seen in`` and ``false in`` are
    frames with an observation and with one of nothing; ``steps`` is estimated / true (in view).
    """
    return format_table(_TRIAL_HEADER, [format_trial(result) for result in results], num_left=5)


def format_trial(result: TrialResult) -> list[str]:
    """Return the cells of one line; see ``format_trials``."""
    spec = result.spec
    cells = [spec.scene, _sensor_of(result), spec.robot, str(spec.seed), result.method]
    if result.crash is not None:
        return cells + ["crashed: " + result.crash.replace("|", "/")] + [""] * (len(_TRIAL_HEADER) - 6)
    required = [flight for flight in result.flights if flight.must_be_found]
    found = sum(flight.is_found for flight in required)
    extra = sum(
        flight.is_found and not flight.must_be_found and not flight.is_optional for flight in result.flights
    )
    judged = [flight for flight in result.flights if flight.errors is not None and not flight.is_optional]
    cells += [
        f"{found}/{len(required)}" + (f"+{extra}" if extra else ""),
        _number_or_blank(len(required) - found),
        _number_or_blank(len(result.false_flights)),
        f"{result.num_detections}/{result.num_frames}",
        _number_or_blank(result.num_false_frames),
    ]
    for name in MEASURES:
        errors = [flight.errors.errors[name] for flight in judged if flight.errors is not None]
        known = [error for error in errors if not np.isnan(error)]
        cells.append(_in_unit(name, max(known, key=abs), sign=True) if known else "")
    cells.append(f"{1e3 * max(flight.drift_spread for flight in judged):.0f}" if judged else "")
    steps = []
    for flight in judged:
        if flight.errors is None or flight.estimate is None:
            continue
        mark = "" if flight.errors.num_steps_right else "!"
        seen = f"{flight.truth['num_surely_seen']}-{flight.truth['num_possibly_seen']}"
        shift = f"@{flight.errors.lowest_step:+d}" if flight.errors.lowest_step else ""
        steps.append(f"{flight.estimate['num_risers']}{shift}/{flight.truth['num_risers']}({seen}){mark}")
    return [*cells, " ".join(steps), f"{result.frame_ms:.1f}"]


def format_summary(summaries: Mapping[str, Summary]) -> str:
    """Return the sums, one column per method (or whatever the keys are)."""
    rows = [
        ["trials (crashed)", *(f"{s.num_trials} ({s.num_crashed})" for s in summaries.values())],
        ["flights found / that had to be", *(f"{s.num_found}/{s.num_required}" for s in summaries.values())],
        ["found beyond those", *(str(s.num_extra) for s in summaries.values())],
        ["missed", *(str(s.num_missed) for s in summaries.values())],
        [
            "false flights (duplicates)",
            *(f"{s.num_false} ({s.num_duplicates})" for s in summaries.values()),
        ],
        ["frames", *(str(s.num_frames) for s in summaries.values())],
        [
            "frames with an observation",
            *(f"{s.num_detections} ({_share(s.num_detections, s.num_frames)})" for s in summaries.values()),
        ],
        ["observations", *(str(s.num_observations) for s in summaries.values())],
        [
            "frames with a false one",
            *(
                f"{s.num_false_frames} ({_share(s.num_false_frames, s.num_frames, 2)})"
                for s in summaries.values()
            ),
        ],
    ]
    for name in MEASURES:
        rows.append([f"{name.replace('_', ' ')}: mean abs / worst / bias, {UNITS[name][1]}"])
        rows[-1] += [format_errors(name, s.errors[name]) for s in summaries.values()]
    rows += [
        [
            "steps right, of those in view",
            *(_ratio(s.num_steps_right, s.num_steps_judged) for s in summaries.values()),
        ],
        [
            "number of risers right, whole in view",
            *(_ratio(s.num_risers_right, s.num_risers_judged) for s in summaries.values()),
        ],
    ]
    rows.append(["flights of one stairway joined"])
    rows[-1] += [_ratio(s.num_joined_right, s.num_joined_judged) for s in summaries.values()]
    rows += _verdict_rows(summaries)
    for name in (*CALIBRATED, "all"):
        rows.append([f"{name}: errors within 1σ / 2σ"])
        rows[-1] += [_calibration(s.errors[name]) for s in summaries.values()]
    rows += [
        [
            "ms per frame, median (mean)",
            *(f"{s.frame_ms:.1f} ({s.mean_frame_ms:.1f})" for s in summaries.values()),
        ],
        ["ms per query of the stairways", *(f"{s.query_ms:.1f}" for s in summaries.values())],
    ]
    return format_table(["", *summaries], rows)


def _verdict_rows(summaries: Mapping[str, Summary]) -> list[list[str]]:
    every = [summary.verdicts for summary in summaries.values()]
    rows = {
        "verdicts > 2σ from limits": [(v.right, v.unknown, v.wrong) for v in every],
        "verdicts nearer": [(v.near_right, v.near_unknown, v.near_wrong) for v in every],
        "verdicts, truth > 2σ from limits": [
            (v.truly_clear_right, v.truly_clear_unknown, v.truly_clear_wrong) for v in every
        ],
    }
    counts = [
        [f"{name}: right / unknown / wrong", *(" / ".join(map(str, v)) for v in values)]
        for name, values in rows.items()
    ]
    return [
        *counts,
        ["impassable called passable", *(str(v.num_dangerous) for v in every)],
        ["said though no published limit settles it", *(str(v.num_overclaimed) for v in every)],
    ]


def format_groups(title: str, summaries: Mapping[str, Summary]) -> str:
    """Return one line per group of trials, such as those of one sensor."""
    header = [
        title, "trials", "found", "missed", "false", "false in frames",
        *(f"{name}: mean abs / worst / bias, {UNITS[name][1]}" for name in ("rise", "run", "width")),
        "steps right", "within 1σ / 2σ", "ms",
    ]  # fmt: skip
    rows = [
        [
            name,
            str(s.num_trials),
            f"{s.num_found}/{s.num_required}",
            str(s.num_missed),
            str(s.num_false),
            _share(s.num_false_frames, s.num_frames, 2),
            *(format_errors(measure, s.errors[measure]) for measure in ("rise", "run", "width")),
            _ratio(s.num_steps_right, s.num_steps_judged),
            _calibration(s.errors["all"]),
            f"{s.frame_ms:.1f}",
        ]
        for name, s in summaries.items()
    ]
    return format_table(header, rows)


def format_errors(name: str, statistics: ErrorStatistics) -> str:
    """Return mean absolute error, worst and bias of a measure in the table's unit."""
    if statistics.num == 0:
        return "-"
    parts = [_in_unit(name, statistics.mean_abs), _in_unit(name, statistics.worst)]
    return " / ".join([*parts, _in_unit(name, statistics.bias, sign=True)])


def format_real(results: Iterable[RealResult]) -> str:
    """Return one line per real recording and method: estimate (truth) where there is a stairway."""
    header = (
        "recording", "method", "frames", "seen in", "false in", "stairways in the map",
        "rise mm", "run mm", "width mm", "steps", "ms",
    )  # fmt: skip
    rows = []
    for result in results:
        row = [result.recording, result.method, str(result.num_frames), str(result.num_detections)]
        row += [str(result.num_false_frames), _text(result.num_stairways)]
        row += [_beside_truth(result, name, 1e3) for name in ("rise", "run", "width")]
        rows.append([*row, _beside_truth(result, "num_steps", 1), f"{result.frame_ms:.1f}"])
    return format_table(header, rows, num_left=2)


def _beside_truth(result: RealResult, name: str, factor: float) -> str:
    if result.truth is None and result.estimate is None:
        return ""
    truth = (result.truth or {}).get(name)
    estimate = (result.estimate or {}).get(name)
    return f"{_text(estimate, factor)} ({_text(truth, factor)})"


def _text(value: float | None, factor: float = 1) -> str:
    return "-" if value is None else f"{factor * value:.0f}"


def _in_unit(name: str, value: float, *, sign: bool = False) -> str:
    factor, _, decimals = UNITS[name]
    return f"{factor * value:{'+' if sign else ''}.{decimals}f}"


def _calibration(statistics: ErrorStatistics) -> str:
    if statistics.num_with_std == 0:
        return "-"
    return f"{100 * statistics.share_within_1:.0f} % / {100 * statistics.share_within_2:.0f} %"


def _share(count: int, total: int, decimals: int = 0) -> str:
    return f"{100 * count / total:.{decimals}f} %" if total else "-"


def _ratio(count: int, total: int) -> str:
    return f"{count}/{total}" + (f" ({_share(count, total)})" if total else "")


def _number_or_blank(count: int) -> str:
    return str(count) if count else ""
