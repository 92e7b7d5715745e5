"""Fit a stair profile to the rays of one frame.

Every ray says at which inverse forward distance Q = 1/s it met something. A profile predicts it, with its
derivatives, so robust Gauss-Newton adjusts the profile, how far the axes are turned, and the sensor's shift
of edges together, until rays and prediction agree. Each step also gets its own place, held to the regular one
by the irregularity of built stairs, so that an odd step neither pulls the others nor is pulled by them. The
covariance is the inverse of the same equations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Vector, readonly
from stairmap.detection.elevation import Elevation
from stairmap.detection.profile import MIN_FORWARD, Optics, Prediction, StairProfile, outline_of, tabulate
from stairmap.geometry import normalized
from stairmap.kernels import sum_equations, turn_rays
from stairmap.kernels.equations import EquationLimits, RayArrays, RayView

REGULAR = ("distance", "height", "run", "rise", "overhang", "thickness", "rake", "ground", "slope")
"""The values of a regular profile in the order of the equations; the shift of edges follows."""

SHIFT = len(REGULAR)
"""Place of the shift of edges in the equations; tilt, roll and turn follow, then the steps' own places."""

TILT, ROLL, TURN, OFFSETS = SHIFT + 1, SHIFT + 2, SHIFT + 3, SHIFT + 4

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
"""Neighbouring rays err together: so many count as one independent sample."""

MIN_NOISE = 1e-4
"""No sensor knows inverse distance better, 1/m: a tenth of a millimetre at a metre."""

NOISE_BAND = 0.04
"""Rays within this of a surface tell the noise, m: what stands farther off is something else."""

PLAIN_SHARE = 0.1
"""... away from edges: where an edge's place adds less than the noise, or than this share of the band."""

NOISE_BAND_SIGMA = 6.0
"""... and, where that is more, within so many of the standard deviations that the normals told."""

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
        return replace(self, slope=slope, bearing=bearing, inverse_distance=q)


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
    state = _State(profile=start, optics=optics, angles=np.zeros(3), noise=noise)
    rounds: tuple[float, ...] = COARSE_STDS
    if around is not None:
        angles = np.array([around.tilt, around.roll, around.turn])
        state = _State(profile=start, optics=around.optics, angles=angles, noise=around.noise)
        rounds = COARSE_STDS[-1:]
    num_coarse = len(rounds)
    if not is_coarse:
        rounds = (*rounds, *FINE_STDS)
    prior = _Prior(start, optics.shift, up_std)
    for number, coarse in enumerate(rounds):
        sums = _sum_rays(rays, state, noise, coarse, is_fine=number >= num_coarse)
        state = replace(state, noise=sums.noise)
        if sums.num_rays < MIN_RAYS:
            return None
        matrix, gradient = prior.added(sums.matrix, sums.vector, state)
        try:
            change = -np.asarray(np.linalg.solve(matrix, gradient), dtype=np.float64)
        except np.linalg.LinAlgError:
            return None
        state = state.moved(change)
        if not state.is_sane(start):
            return None
    result = _result(state, matrix, optics.shift, sums.cost)
    return result if (np.diag(result.covariance) > 0).all() else None


@dataclass(frozen=True, slots=True, kw_only=True)
class _State:
    """All that a round changes."""

    profile: StairProfile
    optics: Optics
    angles: Float64Array
    noise: float

    def moved(self, change: Float64Array) -> _State:
        profile, optics = self.profile, self.optics
        step = change[:OFFSETS].tolist()
        own = change[OFFSETS:]
        return _State(
            profile=StairProfile(
                distance=profile.distance + step[0],
                height=profile.height + step[1],
                run=profile.run + step[2],
                rise=profile.rise + step[3],
                num_steps=profile.num_steps,
                overhang=profile.overhang + step[4],
                thickness=profile.thickness + step[5],
                is_open=profile.is_open,
                rake=profile.rake + step[6],
                ground=profile.ground + step[7],
                slope=profile.slope + step[8],
                offsets=profile.offsets + own if len(own) else profile.offsets,
            ),
            optics=Optics(
                row_size=optics.row_size, smoothing=optics.smoothing, shift=optics.shift + step[SHIFT]
            ),
            angles=self.angles + change[TILT:OFFSETS],
            noise=self.noise,
        )

    def values(self) -> Float64Array:
        """(OFFSETS,) values of a regular profile, the shift and the angles, in the order of the equations."""
        p = self.profile
        regular = p.distance, p.height, p.run, p.rise, p.overhang, p.thickness, p.rake, p.ground, p.slope
        return np.array([*regular, self.optics.shift, *self.angles.tolist()])

    def is_sane(self, start: StairProfile) -> bool:
        """Whether the fit has not run away from where it began."""
        profile = self.profile
        return bool(
            np.isfinite(profile.distance + profile.height + self.optics.shift)
            and 0.5 < profile.run / start.run < 2.0
            and 0.5 < profile.rise / start.rise < 2.0
            and abs(profile.distance - start.distance) < 0.5 * abs(start.run)
            and np.abs(self.angles).max() < np.radians(25.0)
        )


