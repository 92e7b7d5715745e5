"""Fit a stair profile to the rays of one frame.

Every ray says at which inverse forward distance Q = 1/s it met something. A profile predicts it, with its
derivatives, so robust Gauss-Newton adjusts the profile, how far the axes are turned, and the sensor's shift
of edges together, until rays and prediction agree. Each step also gets its own place, held to the regular one
by the irregularity of built stairs, so that an odd step neither pulls the others nor is pulled by them. The
covariance is the inverse of the same equations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Vector, readonly
from stairmap.detection.elevation import Elevation
from stairmap.detection.profile import (
    MIN_FORWARD,
    PIECE_KINDS,
    ROWS_PER_ENTRY,
    Optics,
    Prediction,
    StairProfile,
    edge_optics,
    outline_of,
    section_limits,
    tabulate,
)
from stairmap.geometry import normalized
from stairmap.kernels import fit_section, turn_rays
from stairmap.kernels.equations import EquationLimits, RayArrays
from stairmap.kernels.section_fits import (
    DISTANCE,
    GROUND,
    HEIGHT,
    NUM_VALUES,
    OVERHANG,
    RAKE,
    RISE,
    ROLL,
    RUN,
    SHIFT,
    SLOPE,
    THICKNESS,
    TILT,
    TURN,
    FitLimits,
)

OVERHANG_STD = 0.03
"""Codes allow overhangs of up to 32 mm (IBC), m."""

BLENDED_SHARE = 0.5
"""Share of what a sensor blends, at the nearest step, that the overhang may be off by."""

THICKNESS_STD = 0.010
"""Fronts of treads are 20 to 50 mm thick about ``USUAL_THICKNESS``, m."""

RAKE_STD, BACK_RAKE_STD = 0.02, 0.004
"""Risers lean over their foot by little more than a degree, what leans more is mostly an overhang, and hardly
ever away from it, m per m."""

GROUND_STD = 0.02
"""Of the ground's slope against what the normals told, m per m: it is measured together with up's tilt."""

SLOPE_STD = 0.008
"""Treads drain with 1 to 2 % against the ground, most not at all, m per m."""

EDGE_SHIFT_STD = 2.0
"""Sensors that match windows move edges outward by up to half a window: standard deviation, rows."""

TURN_STD = np.radians(10.0)
"""The heading is known from normals or lines to a few degrees, rad."""

STEP_IRREGULARITY = 0.004
"""Standard deviation of a riser's height, or of the run to the next one, about that of the flight, m; surveys
of flights found up to 11 (tread) and 19 mm (rise), which the tails allow for."""

FLOOR_IRREGULARITY = 0.008
"""The same of the first riser, m: the floor's finish makes it the least regular one."""

STEP_TAIL = 1.0
"""A riser or a run that is off by more standard deviations than this is held ever less: one that was built
differently lifts all above it and says nothing of the others."""

STEP_PLACE_STD = 0.006
"""Standard deviation of a step's place about the regular one, m: builders mark out the whole flight, so that
errors of single risers do not add up for long."""

TAIL = 2.0
"""Beyond this many standard deviations a ray, or a step's place, pulls ever less."""

SURFACE_STD = 0.0015
"""Carpets, worn and uneven treads: how far a surface lies off its plane, m."""

COARSE_STDS = (0.030, 0.010, 0.004)
"""In the first rounds the profile itself may be this wrong, m: rays farther off still pull."""

FINE_STDS = (0.006, 0.0, 0.0)
"""The same in the rounds in which each step has its own place, m: a step that is twice as far off still pulls
before the last."""

RAYS_PER_SAMPLE = 6.0
"""Neighbouring rays err together: this many count as one independent sample."""

MIN_NOISE = 1e-4
"""No sensor knows inverse distance better, 1/m: a tenth of a millimetre at a metre."""

NOISE_BAND = 0.04
"""Rays within this of a surface tell the noise, m: what stands farther off is something else."""

PLAIN_SHARE = 0.1
"""... away from edges: where an edge's place adds less than the noise, or than this share of the band."""

