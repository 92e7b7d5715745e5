"""Where each step of a flight really lies: its own distance and height beside the regular lattice.

Built steps differ. Every observation tells where its steps lie against its own lattice, and each step of
the flight is placed by all of them together. Two things that observations err in are solved for along the
way: an observation's place, which an error of its pose moves freely, and its step (rise or run), by its
stated deviation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.modeling.weighted_means import FRAMES_PER_SAMPLE, SYSTEMATIC_RISE_STD, weighted_mean

IRREGULARITY = (0.008, 0.013)
"""Standard deviations of built nosings about a regular lattice, along and up, m. Surveys of built flights
found up to 11 mm between the runs and 19 mm between the rises of one flight; a rise is the difference of two
nosings, so each nosing has 1/√2 of it."""

UNSTATED_STD = (0.004, 0.003)
"""Standard deviations along and up, m, of an edge whose detector states none: those of the best, so that no
step is pulled to the lattice. Where such edges scatter more, they count for less."""

HUBER = 2.0
"""An edge that is off by more than this many standard deviations pulls no harder than one at that
distance."""

NUM_PASSES = 3
"""How often edges that stand out are weighed anew."""

MEDIAN_TO_STD = 1.4826
"""Standard deviation over the median of absolute values of a normal distribution."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenEdges:
    """The edges of a flight's observations on one axis, along the stairs or up; m.

    Attributes
    ----------
    owner
        (E,) which observation each is of, as a place in ``step_variance``.
    step
        (E,) which step of the flight it is, from 0.
    offset
        (E,) how far it lies from the regular lattice of the flight that begins where its observation's does.
    std
        (E,) its standard deviation; NaN where not stated.
    step_variance
        (N,) variance of each observation's own rise or run, m^2.
    """

    owner: IntArray
    step: IntArray
    offset: Float64Array
    std: Float64Array
    step_variance: Float64Array


def fit_step_offsets(
    edges: SeenEdges, num_steps: int, *, irregularity: float, unstated_std: float
) -> tuple[Float64Array, Float64Array]:
    """Fit how far each step lies from the regular lattice.

    Least squares over ``offset = shift of the observation + error of its step · (step - middle) + offset of
    the step``, with no prior of the shift, the stated one of the observation's step, and the irregularity of
    what is built as that of the offsets. Neighbouring frames err together, so ``FRAMES_PER_SAMPLE`` count
    as one.

    Parameters
    ----------
    edges
        What was seen.
    num_steps
        Number K of the flight's steps.
    irregularity
        Standard deviation of built steps, m.
    unstated_std
        Standard deviation of an edge that states none, m.

    Returns
    -------
    (K,) offsets from the lattice that begins where those of the observations do on average, and their (K,)
    standard deviations against the mean of all steps that were seen, m. A step that nobody saw lies on the
    lattice of the others, with the irregularity as its deviation. Deviations are NaN where no edge of a step
    that was seen states one.
    """
    std = np.where(np.isfinite(edges.std), edges.std, unstated_std)
    is_seen = np.bincount(edges.step, minlength=num_steps) > 0
    states = np.bincount(edges.step, np.isfinite(edges.std), minlength=num_steps) > 0
    num_samples = min(len(edges.step_variance), FRAMES_PER_SAMPLE)
    offsets = np.zeros(num_steps)
    pull = np.ones(len(std))
    scale = 1.0
    for _ in range(NUM_PASSES):
        system = _System(edges, pull / (scale * std) ** 2, num_steps)
        information = system.information / num_samples + np.eye(num_steps) / irregularity**2
        covariance: Float64Array = np.asarray(np.linalg.inv(information), dtype=np.float64)
        offsets = covariance @ (system.gradient / num_samples)
        deviation = np.abs(system.residuals(offsets)) / std
        # Edges that scatter more than they state are less sure than they state.
        scale = max(1.0, MEDIAN_TO_STD * float(np.median(deviation)))
        pull = np.minimum(1.0, HUBER * scale / np.maximum(deviation, 1e-9))
    is_known = states | (~is_seen & states.any())
    return offsets + system.mean_shift(offsets), np.where(is_known, _stds(covariance, is_seen), np.nan)


def _stds(covariance: Float64Array, is_seen: Mask) -> Float64Array:
    """Deviations against the mean of the steps that were seen: where all of them lie is the base's matter."""
    weights = is_seen / np.count_nonzero(is_seen)
    centering = np.eye(len(weights)) - weights
    return np.sqrt(np.diag(centering @ covariance @ centering.T) + SYSTEMATIC_RISE_STD**2)


class _System:
    """Normal equations of the step offsets, shifts and step errors of all observations solved for."""

    def __init__(self, edges: SeenEdges, weights: Float64Array, num_steps: int) -> None:
        self._edges, self._weights = edges, weights
        num = len(edges.step_variance)
        total = np.maximum(np.bincount(edges.owner, weights, num), 1e-12)
        middle = np.bincount(edges.owner, weights * edges.step, num) / total
        self._arm = edges.step - middle[edges.owner]
        self._total = total
        self._lever = np.bincount(edges.owner, weights * self._arm**2, num) + 1.0 / np.maximum(
            edges.step_variance, SYSTEMATIC_RISE_STD**2
        )
        cell = edges.owner * num_steps + edges.step
        size = num * num_steps
        self._shift_part = np.bincount(cell, weights, size).reshape(num, num_steps)
        self._lever_part = np.bincount(cell, weights * self._arm, size).reshape(num, num_steps)
        self.information = (
            np.diag(self._shift_part.sum(axis=0))
            - self._shift_part.T @ (self._shift_part / total[:, None])
            - self._lever_part.T @ (self._lever_part / self._lever[:, None])
        )
        self.gradient = np.bincount(edges.step, weights * self._free_of_observation(edges.offset), num_steps)

    def residuals(self, offsets: Float64Array) -> Float64Array:
        """(E,) what step offsets leave unexplained, with the best shift and step of each observation."""
        return self._free_of_observation(self._edges.offset - offsets[self._edges.step])

    def mean_shift(self, offsets: Float64Array) -> float:
        """How far all edges lie from what step offsets say, m."""
        return weighted_mean(self._edges.offset - offsets[self._edges.step], self._weights)

    def _free_of_observation(self, values: Float64Array) -> Float64Array:
        """(E,) values less the shift and the step error that fit those of their observation best."""
        owner, num = self._edges.owner, len(self._total)
        shift = np.bincount(owner, self._weights * values, num) / self._total
        slope = np.bincount(owner, self._weights * self._arm * values, num) / self._lever
        return np.asarray(values - shift[owner] - slope[owner] * self._arm)