class _Prior:
    """What is known of stairs, sensors and axes before a ray is seen."""

    def __init__(self, start: StairProfile, known_shift: float, up_std: float) -> None:
        self.mean = np.zeros(OFFSETS)
        self.std = np.full(OFFSETS, np.inf)
        for name, mean, std in (
            ("overhang", 0.0, OVERHANG_STD),
            ("thickness", start.thickness, THICKNESS_STD),
            ("rake", 0.0, RAKE_STD),
            ("ground", start.ground, GROUND_STD),
            ("slope", 0.0, SLOPE_STD),
        ):
            self.mean[REGULAR.index(name)], self.std[REGULAR.index(name)] = mean, std
        self.mean[SHIFT], self.std[SHIFT] = known_shift, EDGE_SHIFT_STD
        self.std[[TILT, ROLL]], self.std[TURN] = up_std, TURN_STD
        self.differences = _neighbours(start.num_steps)
        self.irregularity = np.full(len(self.differences), STEP_IRREGULARITY)
        self.irregularity[start.num_steps - 1] = FLOOR_IRREGULARITY

    def added(
        self, matrix: Float64Array, gradient: Float64Array, state: _State
    ) -> tuple[Float64Array, Float64Array]:
        """The equations with the prior's part."""
        size = len(matrix)
        std = self.std
        if state.profile.rake < 0:
            std = std.copy()
            std[REGULAR.index("rake")] = BACK_RAKE_STD
        information = 1.0 / std**2
        total, vector = matrix.copy(), gradient.copy()
        total.ravel()[: OFFSETS * (size + 1) : size + 1] += information
        vector[:OFFSETS] += information * (state.values() - self.mean)
        if size > OFFSETS:
            offsets = state.profile.offsets
            off = self.differences @ offsets / self.irregularity
            weight = 1.0 / ((1.0 + (off / STEP_TAIL) ** 2) * self.irregularity**2)
            own = (self.differences.T * weight) @ self.differences
            place = 1.0 / (STEP_PLACE_STD**2 + (offsets / TAIL) ** 2)
            # The floor is no step.
            place[state.profile.num_steps] = 0.0
            own.ravel()[:: len(own) + 1] += place
            total[OFFSETS:, OFFSETS:] += own
            vector[OFFSETS:] += own @ offsets
        return total, vector


@lru_cache(maxsize=128)
def _neighbours(num_steps: int) -> Float64Array:
    """(D, 2 * num_steps + 1) differences between neighbours in ``StairProfile.offsets``: of nosings, then of
    treads."""
    n = num_steps
    differences = np.zeros((2 * n - 1, 2 * n + 1))
    differences[: n - 1, :n] = np.diff(np.eye(n), axis=0)
    differences[n - 1 :, n:] = np.diff(np.eye(n + 1), axis=0)
    return readonly(differences)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sums:
    """What the rays say in a round: their noise, robust number, equations without the prior, and cost."""

    noise: float
    num_rays: float
    matrix: Float64Array
    vector: Float64Array
    cost: float


def _sum_rays(rays: Rays, state: _State, told_noise: float, coarse: float, *, is_fine: bool) -> _Sums:
    """Compare rays with a profile's predictions at every half row."""
    low, high = _slope_range(state.profile)
    outline = outline_of(state.profile, min_extent=state.optics.smoothing * state.optics.row_size)
    predicted = tabulate(outline, state.optics, low, high, has_gradient=True)
    limits = EquationLimits(
        told_noise=told_noise,
        least_noise=told_noise / MAX_NOISE_FACTOR,
        most_noise=told_noise * MAX_NOISE_FACTOR,
        band=NOISE_BAND,
        plain_share=PLAIN_SHARE,
        band_sigma=NOISE_BAND_SIGMA,
        min_rays=MIN_RAYS,
        sigma_of_median=SIGMA_OF_MEDIAN,
        surface_variance=SURFACE_STD**2 + coarse**2,
        tail=TAIL,
        rays_per_sample=RAYS_PER_SAMPLE,
        cost_std=COARSE_STDS[-1],
    )
    tilt, roll, turn = state.angles.tolist()
    noise, num_rays, matrix, vector, cost = sum_equations(
        rays.arrays,
        RayView(tilt, roll, turn, low, high),
        predicted.table,
        predicted.gradient,
        limits,
    )
    chain = _chain(state.profile.num_steps, is_fine=is_fine)
    return _Sums(
        noise=noise, num_rays=num_rays, matrix=chain.T @ matrix @ chain, vector=chain.T @ vector, cost=cost
    )


