"""How far an estimated flight is from the truth, in its measures and in units of its stated deviation.

All errors are estimate minus truth, SI units. ``width`` is judged when both sides are bounded in the
estimate; a width with an unbounded side is a lower bound and stands apart as ``open_width``.
``across``, ``along`` and ``up`` are the base's error in the axes of the true flight; ``across`` also needs
both sides, because an unseen end moves the middle. They are taken against the mean drift over the frames
of the flight. A method may weight these frames as it likes, so ``place`` also tells the horizontal
distance of the base from the nearest place that the drift moved it to in any of them: what no weighting
explains. ``overhang`` is NaN where the estimate or the truth does not know it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Vector
from stairmap.evaluation.drift import move_flight
from stairmap.evaluation.truth import TrueFlight
from stairmap.geometry import wrapped_angle
from stairmap.stairway import Flight

CALIBRATED = ("rise", "run", "width", "pitch", "heading", "across", "along", "up", "overhang")
"""Measures for which a standard deviation is stated."""

MEASURES = (*CALIBRATED, "place", "open_width")
"""What is judged, in the order of the tables."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightErrors:
    """Errors of one matched flight.

    Attributes
    ----------
    errors
        Estimate minus truth for each of ``MEASURES``, m and rad; NaN where it cannot be judged.
    stds
        Standard deviation that the estimate states for each of ``CALIBRATED``; NaN where it states none.
    lowest_step
        Which true step the estimate takes for its first: 0 is right, negative one that is not there.
    num_steps_right
        Whether every step surely seen is there, and none that was never in view. One step beyond
        those in view is no error: its riser or tread is seen before its nosing.
    num_risers_right
        Whether ``num_risers`` is the true one; ``None`` unless the whole flight was in view.
    """

    errors: Mapping[str, float]
    stds: Mapping[str, float]
    lowest_step: int
    num_steps_right: bool
    num_risers_right: bool | None


def find_errors(estimate: Flight, truth: TrueFlight, drifts: Float64Array) -> FlightErrors:
    """Return the errors of an estimate.

    The base is judged where the estimate has it: if the lowest true step was surely seen, against the
    true base; otherwise against the foot of the true step that its first step lies on, because the
    number of steps that nobody saw cannot be known.

    Parameters
    ----------
    estimate
        Estimated flight in the odometry's map.
    truth
        The true flight and how it was seen.
    drifts
        (N, 4, 4) drifts of the frames in which the flight was observed.
    """
    moved = move_flight(truth.flight, drifts)
    rotation = moved.map_from_flight[:3, :3]
    lowest_step = _find_lowest_step(estimate, moved, rotation)
    foot = moved.base
    if not truth.surely_seen[0] and 0 < lowest_step < len(moved.steps):
        foot = moved.steps[lowest_step].nosing.mean(axis=0) - [0.0, 0.0, moved.rise]
    offset = (estimate.base - foot) @ rotation
    is_bounded = estimate.left_bounded and estimate.right_bounded
    errors = {
        "rise": estimate.rise - moved.rise,
        "run": estimate.run - moved.run,
        "width": estimate.width - moved.width if is_bounded else np.nan,
        "pitch": estimate.pitch - moved.pitch,
        "heading": wrapped_angle(estimate.heading - moved.heading),
        "across": offset[1] if is_bounded else np.nan,
        "along": offset[0],
        "up": offset[2],
        "overhang": estimate.overhang - moved.overhang,
        "place": _find_distance(estimate, foot - moved.base, truth.flight, drifts, is_bounded=is_bounded),
        "open_width": np.nan if is_bounded else estimate.width - moved.width,
    }
    seen = np.arange(lowest_step, lowest_step + estimate.num_risers)
    sure, possible = np.flatnonzero(truth.surely_seen), np.flatnonzero(truth.possibly_seen)
    right = estimate.num_risers == moved.num_risers if truth.is_whole_in_view else None
    return FlightErrors(
        errors={name: float(value) for name, value in errors.items()},
        stds=_stated_stds(estimate, rotation),
        lowest_step=lowest_step,
        num_steps_right=bool(
            np.isin(sure, seen).all() and np.isin(seen, _with_neighbours(possible, moved.num_risers)).all()
        ),
        num_risers_right=right,
    )


def _find_lowest_step(estimate: Flight, moved: Flight, rotation: Float64Array) -> int:
    """Return the number of the true step on which the estimate's first step lies.

    The place along the slope tells: its deviation in height and in distance count alike.
    """
    local = (estimate.edges()[0].mean(axis=0) - moved.base) @ rotation
    slope = np.array([moved.run, moved.rise])
    return round(float(np.array([local[0], local[2] - moved.rise]) @ slope / (slope @ slope)))


def _find_distance(
    estimate: Flight, step: Vector, true: Flight, drifts: Float64Array, *, is_bounded: bool
) -> float:
    """Return the horizontal distance of an estimate's base from the nearest of all drifted ones.

    ``step`` leads from the true base to the foot of the step that the estimate begins with; without both
    sides only the distance along the flight is known.
    """
    bases = drifts[:, :3, :3] @ true.base + drifts[:, :3, 3] + step
    offsets = (estimate.base - bases) @ estimate.map_from_flight[:3, :2]
    if not is_bounded:
        return float(np.abs(offsets[:, 0]).min())
    return float(np.hypot(offsets[:, 0], offsets[:, 1]).min())


def _with_neighbours(indices: IntArray, num_risers: int) -> IntArray:
    """Return all steps from one before the first to one behind the last: obstacles hide some between."""
    if len(indices) == 0:
        return indices
    return np.arange(max(indices[0] - 1, 0), min(indices[-1] + 2, num_risers))


def _stated_stds(estimate: Flight, rotation: Float64Array) -> dict[str, float]:
    std = estimate.std
    base = np.sqrt((rotation.T**2) @ np.asarray(std.base) ** 2)
    stated = {
        "rise": std.rise, "run": std.run, "width": std.width, "pitch": std.pitch, "heading": std.heading,
        "along": base[0], "across": base[1], "up": base[2], "overhang": std.overhang,
    }  # fmt: skip
    return {
        name: float(stated[name]) if np.isfinite(stated[name]) and stated[name] > 0 else float("nan")
        for name in CALIBRATED
    }
