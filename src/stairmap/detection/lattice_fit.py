"""Least squares over a lattice: by its pixels how its axes are turned, by its nosings where they lie."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray
from stairmap.detection.nosings import PIXELS_PER_SAMPLE, MeasuredNosings
from stairmap.detection.stair_pixels import Membership, StairPixels

RAKE_PRIOR = np.radians(5.0)
"""Standard deviation of the lean of risers, rad: 25 mm over a rise, with which codes end, is 8 degrees."""

SLOPE_PRIOR, NO_SLOPE = np.radians(3.0), np.radians(0.2)
"""Standard deviations of how far treads climb from their nosing, rad: they drain with 1 to 2 %, and
smoothing adds to it; and where they seem to fall."""

MIN_SLOPE = np.radians(0.6)
"""Treads that climb by less are taken for level, rad."""

MIN_VIEW_SLOPE = 1e-3
"""Flattest view of a tread: it lies below the camera."""

EDGE_SHIFT = 3.0
"""Standard deviation of how far a sensor moves the edges of near surfaces outward, working pixels."""

STEP_IRREGULARITY = 0.004
"""Standard deviation of a step's nosing about the lattice, m (FACTS.md section 2: up to 11-19 mm)."""

FLOOR_IRREGULARITY = 0.008
"""The same of the floor before the first step, m: its finish makes the first riser the least regular one."""


def fit_rotation(
    pixels: StairPixels,
    members: Membership,
    noise: float,
    num_nosings: int,
    row_step: int,
    up_std: float,
    *,
    distance: float,
    height: float,
    run: float,
    rise: float,
) -> tuple[float, float, float, Float64Array]:
    """Small angles (tilt, roll, turn) that make treads level and risers square, and their covariance.

    Least squares over z + (tilt + slope)·s + roll·t on treads and s - (tilt + rake)·z + turn·t
    on risers, each about the mean of its own surface, so that no step's height enters. The
    slope that all treads share and the rake that all risers share are unknown too: outdoor treads
    drain, sensors that smooth make ramps of both, and a nosing that overhangs looks like rake.
    No tread falls away from its nosing: without a clear climb the treads tell the tilt.
    """
    information = np.zeros((5, 5))
    gradient = np.zeros(5)
    for chosen, sign in ((members.tread, 1.0), (members.riser, -1.0)):
        if not chosen.any():
            continue
        s, z, t = (
            values[chosen].astype(np.float64) for values in (pixels.forward, pixels.height, pixels.left)
        )
        index = members.index[chosen]
        slope = z / np.maximum(s, 0.1)
        lattice_s = np.asarray(distance + index * run, dtype=np.float64)
        lattice_z = np.asarray(height + index * rise, dtype=np.float64)
        # Where the ray meets the surface, not where it was measured: noise moves both along the ray.
        if sign > 0:
            reached = lattice_z / np.minimum(slope, -MIN_VIEW_SLOPE)
            value, along = z - lattice_z, reached
            spread = noise * reached**2 * np.abs(slope)
        else:
            value, along = s - lattice_s, slope * lattice_s
            spread = noise * lattice_s**2
        weight = row_step / PIXELS_PER_SAMPLE / (spread**2 + 0.003**2)
        value, along, t = (_centered(values, weight, index, num_nosings) for values in (value, along, t))
        design = np.zeros((5, len(t)))
        design[0] = design[4 if sign > 0 else 3] = sign * along
        design[1 if sign > 0 else 2] = t
        information += (design * weight) @ design.T
        gradient += (design * weight) @ value
    for slope_prior in (SLOPE_PRIOR, NO_SLOPE):
        priors = np.array([up_std, up_std, np.radians(10), RAKE_PRIOR, slope_prior])
        covariance = np.linalg.inv(information + np.diag(1.0 / priors**2))
        tilt, roll, turn, _, tread_slope = -covariance @ gradient
        # The design adds the slope to the tilt, so a tread that climbs has a negative one.
        if (tread_slope if run > 0 else -tread_slope) < -MIN_SLOPE:
            break
    return float(tilt), float(roll), float(turn), np.asarray(covariance[:3, :3], dtype=np.float64)


def _centered(values: Float64Array, weight: Float64Array, index: IntArray, num_groups: int) -> Float64Array:
    """Values less the weighted mean of their group."""
    total = np.maximum(np.bincount(index, weight, num_groups), 1e-12)
    return np.asarray(values - (np.bincount(index, weight * values, num_groups) / total)[index])


def fit_lattice(
    nosings: MeasuredNosings,
    distance: float,
    run: float,
    pixel_size: float,
    *,
    first: int = 0,
    lowest: int = 0,
) -> tuple[float, float, float, float, Float64Array, Float64Array] | None:
    """Robust weighted lines through the nosings' distances and heights over their index.

    Where a height is read off an edge of the image, a sensor that fattens edges raises all of them
    by one angle: it is fitted along, within ``EDGE_SHIFT`` of zero. Nosings below ``first`` are left out,
    and what lies below ``lowest`` may be a floor.

    Returns
    -------
    distance, height, run and rise of the lattice, their covariance without what a tilt adds to it, and
    the information on rise and edge shift together, without the prior of the shift.
    """
    rise_information = np.zeros((2, 3))
    covariance = np.zeros((6, 6))
    result = []
    measures = (
        (nosings.height, nosings.height_std, nosings.height_is_end, [3, 0]),
        (nosings.distance, nosings.distance_std, np.zeros_like(nosings.distance_is_end), [2, 1]),
    )
    for value, std, is_end, slots in measures:
        known = first + np.flatnonzero(np.isfinite(value[first:]))
        if len(known) < 2:
            return None
        shift = np.where(is_end[known], np.maximum(distance + known * run, 0.1) * pixel_size, 0.0)
        design = np.stack([np.ones(len(known)), known.astype(np.float64), shift], axis=1)
        irregularity = np.where(known < lowest, FLOOR_IRREGULARITY, STEP_IRREGULARITY)
        variance = std[known] ** 2 + irregularity**2
        weight = 1.0 / variance
        prior = np.diag([0.0, 0.0, 1.0 / EDGE_SHIFT**2])
        # A step that stands out by more than two sigma pulls no harder than one at two (Huber).
        for _ in range(3):
            information = (design.T * weight) @ design + prior
            estimate = np.linalg.solve(information, (design.T * weight) @ value[known])
            residual = np.abs(value[known] - design @ estimate) / np.sqrt(variance)
            weight = np.minimum(1.0, 2.0 / np.maximum(residual, 1e-9)) / variance
        covariance[np.ix_(slots, slots)] = np.linalg.inv(information)[:2, :2]
        if value is nosings.height:
            joint = np.column_stack([information - prior, information @ estimate])
            # The height of nosing 0 is of no interest here: it is marginalised.
            rise_information = joint[1:, 1:] - np.outer(joint[1:, 0], joint[0, 1:]) / joint[0, 0]
        result.append((float(estimate[0]), float(estimate[1])))
    (height, rise), (distance, run) = result
    return distance, height, run, rise, covariance, rise_information
