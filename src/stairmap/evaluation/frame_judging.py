"""Judge what a method sees in one frame whose truth is known.

An observation is of the true flight as ``drift.find_observed_flight`` says; one of nothing is false. The
observation of the flight is *right* when it names the view's direction and every step's number, and
measures rise and run within the limits below. Its rise and run are held against the mean over those true
steps that it spans: what a frame shows of an irregular flight is no more than that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from stairmap.arrays import IntArray, Points
from stairmap.detection.observation import StairObservation
from stairmap.evaluation.drift import find_observed_flight
from stairmap.evaluation.matching import MAX_HEADING
from stairmap.simulation.kinds import REGULAR
from stairmap.simulation.views import StepsInView, View
from stairmap.stairway import Flight

MIN_ROWS = 5.0
"""A step shows itself when its tread (from above) or riser (from below) covers so many rows ..."""

MIN_STEPS = 3
"""... and a view is clear when so many steps do; a flight with fewer need not be found."""

FAR_ROWS, FAR_SIGMAS = 8.0, 5.0
"""Rows and standard deviations of depth that the rises of far stairs cover in a clear view."""

RISE_FLOOR, RISE_LIMIT = 0.006, 0.010
"""A right rise errs by less than the larger of the first and three stated deviations, and never by more
than the second, m."""

RISE_STDS = 3.0

RUN_LIMIT = 0.010
"""A right run errs by no more, m."""

STEP_REACH = 0.4
"""An edge is that of a true step within this share of run along the flight and of rise in height."""

ODD_LIMIT = 0.006
"""A frame says that a riser is odd when it differs by more than this from the median of those seen, m:
half of what the odd ones are off by."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameErrors:
    """Errors of the observation of the true flight, estimate minus truth, with stated deviations.

    Attributes
    ----------
    rise, run, overhang, rise_std, run_std, overhang_std
        m; NaN where there is none: an overhang without a deviation was not measured.
    riser_heights, riser_stds
        Errors of single risers between neighbouring edges, and their deviations, m.
    largest_oddness
        Largest deviation of a seen riser from the median of those seen, m; NaN with fewer than three.
    """

    rise: float
    run: float
    overhang: float
    rise_std: float
    run_std: float
    overhang_std: float
    riser_heights: tuple[float, ...]
    riser_stds: tuple[float, ...]
    largest_oddness: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameJudgement:
    """What one method made of one view.

    Attributes
    ----------
    kind, group, index, sensor, width
        Which view.
    num_false, num_duplicates
        Observations of nothing that is there, and further ones of the flight.
    is_clear
        Whether the flight shows enough of itself that it has to be found.
    is_found, is_view_right, are_steps_right, is_right
        Whether the flight was observed; from the right side; with the right step numbers; and all that
        with right measures.
    shows_top, is_top_found
        Whether the top nosing's riser was in view, and whether the observation has that nosing.
    has_odd_riser
        Whether one riser of the flight is odd on purpose, ``None``: not judged.
    errors
        ``None``: not found.
    rejections
        Rules that rejected it where nothing was observed.
    frame_ms
        Processor time of the detector, ms.
    """

    kind: str
    group: str
    index: int
    sensor: str
    width: int
    num_false: int
    num_duplicates: int
    is_clear: bool = False
    is_found: bool = False
    is_view_right: bool = False
    are_steps_right: bool = False
    is_right: bool = False
    shows_top: bool = False
    is_top_found: bool = False
    has_odd_riser: bool | None = None
    errors: FrameErrors | None = None
    rejections: tuple[str, ...] = ()
    frame_ms: float = float("nan")

    @property
    def is_missed(self) -> bool:
        """Whether the flight had to be found and was not."""
        return self.is_clear and not self.is_found

    def to_dict(self) -> dict[str, Any]:
        """Return the judgement as JSON types; NaN becomes ``None``."""
        data: dict[str, Any] = _without_nan(asdict(self))
        return data