NOISE_BAND_SIGMA = 6.0
"""... and, where that is more, within this many of the standard deviations that the normals told."""

SIGMA_OF_MEDIAN = 1.4826
"""Standard deviation of normal errors over the median of their sizes."""

MAX_NOISE_FACTOR = 20.0
"""Largest factor between the noise seen about the profile and that told by the normals."""

FLOOR_BEFORE, LEVEL_BEHIND = 1.0, 0.9
"""How much of the floor before the first step, and of the level behind the last, is fitted, in runs."""

ABOVE_LAST = 0.6
"""How far above the last nosing rays are used, in rises."""

MIN_RAYS = 40
"""Fewest rays near the profile for a fit."""

MAX_CHANGE, MAX_MOVE, MAX_ANGLE = 2.0, 0.5, np.radians(25.0)
"""A fit that changes run or rise by a larger factor than the first, moves the stairs by more than the second
in runs, or turns the axes by more than the third, rad, has run away."""

MAX_ENTRIES = 100_000
"""Slopes at which rays are predicted at most: only a fit that runs away asks for more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rays:
    """What the rays of some strips of an elevation measured; all arrays are (N,).

    Attributes
    ----------
    slope, bearing
        tau and lambda of each.
    inverse_distance
        Q, 1/m.
    row, strip
        Where they stand in the elevation.
    """

    slope: Float64Array
    bearing: Float64Array
    inverse_distance: Float64Array
    row: IntArray
    strip: IntArray

    @property
    def arrays(self) -> RayArrays:
        """Slope, bearing and inverse distance, as kernels take them."""
        slope, bearing = np.ascontiguousarray(self.slope), np.ascontiguousarray(self.bearing)
        return slope, bearing, np.ascontiguousarray(self.inverse_distance)

    def turned(self, tilt: float, roll: float, turn: float) -> Rays:
        """Return the rays in axes turned by small angles, rad.

        The new up is up + tilt·forward + roll·left, the new forward is forward - tilt·up + turn·left.
        """
        slope, bearing, q = turn_rays(self.arrays, tilt, roll, turn)
        return Rays(slope=slope, bearing=bearing, inverse_distance=q, row=self.row, strip=self.strip)


def gather_rays(elevation: Elevation, strips: IntArray, row_step: int = 1) -> Rays:
    """Return the measured rays of some strips, of every ``row_step``-th row."""
    row, column = np.nonzero(elevation.inverse_distance[::row_step, strips])
    row, strip = row * row_step, strips[column]
    return Rays(
        slope=elevation.slope[row],
        bearing=elevation.bearing[strip],
        inverse_distance=elevation.inverse_distance[row, strip],
        row=row,
        strip=strip,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedProfile:
    """A profile as the rays of one frame tell it.

    Attributes
    ----------
    profile
        The section of the stairs in the corrected axes.
    tilt, roll, turn
        How far these are turned against the elevation's, rad, as in ``Rays.turned``.
    optics
        How the sensor and the reduced image show edges.
    noise
        Standard deviation of a ray's inverse distance about the profile, 1/m.
    covariance
        (6, 6) of (rise, run, distance, height, tilt, turn), m and rad.
    step_std
        (num_steps, 2) of each nosing's place off the regular one, forward and up, m.
    overhang_std
        Of the overhang, m.
    rise_information
        (2, 3) what the rays say of rise and edge shift together (``StairObservation.rise_information``).
    cost
        Robust squares of the rays about the profile, in units of a common error: for comparing fits.
    """

    profile: StairProfile
    tilt: float
    roll: float
    turn: float
    optics: Optics
    noise: float
    covariance: Float64Array
    step_std: Float64Array
    overhang_std: float
    rise_information: Float64Array
    cost: float

    def __post_init__(self) -> None:
        for name in ("covariance", "step_std", "rise_information"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    def axes(self, elevation: Elevation) -> tuple[Vector, Vector]:
        """Return the corrected up and forward, (3,) unit vectors, camera frame."""
        grid = elevation.grid
        up = normalized(grid.up + self.tilt * grid.forward + self.roll * grid.left)
        forward = grid.forward - self.tilt * grid.up + self.turn * grid.left
        return up, normalized(forward - (forward @ up) * up)

    def predict(self, slopes: Float64Array, profile: StairProfile | None = None) -> Prediction:
        """Tabulate what rays over the range of some slopes must see, of another profile if one is given."""
        profile = self.profile if profile is None else profile
        outline = outline_of(profile, min_extent=self.optics.smoothing * self.optics.row_size)
        low, high = float(slopes.min()), float(slopes.max())
        return tabulate(outline, self.optics, low, high, has_gradient=False)


def fit_profile(
    rays: Rays,
    start: StairProfile,
    *,
    noise: float,
    optics: Optics,
    up_std: float,
    around: FittedProfile | None = None,
    is_coarse: bool = False,
) -> FittedProfile | None:
    """Fit a profile to rays.

    Parameters
    ----------
    rays
        Rays of the strips in which the stairs lie.
    start
        Where to begin: a few centimetres off at most.
    noise
        Standard deviation of a ray's inverse distance as the normals tell it, 1/m.
    optics
        How the camera shows edges; the shift is what reducing the image made, the sensor's comes on top.
    up_std
        Standard deviation of the direction of up, rad.
    around
        A fit with other steps of the same stairs, to go on from.
    is_coarse
        Whether regular steps will do, for seeing which steps there are.

    Returns
    -------
    The fitted profile, or ``None`` when too few rays lie near it or the equations break down.
    """
    noise = max(noise, MIN_NOISE)
    begun = optics.shift, 0.0, 0.0, 0.0, noise
    rounds: tuple[float, ...] = COARSE_STDS
    known = optics
    if around is not None:
        known = around.optics
        begun = known.shift, around.tilt, around.roll, around.turn, around.noise
        rounds = COARSE_STDS[-1:]
    shape = start.overhang, start.thickness, start.rake, start.ground, start.slope
    values = np.array([start.distance, start.height, start.run, start.rise, *shape, *begun[:4]])
    num_coarse = len(rounds)
    all_rounds = np.array(rounds if is_coarse else (*rounds, *FINE_STDS))
    min_extent = known.smoothing * known.row_size
    is_found, values, places, seen_noise, cost, covariance = fit_section(
        rays.arrays,
        (values, np.ascontiguousarray(start.offsets)),
        _prior(start, optics.shift, up_std),
        (all_rounds, num_coarse, begun[4]),
        start.is_open,
        edge_optics(known),
        PIECE_KINDS,
        section_limits(min_extent),
        _EQUATIONS._replace(
            told_noise=noise,
            least_noise=noise / MAX_NOISE_FACTOR,
            most_noise=noise * MAX_NOISE_FACTOR,
        ),
        _LIMITS._replace(spacing=ROWS_PER_ENTRY * known.row_size),
    )
    if not is_found or not (covariance.diagonal()[_COVARIANCE_ROWS] > 0).all():
        return None
    return _result(start, known, values, places, covariance, optics.shift, noise=seen_noise, cost=cost)


_EQUATIONS = EquationLimits(
    told_noise=math.nan,
    least_noise=math.nan,
    most_noise=math.nan,
    band=NOISE_BAND,
    plain_share=PLAIN_SHARE,
    band_sigma=NOISE_BAND_SIGMA,
    min_rays=MIN_RAYS,
    sigma_of_median=SIGMA_OF_MEDIAN,
    surface_variance=SURFACE_STD**2,
    tail=TAIL,
    rays_per_sample=RAYS_PER_SAMPLE,
    cost_std=COARSE_STDS[-1],
)
"""What decides how rays count; the noise is that of a frame."""

_LIMITS = FitLimits(
    spacing=math.nan,
    max_entries=MAX_ENTRIES,
    irregularity=STEP_IRREGULARITY,
    floor_irregularity=FLOOR_IRREGULARITY,
    step_tail=STEP_TAIL,
    place_std=STEP_PLACE_STD,
    tail=TAIL,
    back_rake_std=BACK_RAKE_STD,
    floor_before=FLOOR_BEFORE,
    level_behind=LEVEL_BEHIND,
    above_last=ABOVE_LAST,
    max_change=MAX_CHANGE,
    max_move=MAX_MOVE,
    max_angle=float(MAX_ANGLE),
)
"""What holds steps together, and how far a fit may go from where it began; the spacing is a camera's."""