@lru_cache(maxsize=128)
def _chain(num_steps: int, *, is_fine: bool) -> Float64Array:
    """(M + 4, P) derivatives of an outline's values, shift, tilt, roll and turn by those of the equations."""
    n = num_steps
    chain = np.zeros((2 * n + 10, OFFSETS + 2 * n + 1))
    nosing, level = np.arange(n), n + np.arange(n + 1)
    chain[nosing, REGULAR.index("distance")] = 1.0
    chain[nosing, REGULAR.index("run")] = np.arange(n)
    chain[level, REGULAR.index("height")] = 1.0
    chain[level, REGULAR.index("rise")] = np.arange(-1, n)
    for place, name in enumerate(("overhang", "thickness", "rake", "ground", "slope")):
        chain[2 * n + 1 + place, REGULAR.index(name)] = 1.0
    chain[np.arange(2 * n + 1), OFFSETS + np.arange(2 * n + 1)] = 1.0
    chain[2 * n + 6 + np.arange(4), [SHIFT, TILT, ROLL, TURN]] = 1.0
    return readonly(chain if is_fine else chain[:, :OFFSETS])


def _slope_range(profile: StairProfile) -> tuple[float, float]:
    """Slopes between which rays are fitted: from a piece of floor before the stairs to the level behind."""
    run, last, own = abs(profile.run), profile.num_steps - 1, profile.offsets
    first_s = max(profile.distance + float(own[0]), MIN_FORWARD)
    last_s = max(profile.distance + profile.run * last + float(own[last]), MIN_FORWARD)
    floor = profile.height - profile.rise + float(own[last + 1])
    top = profile.height + profile.rise * last + float(own[-1])
    if profile.run > 0:
        low = floor / max(first_s - FLOOR_BEFORE * run, MIN_FORWARD)
        if top < 0:
            return low, top / (last_s + LEVEL_BEHIND * run)
        return low, (top + ABOVE_LAST * profile.rise) / last_s
    return top / max(last_s - FLOOR_BEFORE * run, MIN_FORWARD), floor / (first_s + LEVEL_BEHIND * run)


def _result(state: _State, matrix: Float64Array, known_shift: float, cost: float) -> FittedProfile:
    profile = state.profile
    full = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    n = profile.num_steps
    own = np.full(2 * n + 1, np.nan)
    own[: len(full) - OFFSETS] = np.sqrt(np.maximum(np.diag(full)[OFFSETS:], 0.0))
    # A front lower than what the sensor blends hardly shows: the overhang is then no better known than that.
    optics, near = state.optics, max(float(profile.nosing_distances.min()), MIN_FORWARD)
    blended = BLENDED_SHARE * optics.smoothing * optics.row_size * near
    return FittedProfile(
        profile=profile,
        tilt=float(state.angles[0]),
        roll=float(state.angles[1]),
        turn=float(state.angles[2]),
        optics=state.optics,
        noise=state.noise,
        covariance=full[_COVARIANCE_ROWS, _COVARIANCE_ROWS.T],
        step_std=np.stack([own[:n], own[n + 1 :]], axis=1),
        overhang_std=float(math.hypot(math.sqrt(max(full[_OVERHANG, _OVERHANG], 0.0)), blended)),
        rise_information=_rise_information(full, profile.rise, state.optics.shift - known_shift),
        cost=cost,
    )


def _rise_information(covariance: Float64Array, rise: float, shift: float) -> Float64Array:
    """Information on rise and shift together without the shift's prior, and its product with the estimate."""
    rise_variance, both, shift_variance = (
        float(covariance[i, j]) for i, j in ((_RISE, _RISE), (_RISE, SHIFT), (SHIFT, SHIFT))
    )
    determinant = rise_variance * shift_variance - both * both
    known = shift_variance / determinant
    mixed = -both / determinant
    of_shift = rise_variance / determinant
    # The prior's mean is 0: it takes nothing from the product.
    product = known * rise + mixed * shift, mixed * rise + of_shift * shift
    of_shift = max(of_shift - 1.0 / EDGE_SHIFT_STD**2, 1e-9)
    return np.array([[known, mixed, product[0]], [mixed, of_shift, product[1]]])


_RISE, _OVERHANG = REGULAR.index("rise"), REGULAR.index("overhang")

_COVARIANCE_ROWS = np.array(
    [*(REGULAR.index(name) for name in ("rise", "run", "distance", "height")), TILT, TURN]
)[:, None]


def turned_rays(rays: Rays, fitted: FittedProfile) -> Rays:
    """Return rays in the axes of a fitted profile."""
    return rays.turned(fitted.tilt, fitted.roll, fitted.turn)
