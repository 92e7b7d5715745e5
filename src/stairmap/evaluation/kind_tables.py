"""Judged views in sum, as one table line for each kind and for each group within it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from stairmap.evaluation.frame_judging import ODD_LIMIT, FrameJudgement
from stairmap.evaluation.table_format import format_table
from stairmap.simulation.kinds import KINDS

RISER_LIMIT = 0.004
"""What the height of a single riser may err by, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureErrors:
    """Errors of one measure over the views in which it was measured, m; NaN where there are none.

    Attributes
    ----------
    num, mean_abs, rms, bias, worst
        How many, and the usual statistics of estimate minus truth.
    num_with_std, share_within_1, share_within_2, num_beyond_3
        Of how many a deviation was stated, the shares of errors within one and two of it, and the number
        beyond three.
    """

    num: int
    mean_abs: float
    rms: float
    bias: float
    worst: float
    num_with_std: int
    share_within_1: float
    share_within_2: float
    num_beyond_3: int


@dataclass(frozen=True, slots=True, kw_only=True)
class KindSummary:
    """Judgements of one kind or group.

    Attributes
    ----------
    num_views, num_clear, num_found, num_right, num_clear_right, num_missed
        Views; those in which the flight has to be found; those in which it was found, and right; clear
        ones that are right, and clear ones in which it was not found.
    num_view_wrong, num_steps_wrong
        Found ones that name the wrong direction or number steps wrongly.
    num_false_frames
        Views with an observation of nothing, or a second one of the flight.
    num_tops_shown, num_tops_found
        Found flights whose top nosing was in view, and those of them that have it.
    num_odd_judged, num_odd_told
        Views of regular and odd flights of which three risers or more were measured, and those told right.
    num_risers_close
        Single risers whose height is right to ``RISER_LIMIT``, of those in ``riser_heights``.
    rise, run, overhang, riser_heights
        Errors of measures over the found ones.
    calibrated
        Rise, run and overhang together: how honest the stated deviations are.
    frame_ms
        Median time per frame, ms.
    """

    num_views: int
    num_clear: int
    num_found: int
    num_right: int
    num_clear_right: int
    num_missed: int
    num_view_wrong: int
    num_steps_wrong: int
    num_false_frames: int
    num_tops_shown: int
    num_tops_found: int
    num_odd_judged: int
    num_odd_told: int
    num_risers_close: int
    rise: MeasureErrors
    run: MeasureErrors
    overhang: MeasureErrors
    riser_heights: MeasureErrors
    calibrated: MeasureErrors
    frame_ms: float

    def to_dict(self) -> dict[str, Any]:
        """Return the summary as JSON types; NaN becomes ``None``."""
        return {
            key: {name: _number(inner) for name, inner in value.items()}
            if isinstance(value, dict)
            else _number(value)
            for key, value in asdict(self).items()
        }


def summarize_views(judgements: Iterable[FrameJudgement]) -> KindSummary:
    """Return the sum of judgements."""
    every = list(judgements)
    found = [judgement for judgement in every if judgement.is_found]
    errors = [judgement.errors for judgement in found if judgement.errors is not None]
    odd = [
        (judgement.has_odd_riser, judgement.errors.largest_oddness > ODD_LIMIT)
        for judgement in found
        if judgement.has_odd_riser is not None
        and judgement.errors is not None
        and np.isfinite(judgement.errors.largest_oddness)
    ]
    pairs = {
        name: (
            [getattr(error, name) for error in errors],
            [getattr(error, f"{name}_std") for error in errors],
        )
        for name in ("rise", "run", "overhang")
    }
    heights = [height for error in errors for height in error.riser_heights]
    height_stds = [std for error in errors for std in error.riser_stds]
    return KindSummary(
        num_views=len(every),
        num_clear=sum(judgement.is_clear for judgement in every),
        num_found=len(found),
        num_right=sum(judgement.is_right for judgement in every),
        num_clear_right=sum(judgement.is_right and judgement.is_clear for judgement in every),
        num_missed=sum(judgement.is_missed for judgement in every),
        num_view_wrong=sum(not judgement.is_view_right for judgement in found),
        num_steps_wrong=sum(not judgement.are_steps_right for judgement in found),
        num_false_frames=sum(judgement.num_false + judgement.num_duplicates > 0 for judgement in every),
        num_tops_shown=sum(judgement.shows_top for judgement in found),
        num_tops_found=sum(judgement.shows_top and judgement.is_top_found for judgement in found),
        num_odd_judged=len(odd),
        num_odd_told=sum(is_odd == is_called_odd for is_odd, is_called_odd in odd),
        num_risers_close=sum(abs(height) <= RISER_LIMIT for height in heights),
        **{name: measure_errors(*pair) for name, pair in pairs.items()},
        riser_heights=measure_errors(heights, height_stds),
        calibrated=measure_errors(
            [error for known, _ in pairs.values() for error in known],
            [std for _, stds in pairs.values() for std in stds],
        ),
        frame_ms=float(np.median([judgement.frame_ms for judgement in every])) if every else float("nan"),
    )


