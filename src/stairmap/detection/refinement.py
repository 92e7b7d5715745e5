"""From a coarse lattice to a measured one, with all pixels and an honest covariance.

Treads say heights, risers say distances. Pixels also say how far the axes are turned:
treads must be level, risers upright and square to the heading. Each step then counts as
one measurement whose error is at least the irregularity of real steps, so that a near
step with many pixels does not outvote the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, Vector
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.lattice import Lattice
from stairmap.detection.nosings import (
    MIN_SURFACE_PIXELS,
    PIXELS_PER_SAMPLE,
    MeasuredNosings,
    measure_nosings,
)
from stairmap.detection.orientation import GIVEN_UP_STD
from stairmap.detection.rise_information import with_rise_variance
from stairmap.detection.stair_pixels import Membership, StairPixels, find_members, gather_pixels
from stairmap.geometry import normalized

RAKE_PRIOR = np.radians(5.0)
"""Standard deviation of the lean of risers, rad: 25 mm over a rise, with which codes end, is 8 degrees."""

SLOPE_PRIOR, NO_SLOPE = np.radians(1.5), np.radians(0.2)
"""Standard deviations of how far treads climb from their nosing, rad: they drain with 1 to 2 %, and
smoothing adds to it; and where they seem to fall."""

MIN_SLOPE = np.radians(0.6)
"""Treads that climb by less are taken for level, rad."""

MAX_PIXELS = (7_000, 12_000)
"""Pixels looked at in the first and the second round: more rows would tell the same steps again."""

MIN_RISER_ROWS = 4
"""Rows of the farthest riser that are kept however many pixels there are."""

STEPS_ASCENDING, STEPS_DESCENDING = (1, 5), (2, 2)
"""Steps below and above those found that are tried, where stairs ascend and descend: far up, few rows of each
riser are left, and too few for the search."""

EDGE_SHIFT = 3.0
"""Standard deviation of how far a sensor moves the edges of near surfaces outward, working pixels."""

STEP_IRREGULARITY = 0.004
"""Standard deviation of a step's nosing about the lattice, m (FACTS.md section 2: up to 11-19 mm)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RefinedLattice:
    """A measured lattice in one frame.

    Attributes
    ----------
    up, forward
        (3,) corrected axes, camera frame.
    distance, height, run, rise
        The lattice, m, as in ``Lattice``.
    covariance
        (6, 6) of (rise, run, distance, height, tilt about the lateral axis, heading).
    rise_information
        (2, 3) see ``StairObservation``.
    found
        First and last index of the nosings that found the lattice; those before and behind were only tried.
    pixels, members
        The pixels in the corrected axes and where they belong; every ``row_step``-th row.
    nosings
        Each nosing as it was measured by itself.
    noise
        Standard deviation of inverse depth of a pixel that was reckoned with, 1/m.
    """

    up: Vector
    forward: Vector
    distance: float
    height: float
    run: float
    rise: float
    covariance: Float64Array
    rise_information: Float64Array
    found: tuple[int, int]
    pixels: StairPixels
    members: Membership
    row_step: int
    nosings: MeasuredNosings
    noise: float