def is_clear_view(view: View, seen: StepsInView) -> bool:
    """Tell whether a view shows enough of its flight that it has to be found.

    Three steps show ``MIN_ROWS`` rows each: of their treads when the camera looks down the flight, of
    their risers when it looks up. Of far stairs three rises cover ``FAR_ROWS`` rows and ``FAR_SIGMAS``.
    """
    if view.kind == "far":
        shown = (seen.riser_rows >= FAR_ROWS) & (seen.riser_sigmas >= FAR_SIGMAS)
    else:
        rows = seen.tread_rows if true_view_sign(view) < 0 else seen.riser_rows
        shown = rows >= MIN_ROWS
    return int(np.count_nonzero(shown)) >= MIN_STEPS


def true_view_sign(view: View) -> int:
    """Return 1 for a camera that looks up the flight, -1 for one that looks down it."""
    flight = view.flight
    return 1 if flight is None or float(view.map_from_camera[:3, 2] @ flight.forward) > 0 else -1


def judge_frame(
    index: int, view: View, seen: StepsInView | None, observations: Sequence[StairObservation]
) -> FrameJudgement:
    """Judge the observations of one view.

    Parameters
    ----------
    index
        Number of the view within its kind.
    view, seen
        The view and what it shows of the flight.
    observations
        What the detector says, camera frame.
    """
    flight = view.flight
    flights = () if flight is None else (flight,)
    of_flight = [
        observation
        for observation in observations
        if find_observed_flight(observation, view.map_from_camera, flights) is not None
    ]
    judgement = FrameJudgement(
        kind=view.kind,
        group=view.group,
        index=index,
        sensor=view.sensor.name,
        width=view.camera.width,
        num_false=len(observations) - len(of_flight),
        num_duplicates=max(len(of_flight) - 1, 0),
    )
    if flight is None or seen is None:
        return judgement
    judgement = replace(
        judgement,
        is_clear=is_clear_view(view, seen),
        shows_top=bool(seen.riser_rows[-1] >= MIN_ROWS),
        has_odd_riser=view.group != REGULAR if view.kind == "irregular" else None,
    )
    if not of_flight:
        return judgement
    observation = of_flight[0]
    steps = number_edges(observation, view, flight)
    is_view_right = (observation.view == "ascending") == (true_view_sign(view) > 0)
    forward = view.map_from_camera[:3, :3] @ observation.forward
    is_heading_right = float(forward @ flight.forward) >= np.cos(MAX_HEADING)
    errors = find_frame_errors(observation, view, flight, steps)
    return replace(
        judgement,
        is_found=True,
        is_view_right=is_view_right,
        are_steps_right=steps is not None,
        is_right=is_view_right and steps is not None and is_heading_right and are_measures_right(errors),
        is_top_found=steps is not None and int(steps.max()) >= flight.num_risers - 1,
        errors=errors,
    )


def number_edges(observation: StairObservation, view: View, flight: Flight) -> IntArray | None:
    """Return the number of the true step that each edge is of; ``None`` where the numbering is wrong.

    Right means: every edge lies on a true nosing, neighbours in number are neighbours in truth, and an
    observation that claims to have seen the floor before its first step begins with the first one.
    """
    nosings = np.concatenate(
        [view.spare_below, np.array([step.nosing for step in flight.steps]), view.spare_above]
    )
    true = (nosings.mean(axis=1) - flight.base) @ flight.map_from_flight[:3, :3]
    across = (nosings[:, 0, 2] - nosings[:, 1, 2]) / flight.width
    middles = _map_middles(observation, view)
    local = (middles - flight.base) @ flight.map_from_flight[:3, :3]
    along = np.abs(local[:, None, 0] - true[:, 0]) / (STEP_REACH * flight.run)
    up = np.abs(local[:, None, 2] - true[:, 2] - local[:, None, 1] * across) / (STEP_REACH * flight.rise)
    distance = np.maximum(along, up)
    nearest = distance.argmin(axis=1)
    if (distance.min(axis=1) > 1).any():
        return None
    numbers = nearest - len(view.spare_below)
    shifts = numbers - np.array([edge.step_index for edge in observation.edges])
    if len(set(shifts.tolist())) != 1:
        return None
    if view.ends_are_known and observation.floor_seen and int(shifts[0]) != 0:
        return None
    return np.asarray(numbers, dtype=np.int64)


