"""Judge the stairways that a method reports after a drive against the truth of the drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stairmap.evaluation.drift import find_drift_spread, frames_of_flight, move_flight
from stairmap.evaluation.matching import match_flights
from stairmap.evaluation.metrics import FlightErrors, find_errors
from stairmap.evaluation.truth import DriveTruth, TrueFlight
from stairmap.evaluation.verdicts import JudgedVerdict, judge_verdicts
from stairmap.stairway import Flight, Stairway, rounded


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightResult:
    """What became of one true flight.

    Attributes
    ----------
    stairway_id, flight_index, is_optional, must_be_found
        See ``TrueFlight``.
    truth
        True ``rise``, ``run``, ``width`` (m), ``num_risers``, how many were surely and possibly in
        view, and ``near_frames``.
    num_observed_frames
        Frames in which the method observed it.
    drift_spread
        How far the odometry's drift moved it over those frames, standard deviation, m.
    estimate
        The same measures as estimated, with ``left_bounded`` and ``right_bounded``; ``None``: not found.
    estimated_id
        Id of the stairway that the estimate is part of; ``None``: not found.
    errors
        ``None``: not found.
    verdicts
        Whether each robot could climb it, as the estimate says and in truth; none: not found.
    """

    stairway_id: int
    flight_index: int
    is_optional: bool
    must_be_found: bool
    truth: Mapping[str, float]
    num_observed_frames: int
    drift_spread: float
    estimate: Mapping[str, Any] | None
    estimated_id: int | None
    errors: FlightErrors | None
    verdicts: tuple[JudgedVerdict, ...] = ()

    @property
    def is_found(self) -> bool:
        """Whether the method reported it."""
        return self.estimate is not None

    @property
    def is_missed(self) -> bool:
        """Whether it had to be found and was not."""
        return self.must_be_found and not self.is_found


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialJudgement:
    """The true flights with what became of them, and the flights that are not there or reported twice."""

    flights: tuple[FlightResult, ...]
    false_flights: tuple[Mapping[str, Any], ...]


def judge_stairways(
    stairways: Sequence[Stairway], truth: DriveTruth, observed: list[list[int | None]]
) -> TrialJudgement:
    """Judge what a method reports.

    Parameters
    ----------
    stairways
        What it reports, in the odometry's map.
    truth
        The truth of the drive.
    observed
        For each frame, which true flight each observation was of; ``None``: of nothing that is there.
    """
    estimates = [flight for stairway in stairways for flight in stairway.flights]
    ids = [stairway.id for stairway in stairways for _ in stairway.flights]
    frames = [frames_of_flight(observed, index) for index in range(len(truth.flights))]
    drifts = [truth.drifts[chosen] if len(chosen) else truth.drifts for chosen in frames]
    moved = [move_flight(true.flight, drift) for true, drift in zip(truth.flights, drifts, strict=True)]
    matching = match_flights(estimates, moved, optional=[true.is_optional for true in truth.flights])
    row_of = {column: row for row, column in matching.pairs}
    results = []
    for index, true in enumerate(truth.flights):
        row = row_of.get(index)
        estimate = None if row is None else estimates[row]
        results.append(
            FlightResult(
                stairway_id=true.stairway_id,
                flight_index=true.flight_index,
                is_optional=true.is_optional,
                must_be_found=true.must_be_found,
                truth=_describe_truth(true),
                num_observed_frames=len(frames[index]),
                drift_spread=find_drift_spread(true.flight, drifts[index]),
                estimate=None if estimate is None else describe_estimate(estimate),
                estimated_id=None if row is None else ids[row],
                errors=None if estimate is None else find_errors(estimate, true, drifts[index]),
                verdicts=() if estimate is None else judge_verdicts(estimate, true.flight),
            )
        )
    false = [{"reason": "duplicate", **describe_estimate(estimates[row])} for row in matching.duplicates]
    false += [{"reason": "not there", **describe_estimate(estimates[row])} for row in matching.strays]
    return TrialJudgement(flights=tuple(results), false_flights=tuple(false))


def describe_estimate(flight: Flight) -> dict[str, Any]:
    """Return the measures of an estimate for tables and JSON."""
    measures = {name: rounded(getattr(flight, name)) for name in ("rise", "run", "width", "pitch", "heading")}
    return {
        **measures,
        "base": rounded(flight.base),
        "num_risers": flight.num_risers,
        "left_bounded": flight.left_bounded,
        "right_bounded": flight.right_bounded,
    }


def _describe_truth(true: TrueFlight) -> dict[str, float]:
    measures = {name: rounded(getattr(true.flight, name)) for name in ("rise", "run", "width", "pitch")}
    return {
        **measures,
        "num_risers": true.flight.num_risers,
        "num_surely_seen": int(np.count_nonzero(true.surely_seen)),
        "num_possibly_seen": int(np.count_nonzero(true.possibly_seen)),
        "near_frames": true.num_near_frames,
    }