def refine_lattice(
    image: InverseDepthImage,
    lattice: Lattice,
    up: Vector,
    forward: Vector,
    ends: Points,
    *,
    noise: float,
    columns: tuple[int, int],
    up_std: float = GIVEN_UP_STD,
) -> RefinedLattice | None:
    """Fit the lattice and its axes to the pixels of its treads and risers.

    Parameters
    ----------
    image
        Inverse depth of the frame.
    lattice
        Where to start.
    up, forward
        (3,) perpendicular unit vectors, camera frame.
    ends
        (M, 3) nosings seen as jumps in single strips: s, z, t in these axes, m.
    noise
        Standard deviation of inverse depth of a pixel, 1/m.
    columns
        Columns of the working image in which the stairs lie.
    up_std
        Standard deviation of the direction of ``up``, rad.

    Returns
    -------
    The measured lattice, or ``None`` when fewer than two steps keep pixels.
    """
    run, rise = lattice.run, lattice.rise
    num_below, num_above = STEPS_ASCENDING if run > 0 else STEPS_DESCENDING
    distance, height = lattice.distance - num_below * run, lattice.height - num_below * rise
    num_nosings = num_below + int(lattice.indices[-1]) + 1 + num_above
    area = image.camera.height * (columns[1] - columns[0])
    # However many pixels there are, each riser keeps a few rows.
    farthest = max(distance, lattice.distance + (int(lattice.indices[-1]) + 3) * run, 0.3)
    max_row_step = max(1, int(rise * image.camera.fy / farthest / MIN_RISER_ROWS))
    for max_pixels in MAX_PIXELS:
        row_step = min(max(1, -(-area // max_pixels)), max_row_step)
        pixels = gather_pixels(image, up, forward, columns=columns, row_step=row_step)
        members = find_members(
            pixels, distance=distance, height=height, run=run, rise=rise, noise=noise, num_nosings=num_nosings
        )
        if np.count_nonzero(members.tread | members.riser) * row_step < 3 * MIN_SURFACE_PIXELS:
            return None
        tilt, roll, turn, rotation_covariance = _fit_rotation(
            pixels, members, noise, num_nosings, row_step, up_std, ascends=run > 0
        )
        left = np.cross(up, forward)
        new_up = normalized(up + tilt * forward + roll * left)
        turned = forward - tilt * up + turn * left
        forward = normalized(turned - (turned @ new_up) * new_up)
        up = new_up
        pixels = pixels.rotated(tilt, roll, turn)
        rotation = np.array([[1.0, -tilt, turn], [tilt, 1.0, roll], [-turn, -roll, 1.0]])
        ends = ends @ rotation.T
        nosings = measure_nosings(
            pixels,
            members,
            ends,
            distance=distance,
            height=height,
            run=run,
            rise=rise,
            noise=noise,
            num_nosings=num_nosings,
            row_step=row_step,
            pixel_size=1.0 / image.camera.fy,
        )
        fit = _fit_lattice(nosings, distance, run, 1.0 / image.camera.fy)
        if fit is None:
            return None
        distance, height, run, rise, covariance, rise_information = fit
    return RefinedLattice(
        up=up,
        forward=forward,
        distance=distance,
        height=height,
        run=run,
        rise=rise,
        covariance=_with_rotation(covariance, rotation_covariance, run, rise, distance, height),
        rise_information=with_rise_variance(rise_information, run**2 * float(rotation_covariance[0, 0])),
        found=(num_below, num_below + int(lattice.indices[-1])),
        pixels=pixels,
        members=members,
        row_step=row_step,
        nosings=nosings,
        noise=noise,
    )


def _fit_rotation(
    pixels: StairPixels,
    members: Membership,
    noise: float,
    num_nosings: int,
    row_step: int,
    up_std: float,
    *,
    ascends: bool,
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
        spread = noise * s**2 * (np.abs(z) / np.maximum(s, 0.1) if sign > 0 else 1.0)
        weight = row_step / PIXELS_PER_SAMPLE / (spread**2 + 0.003**2)
        s, z, t = (_centered(values, weight, index, num_nosings) for values in (s, z, t))
        value, slope = (z, s) if sign > 0 else (s, z)
        design = np.zeros((5, len(s)))
        design[0] = design[4 if sign > 0 else 3] = sign * slope
        design[1 if sign > 0 else 2] = t
        information += (design * weight) @ design.T
        gradient += (design * weight) @ value
    for slope_prior in (SLOPE_PRIOR, NO_SLOPE):
        priors = np.array([up_std, up_std, np.radians(10), RAKE_PRIOR, slope_prior])
        covariance = np.linalg.inv(information + np.diag(1.0 / priors**2))
        tilt, roll, turn, _, tread_slope = -covariance @ gradient
        # The design adds the slope to the tilt, so a tread that climbs has a negative one.
        if (tread_slope if ascends else -tread_slope) < -MIN_SLOPE:
            break
    return float(tilt), float(roll), float(turn), np.asarray(covariance[:3, :3], dtype=np.float64)


def _centered(values: Float64Array, weight: Float64Array, index: IntArray, num_groups: int) -> Float64Array:
    """Values less the weighted mean of their group."""
    total = np.maximum(np.bincount(index, weight, num_groups), 1e-12)
    return np.asarray(values - (np.bincount(index, weight * values, num_groups) / total)[index])


def _fit_lattice(
    nosings: MeasuredNosings, distance: float, run: float, pixel_size: float
) -> tuple[float, float, float, float, Float64Array, Float64Array] | None:
    """Robust weighted lines through the nosings' distances and heights over their index.

    Where a height is read off an edge of the image, a sensor that fattens edges raises all of them
    by one angle: it is fitted along, within ``EDGE_SHIFT`` of zero.

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
        known = np.flatnonzero(np.isfinite(value))
        if len(known) < 2:
            return None
        shift = np.where(is_end[known], np.maximum(distance + known * run, 0.1) * pixel_size, 0.0)
        design = np.stack([np.ones(len(known)), known.astype(np.float64), shift], axis=1)
        variance = std[known] ** 2 + STEP_IRREGULARITY**2
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


def _with_rotation(
    covariance: Float64Array,
    rotation: Float64Array,
    run: float,
    rise: float,
    distance: float,
    height: float,
) -> Float64Array:
    """Add what the uncertainty of tilt and turn does to the lattice."""
    jacobian = np.zeros((6, 3))
    jacobian[0, 0], jacobian[1, 0] = run, -rise
    jacobian[2, 0], jacobian[3, 0] = -height, distance
    jacobian[4, 0], jacobian[5, 2] = 1.0, 1.0
    return np.asarray(covariance + jacobian @ rotation @ jacobian.T)
