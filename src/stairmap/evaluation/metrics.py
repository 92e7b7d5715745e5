"""How far an estimated flight is from the truth, in its measures and in units of its stated deviation.

All errors are estimate minus truth, SI units. ``width`` is judged when both sides are bounded in the
estimate: a width with an unbounded side is a lower bound, not a measurement. ``across``, ``along`` and
``up`` are the base's error in the axes of the true flight; ``across`` also needs both sides, because an
unseen end moves the middle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray
from stairmap.evaluation.truth import TrueFlight
from stairmap.geometry import wrapped_angle
from stairmap.stairway import Flight

MEASURES = ("rise", "run", "width", "pitch", "heading", "across", "along", "up")
"""What is judged, in the order of the tables."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightErrors:
    """Errors of one matched flight.

    Attributes
    ----------
    errors
        Estimate minus truth for each of ``MEASURES``, m and rad; NaN where it cannot be judged.
    stds
        Standard deviation that the estimate states for each; NaN where it states none.
    lowest_step
        Which true step the estimate takes for its first: 0 is right, negative one that is not there.
    num_steps_right
        Whether every step surely seen is there and none that was never in view.
    num_risers_right
        Whether ``num_risers`` is the true one; ``None`` unless the whole flight was in view.
    """

    errors: Mapping[str, float]
    stds: Mapping[str, float]
    lowest_step: int
    num_steps_right: bool
    num_risers_right: bool | None


def find_errors(estimate: Flight, truth: TrueFlight, moved: Flight) -> FlightErrors:
    """Return the errors of an estimate.

    The base is judged where the estimate has it: if the lowest true step was in view, against the
    true base; otherwise against the foot of the true step that its first step lies on, because the
    number of steps that nobody saw cannot be known.

    Parameters
    ----------
    estimate
        Estimated flight in the odometry's map.
    truth
        The true flight and how it was seen.
    moved
        The true flight moved into the odometry's map.
    """
    rotation = moved.map_from_flight[:3, :3]
    lowest_step = _find_lowest_step(estimate, moved, rotation)
    foot = moved.base
    if not truth.possibly_seen[0] and 0 < lowest_step < len(moved.steps):
        foot = moved.steps[lowest_step].nosing.mean(axis=0) - [0.0, 0.0, moved.rise]
    across_first = (estimate.base - foot) @ rotation
    is_bounded = estimate.left_bounded and estimate.right_bounded
    errors = {
        "rise": estimate.rise - moved.rise,
        "run": estimate.run - moved.run,
        "width": estimate.width - moved.width if is_bounded else np.nan,
        "pitch": estimate.pitch - moved.pitch,
        "heading": wrapped_angle(estimate.heading - moved.heading),
        "across": across_first[1] if is_bounded else np.nan,
        "along": across_first[0],
        "up": across_first[2],
    }
    seen = np.arange(lowest_step, lowest_step + estimate.num_risers)
    sure, possible = np.flatnonzero(truth.surely_seen), np.flatnonzero(truth.possibly_seen)
    right = estimate.num_risers == moved.num_risers if truth.is_whole_in_view else None
    return FlightErrors(
        errors={name: float(value) for name, value in errors.items()},
        stds=_stated_stds(estimate, rotation),
        lowest_step=lowest_step,
        num_steps_right=bool(np.isin(sure, seen).all() and np.isin(seen, _filled(possible)).all()),
        num_risers_right=right,
    )


def _find_lowest_step(estimate: Flight, moved: Flight, rotation: Float64Array) -> int:
    """Return the number of the true step on which the estimate's first step lies.

    The place along the slope tells: its deviation in height and in distance count alike.
    """
    local = (estimate.edges()[0].mean(axis=0) - moved.base) @ rotation
    slope = np.array([moved.run, moved.rise])
    return round(float(np.array([local[0], local[2] - moved.rise]) @ slope / (slope @ slope)))


def _filled(indices: IntArray) -> IntArray:
    """Return all numbers from the first to the last index: what an obstacle hides lies between."""
    return np.arange(indices[0], indices[-1] + 1) if len(indices) else indices


def _stated_stds(estimate: Flight, rotation: Float64Array) -> dict[str, float]:
    std = estimate.std
    base = np.sqrt((rotation.T**2) @ np.asarray(std.base) ** 2)
    stated = {
        "rise": std.rise, "run": std.run, "width": std.width, "pitch": std.pitch, "heading": std.heading,
        "along": base[0], "across": base[1], "up": base[2],
    }  # fmt: skip
    return {
        name: float(stated[name]) if np.isfinite(stated[name]) and stated[name] > 0 else float("nan")
        for name in MEASURES
    }
