"""The generative model of a stairway: flights of equal steps and the landings between them.

A flight is the report's model (ARL-TR-6381 section 3.1): an inclined plane through
the nosings (eq. 1) inside a level box turned to the heading (eqs. 2-4). Its
coordinate frame has its origin at the bottom centre of the first riser, x up the
stairs and level, y to the left, z up. Everything is in map coordinates, metres, radians.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, Transform, Vector, readonly
from stairmap.input_files import validated
from stairmap.saved_stairway import SavedFlight, SavedFlightStd, SavedLanding, SavedStairway, SavedStep
from stairmap.transforms import transform_from_parts, transform_points

UNKNOWN_STEP_STD = (float("nan"), float("nan"))
"""Standard deviations of a step about which nothing is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One riser with the tread behind it, as it was seen.

    Attributes
    ----------
    nosing
        (2, 3) segment, left end first seen from below, m, map.
    num_observations
        In how many observations it was seen; 0 for a step the model only infers.
    std
        Standard deviations of the nosing along the flight's heading and upward, m, against the other steps
        of the flight: a common error of place is in the flight's ``std.base``. NaN where not known.
    """

    nosing: Points
    num_observations: int
    std: tuple[float, float] = UNKNOWN_STEP_STD

    def __post_init__(self) -> None:
        object.__setattr__(self, "nosing", readonly(self.nosing))
        object.__setattr__(self, "std", (float(self.std[0]), float(self.std[1])))

    def to_dict(self) -> dict[str, Any]:
        """Return the step as JSON types."""
        return {
            "nosing": rounded(self.nosing),
            "num_observations": self.num_observations,
            "std": [_null_or_rounded(value) for value in self.std],
        }

    @classmethod
    def from_saved(cls, saved: SavedStep) -> Step:
        """Rebuild a step from what a file holds; schema 1 knows no ``std``."""
        along, up = saved.std
        return cls(
            nosing=np.array(saved.nosing),
            num_observations=saved.num_observations,
            std=(_number_or_nan(along), _number_or_nan(up)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightStd:
    """One standard deviation of each measure of a flight (m, rad); ``base`` is (3,) along map x, y, z.

    ``overhang`` is NaN where the overhang is not known.
    """

    rise: float
    run: float
    width: float
    pitch: float
    heading: float
    base: Vector
    overhang: float = float("nan")

    def __post_init__(self) -> None:
        object.__setattr__(self, "base", readonly(self.base))

    def to_dict(self) -> dict[str, Any]:
        """Return the deviations as JSON types."""
        names = ("rise", "run", "width", "pitch", "heading")
        return {
            **{name: rounded(getattr(self, name)) for name in names},
            "base": rounded(self.base),
            "overhang": _null_or_rounded(self.overhang),
        }

    @classmethod
    def from_saved(cls, saved: SavedFlightStd) -> FlightStd:
        """Rebuild the deviations from what a file holds; schema 1 knows no ``overhang``."""
        names = ("rise", "run", "width", "pitch", "heading", "overhang")
        return cls(
            **{name: _number_or_nan(getattr(saved, name)) for name in names},
            base=np.array([_number_or_nan(value) for value in saved.base]),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """Bounding box of a flight: level, turned to its heading (m, map)."""

    center: Vector
    height: float
    width: float
    depth: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", readonly(self.center))

    def to_dict(self) -> dict[str, Any]:
        """Return the box as JSON types."""
        return {
            "center": rounded(self.center),
            "height": rounded(self.height),
            "width": rounded(self.width),
            "depth": rounded(self.depth),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """A straight run of steps between two landings or floors.

    Attributes
    ----------
    base
        (3,) bottom centre of the first riser, m, map; where nosings overhang, below the first nosing.
    heading
        Direction of ascent in the map's xy plane, counter-clockwise from +x, rad.
    rise, run, width
        Mean dimensions of a step, m.
    num_risers
        Number of risers from the lower level to the upper one.
    left_bounded, right_bounded
        Whether that end of the steps was seen; otherwise the width is a lower bound.
    overhang
        How far a nosing stands out before its riser, m; NaN where not known.
    bottom_seen, top_seen
        Whether the floor before the first riser and the level behind the last nosing were seen; ``False``:
        the flight may go on there. ``None``: not known, as in files of schema 1 and by methods that do not
        tell. See ``is_open_below`` and ``is_open_above``.
    std
        Standard deviations of the measures.
    steps
        The steps that were seen or inferred, from the lowest; empty for an ideal flight.
    """

    base: Vector
    heading: float
    rise: float
    run: float
    width: float
    num_risers: int
    left_bounded: bool = True
    right_bounded: bool = True
    overhang: float = float("nan")
    bottom_seen: bool | None = None
    top_seen: bool | None = None
    std: FlightStd
    steps: tuple[Step, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "base", readonly(self.base))
        for name in ("rise", "run", "width"):
            if not getattr(self, name) > 0:
                raise ValueError(f"a flight's {name} must be positive, got {getattr(self, name)}")
        if self.num_risers < 1:
            raise ValueError(f"a flight has at least one riser, got {self.num_risers}")

    @property
    def is_open_below(self) -> bool:
        """Whether the flight may begin lower: its first riser was not seen to stand on a floor."""
        return not self.bottom_seen

    @property
    def is_open_above(self) -> bool:
        """Whether the flight may go on: its last nosing was not seen to be the edge of a floor."""
        return not self.top_seen

    @property
    def pitch(self) -> float:
        """Angle of the nosing line to the horizontal, rad."""
        return float(np.arctan2(self.rise, self.run))

    @property
    def forward(self) -> Vector:
        """(3,) unit vector up the stairs and level, map."""
        return np.array([np.cos(self.heading), np.sin(self.heading), 0.0])

    @property
    def map_from_flight(self) -> Transform:
        """(4, 4) transform from the flight's coordinate frame to the map."""
        forward = self.forward
        left = np.array([-forward[1], forward[0], 0.0])
        return transform_from_parts(np.stack([forward, left, [0.0, 0.0, 1.0]], axis=1), self.base)

    @property
    def plane(self) -> Float64Array:
        """(4,) inclined plane through the nosings: a·x + b·y + c·z + d = 0 (report eq. 1).

        The normal has unit length and points up.
        """
        normal = np.array([0.0, 0.0, np.cos(self.pitch)]) - np.sin(self.pitch) * self.forward
        first_nosing = self.base + np.array([0.0, 0.0, self.rise])
        return np.append(normal, -normal @ first_nosing)

    @property
    def box(self) -> Box:
        """Level box from the lower floor to the last nosing (report eqs. 2-4).

        Its height is the whole rise, its depth the distance from the first riser to the
        last; for a single step the depth is one run.
        """
        depth = max(self.num_risers - 1, 1) * self.run
        height = self.num_risers * self.rise
        center = self.base + self.forward * depth / 2 + [0.0, 0.0, height / 2]
        return Box(center=center, height=height, width=self.width, depth=depth)

    def box_planes(self) -> Float64Array:
        """Return the (6, 4) planes of the box: top, bottom, back, front, right, left (report eqs. 2-4).

        They are derived from the coefficients (a, b, c) of the inclined plane as the report
        writes them, then scaled to unit normals. All normals point out of the box.
        """
        a, b, c, _ = self.plane
        box = self.box
        x, y, z = box.center
        level = np.hypot(a, b)
        planes = []
        for sign in (1.0, -1.0):
            planes.append(np.array([0.0, 0.0, sign, -sign * z - box.height / 2]))
        for sign in (-1.0, 1.0):
            planes.append(
                np.array([sign * a, sign * b, 0.0, -sign * (a * x + b * y) - box.depth / 2 * level]) / level
            )
        for sign in (1.0, -1.0):
            offset = -sign * (-c * b * x + c * a * y) - box.width / 2 * c * level
            planes.append(np.array([-sign * c * b, sign * c * a, 0.0, offset]) / (c * level))
        return np.array(planes)

    def edges(self) -> Points:
        """Return the (num_risers, 2, 3) nosings of the model, lowest first, left end first, m, map."""
        index = np.arange(self.num_risers)
        nosings = np.zeros((self.num_risers, 2, 3))
        nosings[..., 0] = (index * self.run)[:, None]
        nosings[..., 1] = np.array([0.5, -0.5]) * self.width
        nosings[..., 2] = ((index + 1) * self.rise)[:, None]
        return transform_points(self.map_from_flight, nosings)

    def surface(self) -> tuple[Points, IntArray]:
        """Return the clean stair surface as a mesh.

        Risers and the treads between them, without a tread on the upper floor.

        Returns
        -------
        (M, 3) vertices in the map, m, and (K, 3) triangles, counter-clockwise seen from outside.
        """
        profile = []
        for index in range(self.num_risers):
            profile.append((index * self.run, index * self.rise))
            profile.append((index * self.run, (index + 1) * self.rise))
        local = np.zeros((len(profile), 2, 3))
        local[..., 0] = np.array(profile)[:, 0, None]
        local[..., 1] = np.array([0.5, -0.5]) * self.width
        local[..., 2] = np.array(profile)[:, 1, None]
        vertices = transform_points(self.map_from_flight, local.reshape(-1, 3))
        triangles = []
        for row in range(len(profile) - 1):
            left, right, next_left, next_right = 2 * row, 2 * row + 1, 2 * row + 2, 2 * row + 3
            triangles += [(left, right, next_right), (left, next_right, next_left)]
        return vertices, np.array(triangles, dtype=np.int64)

    def to_dict(self) -> dict[str, Any]:
        """Return the flight as it stands in ``stairways.json``."""
        return {
            "base": rounded(self.base),
            "heading": rounded(self.heading),
            "rise": rounded(self.rise),
            "run": rounded(self.run),
            "width": rounded(self.width),
            "pitch": rounded(self.pitch),
            "num_risers": self.num_risers,
            "width_bounded": {"left": self.left_bounded, "right": self.right_bounded},
            "overhang": _null_or_rounded(self.overhang),
            "bottom_seen": self.bottom_seen,
            "top_seen": self.top_seen,
            "std": self.std.to_dict(),
            "box": self.box.to_dict(),
            "plane": rounded(self.plane),
            "steps": [step.to_dict() for step in self.steps],
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Flight:
        """Rebuild a flight from ``to_dict``; box, plane and pitch follow from the rest.

        What schema 1 has no key for is unknown: overhang, whether the ends were seen, deviations of steps.

        Raises
        ------
        ValueError
            If a key is missing or a value impossible; see ``stairmap.saved_stairway``.
        """
        return cls.from_saved(validated(SavedFlight, _none_for_nan(data)))

    @classmethod
    def from_saved(cls, saved: SavedFlight) -> Flight:
        """Rebuild a flight from what a file holds."""
        return cls(
            base=np.array(saved.base),
            heading=saved.heading,
            rise=saved.rise,
            run=saved.run,
            width=saved.width,
            num_risers=saved.num_risers,
            left_bounded=saved.width_bounded.left,
            right_bounded=saved.width_bounded.right,
            overhang=_number_or_nan(saved.overhang),
            bottom_seen=saved.bottom_seen,
            top_seen=saved.top_seen,
            std=FlightStd.from_saved(saved.std),
            steps=tuple(Step.from_saved(step) for step in saved.steps),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Landing:
    """Level platform at an end of a flight.

    Attributes
    ----------
    center
        (3,) centre of its surface, m, map.
    size
        (length along ``heading``, width), m.
    heading
        Direction of its length, rad.
    """

    center: Vector
    size: tuple[float, float]
    heading: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", readonly(self.center))
        object.__setattr__(self, "size", (float(self.size[0]), float(self.size[1])))

    def to_dict(self) -> dict[str, Any]:
        """Return the landing as it stands in ``stairways.json``."""
        return {
            "center": rounded(self.center),
            "size": rounded(self.size),
            "heading": rounded(self.heading),
        }

    @classmethod
    def from_saved(cls, saved: SavedLanding) -> Landing:
        """Rebuild a landing from what a file holds."""
        length, width = saved.size
        return cls(center=np.array(saved.center), size=(length, width), heading=saved.heading)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stairway:
    """A staircase from one floor to another: its flights and the landings between them, lowest first.

    Attributes
    ----------
    id
        Number of the stairway, the same from one query to the next.
    flights, landings
        Its parts; landing ``i`` follows flight ``i``.
    num_observations
        Number of observations that made it.
    first_seen_ns, last_seen_ns
        Stamps of the first and last of them, nanoseconds.
    """

    id: int
    flights: tuple[Flight, ...]
    landings: tuple[Landing, ...] = field(default=())
    num_observations: int
    first_seen_ns: int
    last_seen_ns: int

    @property
    def num_risers(self) -> int:
        """Number of risers of all flights."""
        return sum(flight.num_risers for flight in self.flights)

    def edges(self) -> Points:
        """Return the (num_risers, 2, 3) nosings of all flights, lowest first, m, map."""
        return np.concatenate([flight.edges() for flight in self.flights])

    def surface(self) -> tuple[Points, IntArray]:
        """Return vertices (M, 3) and triangles (K, 3) of all flights and landings; see ``Flight.surface``."""
        parts = [flight.surface() for flight in self.flights]
        parts += [_landing_surface(landing) for landing in self.landings]
        vertices, triangles, count = [], [], 0
        for part_vertices, part_triangles in parts:
            vertices.append(part_vertices)
            triangles.append(part_triangles + count)
            count += len(part_vertices)
        return np.concatenate(vertices), np.concatenate(triangles)

    def to_dict(self) -> dict[str, Any]:
        """Return the stairway as it stands in ``stairways.json`` (docs/outputs.md)."""
        return {
            "id": self.id,
            "num_observations": self.num_observations,
            "first_seen_ns": self.first_seen_ns,
            "last_seen_ns": self.last_seen_ns,
            "flights": [flight.to_dict() for flight in self.flights],
            "landings": [landing.to_dict() for landing in self.landings],
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Stairway:
        """Rebuild a stairway from ``to_dict``.

        Raises
        ------
        ValueError
            If a key is missing or a value impossible; see ``stairmap.saved_stairway``.
        """
        return cls.from_saved(validated(SavedStairway, _none_for_nan(data)))

    @classmethod
    def from_saved(cls, saved: SavedStairway) -> Stairway:
        """Rebuild a stairway from what a file holds."""
        return cls(
            id=saved.id,
            num_observations=saved.num_observations,
            first_seen_ns=saved.first_seen_ns,
            last_seen_ns=saved.last_seen_ns,
            flights=tuple(Flight.from_saved(flight) for flight in saved.flights),
            landings=tuple(Landing.from_saved(landing) for landing in saved.landings),
        )


def rounded(values: Any) -> Any:
    """Return a number or nested numbers as JSON types, rounded to 1e-6 (micrometres, microradians)."""
    return np.round(np.asarray(values, dtype=np.float64), 6).tolist()


def _null_or_rounded(value: float) -> float | None:
    """A number as JSON has it, ``None`` for one that is not known."""
    return float(rounded(value)) if np.isfinite(value) else None


def _number_or_nan(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _none_for_nan(values: Any) -> Any:
    """Nested JSON types with ``None`` for NaN, which readers put in its place for an unknown number."""
    if isinstance(values, dict):
        return {key: _none_for_nan(value) for key, value in values.items()}
    if isinstance(values, list):
        return [_none_for_nan(value) for value in values]
    return None if isinstance(values, float) and np.isnan(values) else values


def _landing_surface(landing: Landing) -> tuple[Points, IntArray]:
    """Two triangles of a landing, facing up."""
    forward = np.array([np.cos(landing.heading), np.sin(landing.heading), 0.0]) * landing.size[0] / 2
    left = np.array([-np.sin(landing.heading), np.cos(landing.heading), 0.0]) * landing.size[1] / 2
    corners = [-forward - left, forward - left, forward + left, -forward + left]
    return landing.center + np.array(corners), np.array([[0, 1, 2], [0, 2, 3]])
