"""Measure single treads and risers of a flight near their places on a lattice.

Each surface is a peak of the points in a small window: what else is in the window is not averaged in. A riser
must end where its tread begins; a wall, which goes on above, is none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask

TREAD_WINDOW = (0.2, 0.85)
"""A tread is measured between these shares of a run behind its nosing: before it lies the blur of the
nosing, behind it that of the next riser."""

RISER_WINDOW = (0.15, 0.62)
"""A riser is measured between these shares of the rise above the tread below: higher up is the lip of a tread
that overhangs."""

MAX_OVERHANG_NOISE = 0.006
"""With more noise than this, m, an overhang is not told from the blur of edges and doubled surfaces. A lip is
as good as a riser then, and a LiDAR near the floor sees of the upper risers little else."""

TREAD_BLUR = 2.0
"""So many standard deviations of the noise below a tread, points are of the riser under it."""

SEARCH_HEIGHT, SEARCH_DISTANCE = 0.35, 0.30
"""A tread is sought within this share of the rise of its place, a riser within this share of the run."""

CORE = 3.0
"""Points within so many standard deviations of the noise of a surface are on it ..."""

MIN_CORE = 0.008
"""... and those within this, m: scans err by millimetres in common."""

BIN = 0.05
"""A surface is covered where each piece of this width across the stairs holds a point, m."""

MIN_COVER = 0.35
"""Share of the width over which a surface must be covered to count as seen."""

COMMON_ERROR = 0.0015
"""Standard deviation of a surface's place that more points do not make smaller, m."""

POINTS_PER_SAMPLE = 4.0
"""Points that count as one independent measurement: neighbours in a scan err in common."""

WALL_SHARE = 0.6
"""What is covered above the tread in this share of what the riser is goes on upward: a wall."""

WALL_HEIGHT = (0.06, 0.40)
"""Between these heights above a tread a wall is looked for, m: below handrails' bars."""

PEAK_BIN = 0.004
"""Points are counted in bins as wide as the noise, or this, m."""

PEAK_WIDTH, MIN_PEAK_WIDTH = 1.5, 0.006
"""A surface is the mean of the points within so many standard deviations of the noise of it, or this, m."""

OUTER_SHARE = 0.4
"""The outermost surface that has this share of the points of the fullest one is the one that counts."""

MIN_RISER_HEIGHT = 0.035
"""A riser reaches over more height than this, m: a third of the lowest, in its window."""

MIN_POINTS = 3
"""Fewest points that make a surface."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Strip:
    """Points of a flight within some width, in its axes and sorted along them.

    Attributes
    ----------
    points
        (N, 3) s, t, z, m, by s.
    sides
        Right and left end, t in m.
    noise
        Standard deviation of a point, m.
    """

    points: Float64Array
    sides: tuple[float, float]
    noise: float

    @classmethod
    def between(cls, local: Float64Array, sides: tuple[float, float], noise: float) -> Strip:
        """Cut a strip out of (N, 3) points in the flight's axes."""
        inside = local[(local[:, 1] > sides[0]) & (local[:, 1] < sides[1])]
        return cls(points=inside[np.argsort(inside[:, 0])], sides=sides, noise=noise)

    @property
    def core(self) -> float:
        """How far a point on a surface may lie off it, m."""
        return max(CORE * self.noise, MIN_CORE)

    def riser_band(self, below: float, rise: float) -> tuple[float, float]:
        """Return the heights between which a riser above a level is measured, m."""
        low, high = RISER_WINDOW
        if self.noise > MAX_OVERHANG_NOISE:
            high = max(high, 1.0 - TREAD_BLUR * self.noise / rise)
        return below + low * rise, below + high * rise

    def box(self, along: tuple[float, float], up: tuple[float, float]) -> Float64Array:
        """Return the points between two distances and two heights, m."""
        first, last = np.searchsorted(self.points[:, 0], along)
        part = self.points[first:last]
        return np.asarray(part[(part[:, 2] > up[0]) & (part[:, 2] < up[1])])

    def cover(self, points: Float64Array) -> float:
        """Return the share of the pieces across that hold one of these points."""
        width = self.sides[1] - self.sides[0]
        num = max(int(width / BIN), 1)
        piece = ((points[:, 1] - self.sides[0]) / width * num).astype(np.int64).clip(0, num - 1)
        return float(len(np.unique(piece)) / num)


@dataclass(frozen=True, slots=True, kw_only=True)
class StepLattice:
    """Where nosing 0 lies, and the steps from one nosing to the next, m."""

    distance: float
    height: float
    run: float
    rise: float

    def nosing(self, index: IntArray | int) -> Float64Array:
        """Distance of nosings."""
        return np.asarray(self.distance + self.run * index)

    def level(self, index: IntArray | int) -> Float64Array:
        """Height of the treads behind nosings; -1 is the floor before the first."""
        return np.asarray(self.height + self.rise * index)


@dataclass(frozen=True, slots=True, kw_only=True)
class Surfaces:
    """Surfaces of one kind, measured one by one; all arrays are (K,).

    Attributes
    ----------
    place
        Height of treads, distance of risers or fronts, m; NaN where not seen.
    std
        Its standard deviation, m; infinite where not seen.
    cover
        Share of the width over which it was seen.
    extent
        How far a riser reaches up, or a tread behind itself, m; 0 for fronts.
    """

    place: Float64Array
    std: Float64Array
    cover: Float64Array
    extent: Float64Array

    @property
    def is_seen(self) -> Mask:
        """(K,) which were seen over enough of the width."""
        return np.asarray((self.cover >= MIN_COVER) & np.isfinite(self.place))


