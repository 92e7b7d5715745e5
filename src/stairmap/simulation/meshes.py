"""Real buildings as scenes: ``mesh.ply`` with the stairs measured in it, ``stairs.json``.

A flight is truth when the file calls it usable; others, and every flight of a stair that
also winds, are optional. Truth is measured from tread to tread: rise is
``riser_between_treads.mean``, run ``going.mean``, width ``width.median``. The base lies on
the lower floor (``z_bottom``), below the first nosing (``first_edge_mid``); where the
first riser is irregular, the nosings in ``steps`` say so and ``Flight.edges`` does not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import Points
from stairmap.errors import RecordingError
from stairmap.input_files import MAX_COORDINATE, read_limited
from stairmap.simulation.building_stairs import (
    MeasuredFlight,
    MeasuredPart,
    MeasuredStairs,
    load_measured_stairs,
)
from stairmap.simulation.scene import Route, Scene, make_approach_route
from stairmap.simulation.stairs import true_std
from stairmap.simulation.triangle_mesh import TriangleMesh
from stairmap.stairway import Flight, Stairway, Step

_MIN_APPROACH = 1.4
"""Free floor before a flight that a robot needs to see it, m."""

_MAX_APPROACH = 4.8
"""Longest approach that is driven, m."""

_PLY_TYPES = {"char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4",
              "float": "<f4", "double": "<f8", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2",
              "int32": "<i4", "uint32": "<u4", "float32": "<f4", "float64": "<f8"}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _Approach:
    """A flight, the free floor that was measured before it (m), and whether it is truth."""

    flight: Flight
    free: float
    is_certain: bool


MAX_MESH_SIZE = 2**30
"""Largest mesh of a building, bytes: twenty million triangles."""


def load_ply(path: Path) -> TriangleMesh:
    """Read the triangles of a binary little-endian PLY file.

    Raises
    ------
    RecordingError
        If it cannot be read, is not binary little endian, or holds faces that are no triangles.
    """
    data = read_limited(path, max_size=MAX_MESH_SIZE, error_type=RecordingError, what="the mesh ")
    header, separator, body = data.partition(b"end_header\n")
    lines = [line.split() for line in header.decode("ascii", "replace").splitlines()]
    if not separator or ["format", "binary_little_endian", "1.0"] not in lines:
        raise RecordingError(f"expected a binary little-endian PLY file, but {path} is not one")
    try:
        counts, fields = _read_header(lines)
        vertex_type = np.dtype(fields["vertex"])
        vertices = np.frombuffer(body, vertex_type, counts["vertex"])
        faces = np.frombuffer(
            body, np.dtype(fields["face"]), counts["face"], vertex_type.itemsize * counts["vertex"]
        )
        points = np.stack([vertices[axis] for axis in "xyz"], axis=1).astype(np.float64)
        nums, corners = faces["num"], faces["corners"]
    except (IndexError, KeyError, TypeError, ValueError) as error:
        raise RecordingError(f"{path} does not hold vertices x y z and then triangles: {error}") from error
    if np.any(nums != 3):
        raise RecordingError(f"expected triangles in {path}, but some faces have other than three corners")
    if not corners.size or not 0 <= corners.min() <= corners.max() < len(points):
        raise RecordingError(
            f"expected triangles between the {len(points):,} vertices of {path}, but some name others"
        )
    if not (np.abs(points) <= MAX_COORDINATE).all():
        raise RecordingError(f"expected vertices in metres in {path}, but some lie off the earth or nowhere")
    sides = points[corners[:, 1:]] - points[corners[:, :1]]
    if not np.cross(sides[:, 0], sides[:, 1]).any():
        raise RecordingError(f"expected triangles in {path}, but none of its {len(corners):,} has an area")
    return TriangleMesh(vertices=points, triangles=corners)


def load_building_scenes(folder: Path) -> tuple[Scene, ...]:
    """Return one scene for every flight of a building that a robot can drive up to.

    All share the mesh and the truth of the whole building; their routes differ. A building
    without such a flight gives one scene that drives to its first optional flight, or
    to the lowest step of a winding stair.

    Raises
    ------
    RecordingError
        If a file cannot be read or lacks a key.
    """
    mesh = load_ply(folder / "mesh.ply")
    path = folder / "stairs.json"
    measured = load_measured_stairs(path)
    stairways, optional, approaches = _read_stairways(measured)
    certain = [approach for approach in approaches if approach.is_certain]
    free = [_free_floor(mesh, approach) for approach in certain]
    routes = [
        make_building_route(approach.flight, distance)
        for approach, distance in zip(certain, free, strict=True)
        if distance >= _MIN_APPROACH
    ]
    if not routes and approaches:
        routes = [make_building_route(approaches[0].flight, _free_floor(mesh, approaches[0]))]
    if not routes:
        parts = [part for stair in measured.stairs for part in stair.other_parts]
        if not parts:
            raise RecordingError(f"expected flights or other parts of stairs in {path}, but it has none")
        routes = [_winding_stair_route(mesh, parts)]
    return tuple(
        Scene(
            name=f"building:{folder.name}/{number}",
            mesh=mesh,
            stairways=stairways,
            optional_stairways=optional,
            route=route,
        )
        for number, route in enumerate(routes, start=1)
    )


def make_building_route(flight: Flight, free: float) -> Route:
    """Return a route to a flight with ``free`` m of floor before it, straight ahead of its middle."""
    distance = free - 0.3
    lateral = 0.25 * min(flight.width, 1.2) if distance > 2 else 0.1
    return make_approach_route(
        flight, distance=distance, stop=min(0.6, distance - 0.4), lateral=lateral, first_turn=0.3
    )


def _read_header(lines: list[list[str]]) -> tuple[dict[str, int], dict[str, list[tuple[Any, ...]]]]:
    counts: dict[str, int] = {}
    fields: dict[str, list[tuple[Any, ...]]] = {}
    element = ""
    for line in lines:
        if line[:1] == ["element"]:
            element = line[1]
            counts[element], fields[element] = int(line[2]), []
            if counts[element] < 0:
                raise ValueError(f"{line[2]} of {element}")
        elif line[:2] == ["property", "list"]:
            # Triangles only: the list has a fixed length, and numpy can read it in one go.
            fields[element] += [("num", _PLY_TYPES[line[2]]), ("corners", _PLY_TYPES[line[3]], (3,))]
        elif line[:1] == ["property"]:
            fields[element].append((line[2], _PLY_TYPES[line[1]]))
    return counts, fields


def _read_stairways(
    measured: MeasuredStairs,
) -> tuple[tuple[Stairway, ...], tuple[Stairway, ...], list[_Approach]]:
    """Return truth, optional stairways, and the flights to drive to with the free floor before them."""
    certain, optional, approaches = [], [], []
    for stair in measured.stairs:
        winds = any(part.kind == "winders" for part in stair.other_parts)
        flights = []
        for entry in stair.flights:
            flight = _read_flight(entry)
            is_certain = entry.usable and not winds
            if is_certain:
                flights.append(flight)
            else:
                optional.append((flight,))
            approaches.append(_Approach(flight=flight, free=entry.approach_free_m, is_certain=is_certain))
        if flights:
            certain.append(tuple(sorted(flights, key=lambda flight: float(flight.base[2]))))
    numbered = [
        Stairway(id=index, flights=flights, num_observations=0, first_seen_ns=0, last_seen_ns=0)
        for index, flights in enumerate([*certain, *optional], start=1)
    ]
    return tuple(numbered[: len(certain)]), tuple(numbered[len(certain) :]), approaches


def _read_flight(entry: MeasuredFlight) -> Flight:
    forward = np.array([*entry.ascend_dir, 0.0])
    edge, run, width = np.array(entry.first_edge_mid), entry.going.mean, entry.width.median
    heights = list(entry.tread_z)
    if entry.n_risers == entry.n_treads + 1:
        heights.append(entry.z_top)
    left = np.array([-forward[1], forward[0], 0.0])
    return Flight(
        base=np.array([edge[0], edge[1], entry.z_bottom]),
        heading=float(np.arctan2(forward[1], forward[0])),
        rise=entry.riser_between_treads.mean,
        run=run,
        width=width,
        num_risers=entry.n_risers,
        bottom_seen=True,
        top_seen=True,
        # How far nosings stand out was not measured in these buildings.
        std=replace(true_std(), overhang=float("nan")),
        steps=tuple(
            Step(nosing=_nosing(edge, forward * run * index, left * width / 2, z), num_observations=0)
            for index, z in enumerate(heights)
        ),
    )


def _nosing(edge: Points, along: Points, half: Points, z: float) -> Points:
    middle = np.array([edge[0] + along[0], edge[1] + along[1], z])
    return np.array([middle + half, middle - half])


def _free_floor(mesh: TriangleMesh, approach: _Approach) -> float:
    """Return how far back from a flight's base there is floor at its height, m.

    The file measures how far nothing stands in the way; on a landing the floor ends before that.
    """
    flight = approach.flight
    corners = mesh.vertices[mesh.triangles]
    level = np.all(np.abs(corners[..., 2] - flight.base[2]) < 0.05, axis=1)
    floor = corners[level][..., :2]
    distances = np.arange(0.1, min(approach.free, _MAX_APPROACH) + 1e-9, 0.1)
    points = (flight.base - distances[:, None] * flight.forward)[:, :2]
    has_floor = np.array([_is_inside_any(point, floor) for point in points], dtype=bool)
    # Cracks between floor slabs are no end of the floor.
    gone = ~has_floor[:-1] & ~has_floor[1:]
    return float(distances[np.argmax(gone)]) if gone.any() else float(distances[-1])


def _is_inside_any(point: Points, triangles: Points) -> bool:
    """Tell whether a (2,) point lies in any of (N, 3, 2) triangles of the plan."""
    sides = np.roll(triangles, -1, axis=1) - triangles
    offsets = point - triangles
    cross = sides[..., 0] * offsets[..., 1] - sides[..., 1] * offsets[..., 0]
    return bool(np.any(np.all(cross >= -1e-9, axis=1) | np.all(cross <= 1e-9, axis=1)))


def _winding_stair_route(mesh: TriangleMesh, parts: list[MeasuredPart]) -> Route:
    x, y = min(parts, key=lambda part: min(part.tread_z)).lowest_place
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))[:2] / 2
    away = middle - [x, y]
    away /= max(float(np.linalg.norm(away)), 1e-9)
    start, end = np.array([x, y]) + 3.0 * away, np.array([x, y]) + 1.2 * away
    return Route(waypoints=np.array([[*start, 0.0], [*end, 0.0]]))