def find_frame_errors(
    observation: StairObservation, view: View, flight: Flight, steps: IntArray | None
) -> FrameErrors:
    """Return the errors of an observation.

    Parameters
    ----------
    observation, view, flight
        As in ``judge_frame``.
    steps
        Number of the true step of each edge; ``None``: not known, and the whole flight stands for them.
    """
    nan = float("nan")
    covariance = observation.covariance
    rise_std, run_std = np.sqrt(np.diag(covariance)[:2]).tolist() if covariance.shape[0] >= 2 else (nan, nan)
    rise, run = true_measures(view, flight, steps)
    has_overhang = bool(np.isfinite(observation.overhang_std))
    heights, stds, oddness = _judge_risers(observation, view, flight, steps)
    return FrameErrors(
        rise=observation.rise - rise,
        run=observation.run - run,
        overhang=observation.overhang - flight.overhang if has_overhang else nan,
        rise_std=float(rise_std),
        run_std=float(run_std),
        overhang_std=observation.overhang_std,
        riser_heights=tuple(heights),
        riser_stds=tuple(stds),
        largest_oddness=oddness,
    )


def true_measures(view: View, flight: Flight, steps: IntArray | None) -> tuple[float, float]:
    """Return mean rise and run of the true steps that an observation spans, m."""
    if steps is None or len(steps) < 2 or steps.max() == steps.min():
        return flight.rise, flight.run
    nosings = _all_nosings(view, flight)
    low, high = (nosings[int(number) + len(view.spare_below)] for number in (steps.min(), steps.max()))
    num = float(steps.max() - steps.min())
    return float(high[2] - low[2]) / num, float((high - low) @ flight.forward) / num


def are_measures_right(errors: FrameErrors) -> bool:
    """Tell whether rise and run are within the limits of the module."""
    stated = RISE_STDS * errors.rise_std if np.isfinite(errors.rise_std) else 0.0
    rise_limit = min(max(RISE_FLOOR, stated), RISE_LIMIT)
    return abs(errors.rise) <= rise_limit and abs(errors.run) <= RUN_LIMIT


def _judge_risers(
    observation: StairObservation, view: View, flight: Flight, steps: IntArray | None
) -> tuple[list[float], list[float], float]:
    """Return errors and deviations of the risers between neighbouring edges, and the largest oddness."""
    if steps is None:
        return [], [], float("nan")
    nosings = _all_nosings(view, flight)
    # By the observation's own up: what the frame alone says.
    heights = np.array([edge.nosing.mean(axis=0) for edge in observation.edges]) @ observation.up
    order = np.argsort(steps)
    measured, errors, stds = [], [], []
    for lower, upper in pairwise(order):
        if steps[upper] - steps[lower] != 1:
            continue
        low, high = (nosings[int(steps[index]) + len(view.spare_below)] for index in (lower, upper))
        measured.append(float(heights[upper] - heights[lower]))
        errors.append(measured[-1] - float(high[2] - low[2]))
        stds.append(float(np.hypot(observation.edges[lower].std[1], observation.edges[upper].std[1])))
    oddness = float("nan")
    if len(measured) >= MIN_STEPS:
        oddness = float(np.abs(np.array(measured) - np.median(measured)).max())
    return errors, stds, oddness


def _all_nosings(view: View, flight: Flight) -> Points:
    """(N, 3) middles of the true nosings, spare ones included."""
    steps = np.array([step.nosing for step in flight.steps])
    return np.asarray(np.concatenate([view.spare_below, steps, view.spare_above]).mean(axis=1))


def _map_middles(observation: StairObservation, view: View) -> Points:
    middles = np.array([edge.nosing.mean(axis=0) for edge in observation.edges])
    pose = view.map_from_camera
    return np.asarray(middles @ pose[:3, :3].T + pose[:3, 3])


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_without_nan(inner) for inner in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