def _prior(start: StairProfile, known_shift: float, up_std: float) -> tuple[Float64Array, Float64Array]:
    """What is known of stairs, sensors and axes before a ray is seen: means and standard deviations."""
    means, stds = np.zeros(NUM_VALUES), np.full(NUM_VALUES, np.inf)
    means[THICKNESS], means[GROUND], means[SHIFT] = start.thickness, start.ground, known_shift
    stds[OVERHANG], stds[THICKNESS], stds[RAKE] = OVERHANG_STD, THICKNESS_STD, RAKE_STD
    stds[GROUND], stds[SLOPE], stds[SHIFT] = GROUND_STD, SLOPE_STD, EDGE_SHIFT_STD
    stds[TILT] = stds[ROLL] = up_std
    stds[TURN] = TURN_STD
    return means, stds


def _result(
    start: StairProfile,
    known: Optics,
    values: Float64Array,
    places: Float64Array,
    full: Float64Array,
    known_shift: float,
    *,
    noise: float,
    cost: float,
) -> FittedProfile:
    distance, height, run, rise, overhang, thickness, rake, ground, slope, shift, tilt, roll, turn = (
        values.tolist()
    )
    profile = StairProfile(
        distance=distance, height=height, run=run, rise=rise, num_steps=start.num_steps, overhang=overhang,
        thickness=thickness, is_open=start.is_open, rake=rake, ground=ground, slope=slope, offsets=places,
    )  # fmt: skip
    n = profile.num_steps
    own = np.full(2 * n + 1, np.nan)
    own[: len(full) - NUM_VALUES] = np.sqrt(np.maximum(full.diagonal()[NUM_VALUES:], 0.0))
    # A front lower than what the sensor blends hardly shows: the overhang is then no better known than that.
    near = max(float(profile.nosing_distances.min()), MIN_FORWARD)
    blended = BLENDED_SHARE * known.smoothing * known.row_size * near
    return FittedProfile(
        profile=profile,
        tilt=tilt,
        roll=roll,
        turn=turn,
        optics=Optics(row_size=known.row_size, smoothing=known.smoothing, shift=shift),
        noise=noise,
        covariance=full[_COVARIANCE_ROWS[:, None], _COVARIANCE_ROWS],
        step_std=np.array([own[:n], own[n + 1 :]]).T,
        overhang_std=float(math.hypot(math.sqrt(max(full[OVERHANG, OVERHANG], 0.0)), blended)),
        rise_information=_rise_information(full, rise, shift - known_shift),
        cost=cost,
    )


def _rise_information(covariance: Float64Array, rise: float, shift: float) -> Float64Array:
    """Information on rise and shift together without the shift's prior, and its product with the estimate."""
    rise_variance, both, shift_variance = (
        float(covariance[i, j]) for i, j in ((RISE, RISE), (RISE, SHIFT), (SHIFT, SHIFT))
    )
    determinant = rise_variance * shift_variance - both * both
    known = shift_variance / determinant
    mixed = -both / determinant
    of_shift = rise_variance / determinant
    # The prior's mean is 0: it takes nothing from the product.
    product = known * rise + mixed * shift, mixed * rise + of_shift * shift
    of_shift = max(of_shift - 1.0 / EDGE_SHIFT_STD**2, 1e-9)
    return np.array([[known, mixed, product[0]], [mixed, of_shift, product[1]]])


_COVARIANCE_ROWS = np.array([RISE, RUN, DISTANCE, HEIGHT, TILT, TURN])


def turned_rays(rays: Rays, fitted: FittedProfile) -> Rays:
    """Return rays in the axes of a fitted profile."""
    return rays.turned(fitted.tilt, fitted.roll, fitted.turn)
