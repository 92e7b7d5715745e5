"""Finished maps of simulated places: points of a scanner on a tripod, or of a robot's SLAM.

The scanner stands before and behind each flight, and where a route leads. A SLAM map is measured from the
same places, noisier, and twice: the second time a little turned and shifted, as a map is that was not aligned
well, so that each wall is two walls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, Transform
from stairmap.simulation.lidars import MAX_INCIDENCE
from stairmap.simulation.render import RayCaster
from stairmap.simulation.scene import Scene
from stairmap.simulation.sweep_visibility import count_returns
from stairmap.stairway import Flight
from stairmap.transforms import rotation_from_vector, transform_from_parts, transform_points

LOWEST_BEAM = float(np.radians(-60.0))
"""The tripod hides what is below, rad."""

MIN_RANGE, MAX_RANGE = 0.6, 12.0
"""Ranges, m, from the scanner's blind spot to where another station measures better."""

EYE_HEIGHT = 1.5
"""Height of the scanner above the floor it stands on, m."""

STATION_DISTANCES = (1.6, 1.0)
"""How far before the first nosing and behind the last a scanner stands, m."""

NEAR_FLIGHT = 10.0
"""Flights farther from a station, m, are not asked for returns."""

SAME_STATION = 0.8
"""A station so near to another, m, tells nothing new."""

