"""Fit the section of a flight to points: a lattice of nosings, each step's own place, both ends.

A candidate says where to look. What is found there moves the lattice and turns the heading, a few times over;
then the flight is extended by the steps that go on at either end.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.clouds.axes import StairAxes
from stairmap.clouds.heading import find_turn
from stairmap.clouds.line_fit import IRREGULARITY, MAX_CHANGE, fit_line
from stairmap.clouds.surface_ends import measure_fronts, measure_riser_tops
from stairmap.clouds.surfaces import (
    BIN,
    MAX_OVERHANG_NOISE,
    StepLattice,
    Strip,
    Surfaces,
    goes_on,
    measure_risers,
    measure_treads,
)
from stairmap.detection.profile import StairProfile

SLAB = (0.025, 0.12)
"""Thickness of the slabs of stairs, m."""

MAX_UNDER_SHARE = 0.75
"""Where more treads than this share lie low, they are irregular, not seen from below."""

MAX_OVERHANG = 0.08
"""Largest overhang of a nosing, m."""

MIN_OVERHANG = 0.012
"""A smaller overhang is not told from the blur of the edge, m."""

NUM_ROUNDS = 3
"""Rounds of measuring and moving the lattice: the first sees half of a blurred tread at worst."""

EXTENSION, MAX_EXTENSIONS = 3, 10
"""Steps beyond those known that are looked for at either end, and how often, while there are more."""

MAX_MISSED = 2
"""Steps in a row that may be missing between two that were seen."""

FLOOR_WINDOW = (1.1, 1.6)
"""A level that is also seen between these shares of a run beyond its step is a floor or landing."""

UNKNOWN_STD = 0.02
"""Standard deviation of a measure that one step alone gives, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SectionStd:
    """Standard deviations of a section: m, and rad for the heading."""

    rise: float
    run: float
    distance: float
    height: float
    heading: float
    overhang: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """The measured section of a flight.

    Attributes
    ----------
    axes
        The flight's axes.
    profile
        Nosings and treads in these axes.
    treads
        Levels -1 (the floor) to num_steps - 1.
    risers, fronts
        Risers 0 to num_steps - 1, and the front edges of their treads.
    sides
        Right and left end of the strip that was measured, t in m.
    std
        How well it is known.
    floor_seen, top_seen
        Whether the level before the first riser, and behind the last nosing, goes on beyond a step.
    """

    axes: StairAxes
    profile: StairProfile
    treads: Surfaces
    risers: Surfaces
    fronts: Surfaces
    sides: tuple[float, float]
    std: SectionStd
    floor_seen: bool
    top_seen: bool

    @property
    def is_step_seen(self) -> Mask:
        """(num_steps,) of which nosings a riser was seen, or the treads on both sides."""
        level = self.treads.is_seen
        return np.asarray(self.risers.is_seen | (level[1:] & (level[:-1] | self.fronts.is_seen)))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measured:
    """Surfaces about a lattice, and the levels and nosings that they make."""

    treads: Surfaces
    levels: Surfaces
    risers: Surfaces
    fronts: Surfaces
    nosings: Surfaces
    overhang: float
    overhang_std: float


def fit_section(
    points: Float64Array, axes: StairAxes, profile: StairProfile, sides: tuple[float, float], noise: float
) -> Section | None:
    """Measure a flight near a lattice.

    Parameters
    ----------
    points
        (N, 3) points about it, in the cloud, m.
    axes, profile
        Where to look: only the regular lattice of the profile counts.
    sides
        Right and left end, t in m.
    noise
        Standard deviation of a point, m.

    Returns
    -------
    The section with the steps that were seen; ``None`` where fewer than two were.
    """
    lattice = StepLattice(
        distance=profile.distance, height=profile.height, run=profile.run, rise=profile.rise
    )
    strip = Strip.between(axes.from_cloud(points), sides, noise)
    for _ in range(NUM_ROUNDS):
        moved = _fit_lattice(lattice, _measure(strip, lattice, profile.num_steps))
        if moved is None:
            return None
        lattice = moved
        turn = find_turn(strip, lattice, profile.num_steps)
        axes = replace(axes, heading=axes.heading + turn)
        strip = Strip.between(axes.from_cloud(points), sides, noise)
    num_steps, measured = profile.num_steps, None
    for _ in range(MAX_EXTENSIONS):
        before = num_steps
        extended = _extend(strip, lattice, num_steps)
        if extended is None:
            return None
        lattice, num_steps = extended
        for _ in range(2):
            measured = _measure(strip, lattice, num_steps)
            moved = _fit_lattice(lattice, measured)
            if moved is None:
                return None
            lattice = moved
        if num_steps <= before:
            break
    assert measured is not None
    return _make_section(strip, axes, lattice, measured)


