"""Steps, stringers, railings and walls of one flight, as solids in the flight's coordinate frame."""

from __future__ import annotations

from stairmap.arrays import Points
from stairmap.simulation.stair_shapes import FlightShape, Side
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_block, make_prism, make_wall

_WAIST = 0.15
"""Vertical thickness of a sloping slab below the inner corners of its steps, m."""


def make_flight_mesh(shape: FlightShape, nosings: Points) -> TriangleMesh:
    """Return the mesh of a flight.

    Parameters
    ----------
    shape
        Its dimensions.
    nosings
        (num_risers, 2, 3) true nosings, lowest first, left end first, m.
    """
    solids = _open_steps(shape, nosings) if shape.open_risers else _closed_steps(shape, nosings)
    for side, sign in ((shape.left, 1.0), (shape.right, -1.0)):
        solids += _make_side(side, sign, shape, nosings)
    return joined(solids)


def _closed_steps(shape: FlightShape, nosings: Points) -> list[TriangleMesh]:
    half, slope = shape.width / 2, shape.rise / shape.run
    # The last tread is a slab as deep as one run; the floor behind it is the scene's.
    fronts = [*nosings[:, 0, 0], nosings[-1, 0, 0] + shape.run - shape.overhang]
    solids = []
    for index, (nosing_x, _, z) in enumerate(nosings[:, 0]):
        # The last tread is the upper floor, which is level.
        fall = shape.tread_slope if index + 1 < shape.num_risers else 0.0
        front, back = fronts[index] + shape.overhang, fronts[index + 1] + shape.overhang
        below_front, below_back = 0.0, 0.0
        if shape.soffit:
            below_front, below_back = front * slope - _WAIST, back * slope - _WAIST
        top_front, top_back = z + fall * (front - nosing_x), z + fall * (back - nosing_x)
        profile = [(front, below_front), (back, below_back), (back, top_back), (front, top_front)]
        solids.append(make_prism(profile, -half, half))
        if shape.overhang > 0:
            tip = front - shape.overhang
            lip = [(tip, z - shape.lip), (front, top_front - shape.lip), (front, top_front), (tip, z)]
            solids.append(make_prism(lip, -half, half))
    return solids


def _open_steps(shape: FlightShape, nosings: Points) -> list[TriangleMesh]:
    half = shape.width / 2
    solids = []
    for index in range(shape.num_risers):
        x, z = nosings[index, 0, 0], nosings[index, 0, 2]
        solids.append(make_block([x, -half, z - shape.lip], [x + shape.run + shape.overhang, half, z]))
    slope, end = shape.rise / shape.run, nosings[-1, 0, 0]
    upper, lower = shape.rise - 0.03, shape.rise - 0.28
    profile = [
        (0.02, 0.0),
        (max(-lower / slope, 0.03), max(lower, 0.0)),
        (end, lower + end * slope),
        (end, upper + end * slope),
        (0.02, upper),
    ]
    for sign in (1.0, -1.0):
        right, left = sorted((sign * half, sign * (half - 0.04)))
        solids.append(make_prism(profile, right, left))
    return solids


def _make_side(side: Side, sign: float, shape: FlightShape, nosings: Points) -> list[TriangleMesh]:
    y = sign * shape.width / 2
    first, last = nosings[0, 0], nosings[-1, 0]
    end = last[0] + shape.run
    if side == "wall":
        return [make_wall((-0.3, y), (end + 1.0, y), 0.0, last[2] + 2.5)]
    if side == "railing":
        return _make_railing(y - sign * 0.03, first, last, nosings, shape)
    return []


def _make_railing(
    y: float, first: Points, last: Points, nosings: Points, shape: FlightShape
) -> list[TriangleMesh]:
    height, post = 0.9, 0.02
    solids = []
    for nosing in nosings[:, 0]:
        x, z = nosing[0] + shape.run / 2, nosing[2]
        solids.append(make_block([x - post, y - post, z], [x + post, y + post, z + height]))
    x0, x1 = first[0] + shape.run / 2 - 0.1, last[0] + shape.run / 2 + 0.1
    slope = shape.rise / shape.run
    z0, z1 = first[2] + height - 0.1 * slope, last[2] + height + 0.1 * slope
    profile = [(x0, z0 - 0.03), (x1, z1 - 0.03), (x1, z1 + 0.03), (x0, z0 + 0.03)]
    solids.append(make_prism(profile, y - 0.025, y + 0.025))
    return solids