def measure_errors(errors: Sequence[float], stds: Sequence[float]) -> MeasureErrors:
    """Return the statistics of errors, NaN ones left out, with the deviations stated for them."""
    error, std = np.asarray(errors, dtype=np.float64), np.asarray(stds, dtype=np.float64)
    known = error[np.isfinite(error)]
    stated = np.isfinite(error) & np.isfinite(std) & (std > 0)
    scores = np.abs(error[stated]) / std[stated]
    nan = float("nan")
    return MeasureErrors(
        num=len(known),
        mean_abs=float(np.abs(known).mean()) if len(known) else nan,
        rms=float(np.sqrt(np.mean(known**2))) if len(known) else nan,
        bias=float(known.mean()) if len(known) else nan,
        worst=float(np.abs(known).max()) if len(known) else nan,
        num_with_std=len(scores),
        share_within_1=float(np.mean(scores <= 1)) if len(scores) else nan,
        share_within_2=float(np.mean(scores <= 2)) if len(scores) else nan,
        num_beyond_3=int(np.count_nonzero(scores > 3)),
    )


_HEADER = (
    "views", "clear", "found", "right", "right of clear", "missed", "false",
    "view / steps wrong", "top nosing", "rise rms / bias mm", "run rms / bias mm", "overhang rms / bias mm",
    "riser rms mm, ≤ 4 mm", "odd told", "within 1σ / 2σ", "> 3σ", "ms",
)  # fmt: skip


def format_kinds(title: str, judgements: Sequence[FrameJudgement]) -> str:
    """Return a line for each kind, and under it one for each of its groups.

    Of look-alikes, which nobody has to find, only the groups with a false observation have a line.
    """
    rows = []
    for kind, mine in _grouped(judgements, lambda judgement: judgement.kind):
        rows.append(_format_line(kind, summarize_views(mine)))
        groups = [(group, summarize_views(some)) for group, some in _grouped(mine, _group_of)]
        if len(groups) > 1:
            rows += [
                _format_line(f"· {group}", summary)
                for group, summary in groups
                if KINDS[kind].has_stairs or summary.num_false_frames
            ]
    return format_table((title, *_HEADER), rows)


def summarize_kinds(judgements: Sequence[FrameJudgement]) -> dict[str, dict[str, Any]]:
    """Return for each kind its summary and those of its groups, as JSON types."""
    return {
        kind: {
            **summarize_views(mine).to_dict(),
            "groups": {group: summarize_views(some).to_dict() for group, some in _grouped(mine, _group_of)},
        }
        for kind, mine in _grouped(judgements, lambda judgement: judgement.kind)
    }


def _format_line(name: str, s: KindSummary) -> list[str]:
    return [
        name,
        str(s.num_views),
        str(s.num_clear),
        str(s.num_found),
        str(s.num_right),
        f"{100 * s.num_clear_right / s.num_clear:.0f} %" if s.num_clear else "-",
        str(s.num_missed or ""),
        str(s.num_false_frames or ""),
        f"{s.num_view_wrong} / {s.num_steps_wrong}" if s.num_view_wrong + s.num_steps_wrong else "",
        f"{s.num_tops_found}/{s.num_tops_shown}" if s.num_tops_shown else "",
        _two(s.rise),
        _two(s.run),
        _two(s.overhang),
        _risers(s),
        f"{s.num_odd_told}/{s.num_odd_judged}" if s.num_odd_judged else "",
        f"{100 * s.calibrated.share_within_1:.0f} % / {100 * s.calibrated.share_within_2:.0f} %"
        if s.calibrated.num_with_std
        else "-",
        str(s.calibrated.num_beyond_3 or ""),
        f"{s.frame_ms:.1f}",
    ]


def _group_of(judgement: FrameJudgement) -> str:
    return judgement.group


def _risers(s: KindSummary) -> str:
    num = s.riser_heights.num
    return f"{1e3 * s.riser_heights.rms:.1f}, {100 * s.num_risers_close / num:.0f} %" if num else "-"


def _two(errors: MeasureErrors) -> str:
    return f"{1e3 * errors.rms:.1f} / {1e3 * errors.bias:+.1f}" if errors.num else "-"


def _grouped(judgements: Iterable[FrameJudgement], key: Any) -> list[tuple[str, list[FrameJudgement]]]:
    groups: dict[str, list[FrameJudgement]] = {}
    for judgement in judgements:
        groups.setdefault(key(judgement), []).append(judgement)
    return list(groups.items())


def _number(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value
