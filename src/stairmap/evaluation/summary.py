"""Results of many trials in sum."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from stairmap.evaluation.metrics import CALIBRATED, MEASURES
from stairmap.evaluation.trials import TrialResult
from stairmap.evaluation.verdicts import VerdictCounts, count_verdicts


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorStatistics:
    """Errors of one measure over all matched flights, m or rad; NaN where there are none.

    Attributes
    ----------
    num
        Number of flights of which it could be judged.
    mean_abs, worst, bias
        Mean and largest absolute error, and mean error.
    num_with_std, share_within_1, share_within_2
        Of how many a standard deviation was stated, and the share of their errors within one and
        two of it; 0.68 and 0.95 are honest.
    """

    num: int
    mean_abs: float
    worst: float
    bias: float
    num_with_std: int
    share_within_1: float
    share_within_2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """Results of one method over trials.

    Attributes
    ----------
    num_trials, num_crashed
        Trials, and those that came to no end.
    num_required, num_found, num_missed
        True flights that had to be found, those of them that were, and were not.
    num_extra
        True flights found though they need not be, optional ones left out.
    num_false, num_duplicates
        Flights reported that are not there, and those reported a second time.
    num_frames, num_detections, num_false_frames, num_observations
        Sums over the trials.
    errors
        Statistics of each of ``MEASURES``, and ``all`` for the calibration of all of them together.
    num_steps_right, num_steps_judged
        Matched flights with every step surely in view and no other.
    num_risers_right, num_risers_judged
        The same for ``num_risers`` of flights that were whole in view.
    num_joined_right, num_joined_judged
        True stairways of which at least two flights were found, and those of them whose found flights
        all are in one estimated stairway that holds no flight of another.
    verdicts
        How what was said of robots on the matched flights turned out.
    frame_ms, mean_frame_ms, query_ms
        Median over trials of the median time per frame; mean time per frame over all frames;
        mean time of the query, ms.
    """

    num_trials: int
    num_crashed: int
    num_required: int
    num_found: int
    num_missed: int
    num_extra: int
    num_false: int
    num_duplicates: int
    num_frames: int
    num_detections: int
    num_false_frames: int
    num_observations: int
    errors: dict[str, ErrorStatistics]
    num_steps_right: int
    num_steps_judged: int
    num_risers_right: int
    num_risers_judged: int
    num_joined_right: int
    num_joined_judged: int
    verdicts: VerdictCounts
    frame_ms: float
    mean_frame_ms: float
    query_ms: float

    def to_dict(self) -> dict[str, Any]:
        """Return the summary as JSON types; NaN becomes ``None``."""
        data = asdict(self)
        data["errors"] = {
            name: {key: _number(value) for key, value in statistics.items()}
            for name, statistics in data["errors"].items()
        }
        return {key: _number(value) for key, value in data.items()}


def summarize(results: Iterable[TrialResult]) -> Summary:
    """Return the sum of results, of one method."""
    every = list(results)
    ended = [result for result in every if result.crash is None]
    flights = [flight for result in ended for flight in result.flights]
    false = [entry["reason"] for result in ended for entry in result.false_flights]
    judged = [flight.errors for flight in flights if flight.errors is not None and not flight.is_optional]
    risers = [errors.num_risers_right for errors in judged if errors.num_risers_right is not None]
    joined = [is_right for result in ended for is_right in _find_joined(result)]
    num_frames = sum(result.num_frames for result in ended)
    statistics = {
        name: estimate_statistics(
            [errors.errors[name] for errors in judged],
            [errors.stds.get(name, float("nan")) for errors in judged],
        )
        for name in MEASURES
    }
    statistics["all"] = estimate_statistics(
        [errors.errors[name] for errors in judged for name in CALIBRATED],
        [errors.stds[name] for errors in judged for name in CALIBRATED],
    )
    return Summary(
        num_trials=len(every),
        num_crashed=len(every) - len(ended),
        num_required=sum(flight.must_be_found for flight in flights),
        num_found=sum(flight.must_be_found and flight.is_found for flight in flights),
        num_missed=sum(flight.is_missed for flight in flights),
        num_extra=sum(
            flight.is_found and not flight.must_be_found and not flight.is_optional for flight in flights
        ),
        num_false=len(false),
        num_duplicates=false.count("duplicate"),
        num_frames=num_frames,
        num_detections=sum(result.num_detections for result in ended),
        num_false_frames=sum(result.num_false_frames for result in ended),
        num_observations=sum(result.num_observations for result in ended),
        errors=statistics,
        num_steps_right=sum(errors.num_steps_right for errors in judged),
        num_steps_judged=len(judged),
        num_risers_right=sum(risers),
        num_risers_judged=len(risers),
        num_joined_right=sum(joined),
        num_joined_judged=len(joined),
        verdicts=count_verdicts(
            verdict for flight in flights if not flight.is_optional for verdict in flight.verdicts
        ),
        frame_ms=_mean([float(np.median([result.frame_ms for result in ended]))]) if ended else np.nan,
        mean_frame_ms=_mean([result.mean_frame_ms for result in ended for _ in range(result.num_frames)]),
        query_ms=_mean([result.query_ms for result in ended]),
    )


def estimate_statistics(errors: Sequence[float], stds: Sequence[float]) -> ErrorStatistics:
    """Return the statistics of errors, NaN ones left out, with the deviations stated for them."""
    error, std = np.asarray(errors, dtype=np.float64), np.asarray(stds, dtype=np.float64)
    known = error[~np.isnan(error)]
    stated = ~np.isnan(error) & ~np.isnan(std)
    scores = np.abs(error[stated]) / std[stated]
    return ErrorStatistics(
        num=len(known),
        mean_abs=_mean(np.abs(known)),
        worst=float(np.abs(known).max()) if len(known) else float("nan"),
        bias=_mean(known),
        num_with_std=len(scores),
        share_within_1=_mean(scores <= 1),
        share_within_2=_mean(scores <= 2),
    )


def group_results(
    results: Iterable[TrialResult], key: Callable[[TrialResult], str]
) -> dict[str, list[TrialResult]]:
    """Return results by what ``key`` says of them, in the order of their first appearance."""
    groups: dict[str, list[TrialResult]] = {}
    for result in results:
        groups.setdefault(key(result), []).append(result)
    return groups


def _find_joined(result: TrialResult) -> list[bool]:
    """Tell for each true stairway with several found flights whether they are one estimated stairway."""
    parts: dict[int, list[int]] = {}
    for flight in result.flights:
        if flight.estimated_id is not None:
            parts.setdefault(flight.stairway_id, []).append(flight.estimated_id)
    return [
        len(set(ids)) == 1
        and not any(ids[0] in other for other_id, other in parts.items() if other_id != stairway_id)
        for stairway_id, ids in parts.items()
        if len(ids) > 1
    ]


def _mean(values: Any) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _number(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value
