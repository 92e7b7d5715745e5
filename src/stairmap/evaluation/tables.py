"""Results as Markdown tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from stairmap.evaluation.metrics import MEASURES
from stairmap.evaluation.summary import ErrorStatistics, Summary
from stairmap.evaluation.trials import TrialResult

UNITS: dict[str, tuple[float, str, int]] = {
    **{name: (1e3, "mm", 1) for name in MEASURES},
    "pitch": (float(np.degrees(1)), "°", 2),
    "heading": (float(np.degrees(1)), "°", 2),
}
"""Factor, unit and decimals in which each measure is printed."""

_TRIAL_HEADER = (
    "scene", "sensor", "robot", "seed", "method", "found", "missed", "false", "seen in", "false in",
    "rise mm", "run mm", "width mm", "pitch °", "heading °", "across mm", "along mm", "up mm", "drift mm", "steps", "ms",
)  # fmt: skip


def format_table(header: Sequence[str], rows: Iterable[Sequence[str]], *, num_left: int = 1) -> str:
    """Return a Markdown table; the first ``num_left`` columns are aligned to the left."""
    lines = [list(header), *(list(row) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    texts = [
        "| "
        + " | ".join(
            cell.ljust(width) if column < num_left else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        + " |"
        for line in lines
    ]
    rule = [
        "-" * width if column < num_left else "-" * (width - 1) + ":" for column, width in enumerate(widths)
    ]
    return "\n".join([texts[0], "| " + " | ".join(rule) + " |", *texts[1:]])


def format_trials(results: Iterable[TrialResult]) -> str:
    """Return one line per trial and method; where several flights were found, the largest errors.

    ``found`` is of those that had to be found, ``+1`` one more; ``seen in`` and ``false in`` are
    frames with an observation and with one of nothing; ``steps`` is estimated / true (in view).
    """
    return format_table(_TRIAL_HEADER, [format_trial(result) for result in results], num_left=5)


def format_trial(result: TrialResult) -> list[str]:
    """Return the cells of one line; see ``format_trials``."""
    spec = result.spec
    camera = spec.sensor if spec.width is None else f"{spec.sensor} {spec.width}"
    cells = [spec.scene, camera, spec.robot, str(spec.seed), result.method]
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
        [
            "frames with a false one",
            *(
                f"{s.num_false_frames} ({_share(s.num_false_frames, s.num_frames, 2)})"
                for s in summaries.values()
            ),
        ],
    ]
    for name in MEASURES:
        rows.append([f"{name}: mean abs / worst / bias, {UNITS[name][1]}"])
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
    for name in (*MEASURES, "all"):
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