def _make_section(strip: Strip, axes: StairAxes, lattice: StepLattice, measured: _Measured) -> Section:
    treads, nosings = _without_undersides(lattice, measured.treads), measured.nosings
    index = np.arange(len(nosings.place))
    levels = lattice.level(np.arange(-1, len(index)))
    own_s = np.where(nosings.is_seen, nosings.place - lattice.nosing(index), 0.0)
    own_z = np.where(treads.is_seen, treads.place - levels, 0.0)
    profile = StairProfile(
        distance=lattice.distance,
        height=lattice.height,
        run=lattice.run,
        rise=lattice.rise,
        num_steps=len(index),
        overhang=measured.overhang,
        is_open=bool(2 * np.count_nonzero(measured.risers.is_seen) < len(index)),
        offsets=np.concatenate([own_s, own_z]),
    )
    first, last = profile.nosing_distances[[0, -1]]
    near, far = (share * lattice.run for share in FLOOR_WINDOW)
    return Section(
        axes=axes,
        profile=profile,
        treads=treads,
        risers=measured.risers,
        fronts=measured.fronts,
        sides=strip.sides,
        std=_find_std(measured, strip.sides[1] - strip.sides[0]),
        floor_seen=goes_on(strip, (first - far, first - near), float(profile.tread_heights[0])),
        top_seen=goes_on(strip, (last + near, last + far), float(profile.tread_heights[-1])),
    )


def _without_undersides(lattice: StepLattice, treads: Surfaces) -> Surfaces:
    """Leave out treads of which only the underside was seen: they lie low by a slab's thickness."""
    below = lattice.level(np.arange(-1, len(treads.place) - 1)) - treads.place
    is_under = treads.is_seen & (below > SLAB[0]) & (below < SLAB[1])
    if np.count_nonzero(is_under) > MAX_UNDER_SHARE * np.count_nonzero(treads.is_seen):
        return treads
    return Surfaces(
        place=np.where(is_under, np.nan, treads.place),
        std=np.where(is_under, np.inf, treads.std),
        cover=np.where(is_under, 0.0, treads.cover),
        extent=np.where(is_under, 0.0, treads.extent),
    )


def _measure(strip: Strip, lattice: StepLattice, num_steps: int) -> _Measured:
    index = np.arange(num_steps)
    treads = measure_treads(strip, lattice, np.arange(-1, num_steps))
    risers, fronts = (
        measure_risers(strip, lattice, index, treads),
        measure_fronts(strip, lattice, index, treads),
    )
    tops = measure_riser_tops(strip, lattice, index, risers)
    by_top = np.concatenate([[False], tops.is_seen]) & ~treads.is_seen
    levels = Surfaces(
        place=np.where(by_top, np.concatenate([[np.nan], tops.place]), treads.place),
        std=np.where(by_top, np.concatenate([[np.inf], tops.std]), treads.std),
        cover=np.where(by_top, np.concatenate([[0.0], tops.cover]), treads.cover),
        extent=treads.extent,
    )
    both = risers.is_seen & fronts.is_seen
    overhang, overhang_std = 0.0, float("nan")
    if np.count_nonzero(both) >= 2 and strip.noise < MAX_OVERHANG_NOISE:
        difference = (risers.place - fronts.place)[both]
        overhang_std = float(np.median(fronts.std[both]) / np.sqrt(len(difference)) + MIN_OVERHANG / 4)
        middle = float(np.median(difference))
        overhang = middle if max(MIN_OVERHANG, 2 * overhang_std) < middle < MAX_OVERHANG else 0.0
    by_riser = risers.is_seen
    nosings = Surfaces(
        place=np.where(by_riser, risers.place - overhang, fronts.place),
        std=np.where(by_riser, risers.std, fronts.std),
        cover=np.where(by_riser, risers.cover, fronts.cover),
        extent=np.where(by_riser, risers.extent, fronts.extent),
    )
    return _Measured(
        treads=treads,
        levels=levels,
        risers=risers,
        fronts=fronts,
        nosings=nosings,
        overhang=overhang,
        overhang_std=overhang_std,
    )


