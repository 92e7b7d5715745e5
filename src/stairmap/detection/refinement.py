"""From a coarse lattice to a measured one, with all pixels and an honest covariance.

Treads say heights, risers say distances. Pixels also say how far the axes are turned:
treads must be level, risers upright and square to the heading. Each step then counts as
one measurement whose error is at least the irregularity of real steps, so that a near
step with many pixels does not outvote the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Points, Vector
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.lattice import Lattice
from stairmap.detection.lattice_fit import fit_lattice, fit_rotation
from stairmap.detection.ledges import MAX_THICKNESS
from stairmap.detection.nosings import (
    MIN_SURFACE_PIXELS,
    MeasuredNosings,
    measure_nosings,
)
from stairmap.detection.orientation import GIVEN_UP_STD
from stairmap.detection.rise_information import with_rise_variance
from stairmap.detection.stair_pixels import Membership, StairPixels, find_members, gather_pixels
from stairmap.detection.tread_ends import find_tread_ends
from stairmap.geometry import cross, normalized

MAX_PIXELS = (7_000, 12_000)
"""Pixels looked at in the first and the second round: more rows would tell the same steps again."""

MIN_STEP_ROWS = 4
"""Rows of the farthest riser, or of the farthest tread of stairs that descend, that are kept however many
pixels there are."""

STEPS_ASCENDING, STEPS_DESCENDING = (1, 8), (6, 2)
"""Steps below and above those found that are tried, where stairs ascend and descend: far up, few rows of each
riser are left, and far down of each tread, and too few for the search."""

MAX_FITTED_BELOW = 2
"""Of the steps tried below those found, so many are measured: farther down the edge of the tread above, which
a sensor fattens, hides too much of a tread to tell its height."""


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
    is_open
        Whether it was found by ledges: its risers are open, and their pixels the fronts of slabs.
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
    is_open: bool


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
    is_open: bool = False,
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
    is_open
        Whether the risers are open: what is seen of them are the fronts of slabs.

    Returns
    -------
    The measured lattice, or ``None`` when fewer than two steps keep pixels.
    """
    run, rise = lattice.run, lattice.rise
    num_below, num_above = STEPS_ASCENDING if run > 0 else STEPS_DESCENDING
    distance, height = lattice.distance - num_below * run, lattice.height - num_below * rise
    num_nosings = num_below + int(lattice.indices[-1]) + 1 + num_above
    area = image.camera.height * (columns[1] - columns[0])
    # However many pixels there are, each step keeps a few rows.
    max_row_step = max(1, int(_rows_of_smallest_step(lattice, image.camera.fy) / MIN_STEP_ROWS))
    first_fitted = max(num_below - MAX_FITTED_BELOW, 0)
    for max_pixels in MAX_PIXELS:
        row_step = min(max(1, -(-area // max_pixels)), max_row_step)
        pixels = gather_pixels(image, up, forward, columns=columns, row_step=row_step)
        members = find_members(
            pixels,
            distance=distance,
            height=height,
            run=run,
            rise=rise,
            noise=noise,
            num_nosings=num_nosings,
            slab_thickness=MAX_THICKNESS if is_open else None,
        )
        if np.count_nonzero(members.tread | members.riser) * row_step < 3 * MIN_SURFACE_PIXELS:
            return None
        tilt, roll, turn, rotation_covariance = fit_rotation(
            pixels,
            members.from_step(first_fitted),
            noise,
            num_nosings,
            row_step,
            up_std,
            distance=distance,
            height=height,
            run=run,
            rise=rise,
        )
        left = cross(up, forward)
        new_up = normalized(up + tilt * forward + roll * left)
        turned = forward - tilt * up + turn * left
        forward = normalized(turned - (turned @ new_up) * new_up)
        up = new_up
        pixels = pixels.rotated(tilt, roll, turn)
        rotation = np.array([[1.0, -tilt, turn], [tilt, 1.0, roll], [-turn, -roll, 1.0]])
        ends = ends @ rotation.T
        tread_ends = np.zeros((0, 3))
        if run < 0:
            tread_ends = find_tread_ends(
                pixels,
                distance=distance,
                height=height,
                run=run,
                rise=rise,
                num_nosings=num_nosings,
                row_step=row_step,
                pixel_size=1.0 / image.camera.fy,
            )
        nosings = measure_nosings(
            pixels,
            members,
            ends,
            tread_ends,
            distance=distance,
            height=height,
            run=run,
            rise=rise,
            noise=noise,
            num_nosings=num_nosings,
            row_step=row_step,
            pixel_size=1.0 / image.camera.fy,
            is_open=is_open,
        )
        fit = fit_lattice(
            nosings,
            distance,
            run,
            1.0 / image.camera.fy,
            first=first_fitted,
            lowest=num_below if run > 0 else 0,
        )
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
        is_open=is_open,
    )


def _rows_of_smallest_step(lattice: Lattice, focal_length: float) -> float:
    """Rows in which the farthest step to be measured shows: its riser, or its tread seen from above."""
    if lattice.run > 0:
        farthest = lattice.distance + (int(lattice.indices[-1]) + 3) * lattice.run
        return lattice.rise * focal_length / max(farthest, 0.3)
    # Between the lines of sight over two nosings lies what the upper one leaves of the lower tread.
    lower, upper = (
        (lattice.height + k * lattice.rise) / max(lattice.distance + k * lattice.run, 0.3) for k in (-1, 0)
    )
    return abs(upper - lower) * focal_length


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