MIN_RETURNS = 60
"""A step with so many returns was seen by the scanner (ours): a twentieth of what a tread gives at 3 m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapKind:
    """How a finished map was made.

    Attributes
    ----------
    name
        What tables call it.
    range_std
        Standard deviation of ranges, m.
    angular_step
        Step of a scan in both angles, rad: 12 mm at 3 m. Scanners are sold with a tenth of it; a map is
        thinned.
    passes
        (P) motions, as (turn about z rad, shift x y z m), of the passes that the map was measured in.
    """

    name: str
    range_std: float
    angular_step: float = float(np.radians(0.22))
    passes: tuple[tuple[float, float, float, float], ...] = ((0.0, 0.0, 0.0, 0.0),)


MAP_KINDS: dict[str, MapKind] = {
    kind.name: kind
    for kind in (
        MapKind(name="scanner_3mm", range_std=0.003),
        MapKind(
            name="slam_15mm",
            range_std=0.015,
            passes=((0.0, 0.0, 0.0, 0.0), (float(np.radians(0.3)), 0.03, -0.02, 0.008)),
        ),
    )
}
"""Kinds of finished maps: a scanner of 3 mm, and a robot's SLAM of 15 mm with doubled walls (ours: 36 mm and
0.3° between two passes, 8 mm in height)."""


class MapPart(NamedTuple):
    """What one station gave: (N, 3) points in the map, and for each flight (num_risers,) returns of each
    step."""

    points: Points
    returns: tuple[IntArray, ...]


class FinishedMap:
    """A map of a scene, station by station, so that memory does not grow with it.

    Parameters
    ----------
    scene
        Where.
    kind
        How it is measured.
    seed
        Seed of the noise.

    Attributes
    ----------
    flights
        The true flights, optional ones last.
    stations
        (S, 3) where the scanner stood, true map, m.
    """

    def __init__(self, scene: Scene, kind: MapKind, *, seed: int) -> None:
        self.scene, self.kind, self.seed = scene, kind, seed
        stairways = (*scene.stairways, *scene.optional_stairways)
        self.flights: tuple[Flight, ...] = tuple(
            flight for stairway in stairways for flight in stairway.flights
        )
        self._caster = RayCaster(scene.mesh)
        self.stations = find_stations(scene, self.flights, self._caster)

    def parts(self) -> Iterator[MapPart]:
        """Yield what each station gave, the same on every call; passes share the stations between them."""
        random = np.random.default_rng([self.seed, 5])
        pivot = self.stations.mean(axis=0)
        directions = _beams(self.kind.angular_step)
        for index, station in enumerate(self.stations):
            for number, motion in enumerate(self.kind.passes):
                # Both passes come by each station, with half of the beams each.
                some = directions[(np.arange(len(directions)) + index) % len(self.kind.passes) == number]
                hits = self._caster.cast(np.broadcast_to(station, some.shape), some)
                with np.errstate(invalid="ignore"):
                    kept = (hits.distance > MIN_RANGE) & (hits.distance < MAX_RANGE)
                    kept &= hits.incidence < MAX_INCIDENCE
                reach = hits.distance[kept]
                true_points = station + some[kept] * reach[:, None]
                measured = reach + self.kind.range_std * random.standard_normal(len(reach))
                points = station + some[kept] * measured[:, None]
                returns = tuple(
                    count_returns(flight, true_points, station)
                    if _distance(flight, station) < NEAR_FLIGHT
                    else np.zeros(flight.num_risers, dtype=np.int64)
                    for flight in self.flights
                )
                yield MapPart(transform_points(_motion(motion, pivot), points), returns)

    @property
    def drift(self) -> Transform:
        """(4, 4) mean motion of the passes: where the map has the truth."""
        pivot = self.stations.mean(axis=0)
        mean: Transform = np.mean([_motion(motion, pivot) for motion in self.kind.passes], axis=0)
        left, _, right = np.linalg.svd(mean[:3, :3])
        mean[:3, :3] = left @ right
        return mean


def find_stations(scene: Scene, flights: Sequence[Flight], caster: RayCaster) -> Points:
    """Return (S, 3) places of a scanner: at both ends of flights and along the route, on a floor and free."""
    wanted = []
    for flight in flights:
        first, last = flight.steps[0].nosing.mean(axis=0), flight.steps[-1].nosing.mean(axis=0)
        lower = np.array([first[0], first[1], flight.base[2]]) - STATION_DISTANCES[0] * flight.forward
        upper = last + STATION_DISTANCES[1] * flight.forward
        wanted += [(lower, first), (upper, last)]
    for start, end in zip(scene.route.waypoints[:-1], scene.route.waypoints[1:], strict=True):
        wanted += [(np.asarray(start), None), (np.asarray(end), None)]
    found: list[Points] = []
    for place, target in wanted:
        floor = _floor_below(place, caster)
        if floor is None:
            continue
        station = np.array([place[0], place[1], floor + EYE_HEIGHT])
        if target is not None and not caster.is_visible(station, (target + np.array([0, 0, 0.02]))[None])[0]:
            continue
        if all(np.linalg.norm(station - other) > SAME_STATION for other in found):
            found.append(station)
    return np.array(found).reshape(-1, 3)


def _floor_below(place: Points, caster: RayCaster) -> float | None:
    """Height of the floor under a place, m, if it is within half a metre of it."""
    start = place + np.array([0.0, 0.0, 0.5])
    down = caster.cast(start[None], np.array([[0.0, 0.0, -1.0]])).distance[0]
    return float(start[2] - down) if np.isfinite(down) and down < 1.0 else None


def _distance(flight: Flight, station: Points) -> float:
    middle = np.mean([step.nosing.mean(axis=0) for step in flight.steps], axis=0)
    return float(np.linalg.norm(middle - station))


def _motion(motion: tuple[float, float, float, float], pivot: Points) -> Transform:
    turn, *shift = motion
    about = transform_from_parts(rotation_from_vector([0.0, 0.0, turn]), pivot + np.array(shift))
    return np.asarray(about @ transform_from_parts(np.eye(3), -pivot))


def _beams(step: float) -> Float64Array:
    azimuth = np.arange(0.0, 2 * np.pi, step)
    elevation = np.arange(LOWEST_BEAM, np.pi / 2, step)
    a, e = (grid.ravel() for grid in np.meshgrid(azimuth, elevation, indexing="ij"))
    return np.stack([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)], axis=1)