def measure_treads(strip: Strip, lattice: StepLattice, index: IntArray) -> Surfaces:
    """Measure the height of each level near its place."""
    reach = SEARCH_HEIGHT * lattice.rise
    results = []
    for k in index.tolist():
        s, z = float(lattice.nosing(k)), float(lattice.level(k))
        along = (s + TREAD_WINDOW[0] * lattice.run, s + TREAD_WINDOW[1] * lattice.run)
        results.append(
            _find_surface(
                strip,
                strip.box(along, (z - reach, z + reach)),
                axis=2,
                is_last=True,
                min_extent=-1.0,
            )
        )
    return stacked(results)


def measure_risers(strip: Strip, lattice: StepLattice, index: IntArray, treads: Surfaces) -> Surfaces:
    """Measure the distance of each riser near its place.

    What goes on above is a wall, unless the tread behind it was seen: a door may stand flush with a riser.
    ``treads`` begin with the level before the first of the risers.
    """
    reach = SEARCH_DISTANCE * lattice.run
    results = []
    has_tread = treads.is_seen[1:]
    for row, k in enumerate(index.tolist()):
        s, below = float(lattice.nosing(k)), float(lattice.level(k - 1))
        up = strip.riser_band(below, lattice.rise)
        place, std, cover, extent = _find_surface(
            strip, strip.box((s - reach, s + reach), up), axis=0, is_last=False, min_extent=MIN_RISER_HEIGHT
        )
        top = below + lattice.rise
        if cover > 0 and not has_tread[row]:
            core = strip.core
            wall = strip.box((place - core, place + core), (top + WALL_HEIGHT[0], top + WALL_HEIGHT[1]))
            if strip.cover(wall) > WALL_SHARE * cover:
                place, std, cover, extent = np.nan, np.inf, 0.0, 0.0
        results.append((place, std, cover, extent))
    return stacked(results)


def goes_on(strip: Strip, along: tuple[float, float], height: float) -> bool:
    """Whether a level is seen between two distances as well."""
    band = max(strip.core, 0.02)
    return strip.cover(strip.box(along, (height - band, height + band))) >= MIN_COVER


def _find_surface(
    strip: Strip, inside: Float64Array, *, axis: int, is_last: bool, min_extent: float
) -> tuple[float, float, float, float]:
    """Place, standard deviation and cover of the outermost surface along an axis.

    Of two surfaces, the back or underside of thin steps being the other, the outer one counts: the last along
    the axis, or the first. A row of points that reaches less far than ``min_extent`` across it is no surface.
    """
    nothing = (float("nan"), float("inf"), 0.0, 0.0)
    if len(inside) < MIN_POINTS:
        return nothing
    values = inside[:, axis] if is_last else -inside[:, axis]
    size = max(strip.noise, PEAK_BIN)
    low = values.min()
    counts = np.bincount(((values - low) / size).astype(np.int64)).astype(np.float64)
    smooth = np.convolve(counts, [1.0, 1.0, 1.0], mode="same")
    is_peak = (smooth >= OUTER_SHARE * smooth.max()) & (smooth >= np.append(smooth[1:], 0.0))
    half = max(PEAK_WIDTH * strip.noise, MIN_PEAK_WIDTH)
    for peak in np.flatnonzero(is_peak)[::-1].tolist():
        middle = float(low + (peak + 0.5) * size)
        for _ in range(4):
            is_on = np.abs(values - middle) < half
            if np.count_nonzero(is_on) < MIN_POINTS:
                break
            middle = float(values[is_on].mean())
        is_on = np.abs(values - middle) < half
        num = np.count_nonzero(is_on)
        cover = strip.cover(inside[is_on]) if num >= MIN_POINTS else 0.0
        extent = _extent(inside[is_on], is_level=is_last) if num else 0.0
        if cover >= MIN_COVER and extent > min_extent:
            std = float(values[is_on].std()) / np.sqrt(max(num / POINTS_PER_SAMPLE, 1.0))
            return middle if is_last else -middle, float(np.hypot(std, COMMON_ERROR)), cover, extent
    return nothing


def _extent(points: Float64Array, *, is_level: bool) -> float:
    """How far a riser reaches up, or a tread behind itself in half of the pieces across."""
    if not is_level:
        return float(np.ptp(points[:, 2]))
    piece = np.floor(points[:, 1] / BIN)
    order = np.lexsort((points[:, 0], piece))
    s = points[order, 0]
    begin = np.flatnonzero(np.concatenate([[True], np.diff(piece[order]) > 0]))
    end = np.append(begin[1:], len(s)) - 1
    return float(np.median(s[end] - s[begin]))


def stacked(results: list[tuple[float, float, float, float]]) -> Surfaces:
    """Return surfaces from place, standard deviation, cover and extent of each."""
    place, std, cover, extent = np.array(results, dtype=np.float64).reshape(-1, 4).T
    return Surfaces(place=place, std=std, cover=cover, extent=extent)