def _extend(strip: Strip, lattice: StepLattice, num_steps: int) -> tuple[StepLattice, int] | None:
    """Extend a lattice by a few steps at both ends, and cut off what was not seen."""
    index = np.arange(-EXTENSION, num_steps + EXTENSION)
    treads = measure_treads(strip, lattice, np.append(index[0] - 1, index))
    level = treads.is_seen
    is_seen = measure_risers(strip, lattice, index, treads).is_seen | (level[1:] & level[:-1])
    # Beyond the candidate each step must follow the one before: farther off lies something else.
    above = np.logical_and.accumulate(is_seen[EXTENSION + num_steps :])
    below = np.logical_and.accumulate(is_seen[:EXTENSION][::-1])[::-1]
    is_seen = np.concatenate([below, is_seen[EXTENSION : EXTENSION + num_steps], above])
    seen = np.flatnonzero(is_seen)
    if not len(seen):
        return None
    parts = np.split(seen, np.flatnonzero(np.diff(seen) > MAX_MISSED + 1) + 1)
    best = max(parts, key=len)
    if len(best) < 2:
        return None
    first = int(index[best[0]])
    moved = replace(lattice, distance=float(lattice.nosing(first)), height=float(lattice.level(first)))
    return moved, int(best[-1] - best[0]) + 1


def _fit_lattice(lattice: StepLattice, measured: _Measured) -> StepLattice | None:
    """Move a lattice to measured treads and nosings; ``None`` where it would become another one."""
    treads, nosings = measured.levels, measured.nosings
    level = np.arange(-1, len(treads.place) - 1)
    # The floors at both ends often lie off by their finish: treads alone tell the rise, if they can.
    inner = treads.is_seen & (level >= 0) & (level < len(nosings.place) - 1)
    used = inner if np.count_nonzero(inner) >= 2 else treads.is_seen
    index = np.arange(len(nosings.place))
    seen = nosings.is_seen
    if not used.any() and not seen.any():
        return None
    height, rise = fit_line(
        level[used], treads.place[used], treads.std[used], (lattice.height, lattice.rise), is_last_outer=True
    )
    distance, run = fit_line(
        index[seen],
        nosings.place[seen],
        nosings.std[seen],
        (lattice.distance, lattice.run),
        is_last_outer=False,
    )
    changes = np.array([rise / lattice.rise, run / lattice.run])
    if not ((changes > 1 / MAX_CHANGE) & (changes < MAX_CHANGE)).all():
        return None
    return StepLattice(distance=distance, height=height, run=run, rise=rise)


def _find_std(measured: _Measured, width: float) -> SectionStd:
    values = []
    for surfaces in (measured.levels, measured.nosings):
        seen = np.flatnonzero(surfaces.is_seen)
        if len(seen) < 2:
            values += [UNKNOWN_STD, UNKNOWN_STD]
            continue
        weight = 1.0 / (surfaces.std[seen] ** 2 + IRREGULARITY**2 / 4)
        middle = float(np.average(seen, weights=weight))
        step_std = float(1.0 / np.sqrt((weight * (seen - middle) ** 2).sum()))
        values += [step_std, float(np.hypot(1.0 / np.sqrt(weight.sum()), middle * step_std))]
    rise, height, run, distance = values
    heading = 2.0 * distance / max(width, BIN)
    return SectionStd(
        rise=rise, run=run, distance=distance, height=height, heading=heading, overhang=measured.overhang_std
    )
