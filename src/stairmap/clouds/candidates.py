"""From edges between tops to lattices of nosings: where flights may be, and how they head.

Edges that are near each other make a region. In each region the headings that many edges share are tried,
and along each the lattice search of images finds rows of nosings of equal rise and run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from stairmap.arrays import Float64Array, IntArray
from stairmap.clouds.edges import EdgeCells
from stairmap.config import EnvelopeConfig
from stairmap.detection.lattice import MAX_STRIP_GAP, MIN_STRIPS, Lattice, NosingGroups, find_lattices

LINK = 0.30
"""Edges within one or two cubes of this side are of one region, m: nosings are 0.2 to 0.5 m apart."""

MIN_REGION_LENGTH = 0.9
"""Least length of all edges of a region together, m: three nosings of the narrowest stairs seen in part."""

HEADING_BINS = 72
"""Headings are counted in bins of 5 degrees."""

HEADING_WIDTH = np.radians(35.0)
"""Edges within this of a heading are seen along it, rad: that of one column's edge is known no better."""

PEAK_SEPARATION = np.radians(40.0)
"""Headings that are nearer to each other than this are one, rad."""

MAX_HEADINGS = 6
"""Most headings of one region that are tried."""

MIN_HEADING_SHARE = 0.08
"""A heading is tried when it has this share of the edges of the commonest one."""

STRIP = 0.08
"""Width of the strips across a heading in which edges are told apart, m."""

FRONT_GAP = 0.14
"""Edges of one strip and level this far behind another are another one's, m: less than the smallest run."""

LEVEL_BIN = 0.05
"""Edges of a strip are told apart by height in bins of this, m, half of the smallest rise."""

SAME_NOSING = 0.034
"""Edges of neighbouring strips within this along and upward are of one nosing, m: as in images."""

ENVELOPE_SLACK, PITCH_SLACK_DEG = 1.15, 4.0
"""The envelope is widened by this factor, and by these degrees, for two nosings that may be neighbours."""

MAX_GROUPS = 150
"""Most nosings among which lattices are sought; those in the most strips."""

MAX_LATTICES = 8
"""Most lattices of one region and heading."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A lattice of nosings in a cloud.

    Attributes
    ----------
    origin
        (3,) nosing 0 in the middle of the strips that it was seen in, m.
    heading
        Direction of ascent, rad.
    rise, run
        Of the lattice, m.
    num_nosings
        Nosings from the lowest found to the highest.
    width
        Extent across of the strips, m.
    score
        That of the lattice.
    """

    origin: Float64Array
    heading: float
    rise: float
    run: float
    num_nosings: int
    width: float
    score: float


def find_candidates(cells: EdgeCells, cell: float, envelope: EnvelopeConfig) -> list[Candidate]:
    """Find lattices of nosings among the edges of a cloud, region by region.

    Parameters
    ----------
    cells
        Edges.
    cell
        Side of the columns that they were found in, m.
    envelope
        Dimensions a stairway may have.
    """
    candidates = []
    for members in _regions(cells, min_count=MIN_REGION_LENGTH / cell):
        place, height, direction = cells.place[members], cells.height[members], cells.direction[members]
        for heading in _headings(direction, min_count=MIN_REGION_LENGTH / cell / 2):
            turn = np.abs((direction - heading + np.pi) % (2 * np.pi) - np.pi)
            along = np.flatnonzero(~(turn > HEADING_WIDTH))
            candidates += _lattices_along(place[along], height[along], heading, envelope)
    return candidates


def _regions(cells: EdgeCells, *, min_count: float) -> list[IntArray]:
    """Indices of the edges of each region."""
    if not len(cells):
        return []
    cube = np.floor(np.column_stack([cells.place, cells.height]) / LINK).astype(np.int64)
    cube -= cube.min(axis=0) - 1
    shape = cube.max(axis=0) + 2
    key = (cube[:, 0] * shape[1] + cube[:, 1]) * shape[2] + cube[:, 2]
    distinct, owner = np.unique(key, return_inverse=True)
    rows, columns = [], []
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            for dz in (-1, 0, 1):
                other = distinct + (dx * shape[1] + dy) * shape[2] + dz
                found = np.minimum(np.searchsorted(distinct, other), len(distinct) - 1)
                hit = np.flatnonzero(distinct[found] == other)
                rows.append(hit)
                columns.append(found[hit])
    row, column = np.concatenate(rows), np.concatenate(columns)
    graph = coo_matrix((np.ones(len(row), dtype=bool), (row, column)), shape=(len(distinct), len(distinct)))
    _, label = connected_components(graph, directed=False)
    region = label[owner]
    order = np.argsort(region, kind="stable")
    bounds = np.flatnonzero(np.diff(region[order])) + 1
    return [part for part in np.split(order, bounds) if len(part) >= min_count]


def _headings(direction: Float64Array, *, min_count: float) -> list[float]:
    """Headings that many edges share, the commonest first."""
    known = direction[np.isfinite(direction)]
    if len(known) < min_count:
        return []
    width = 2 * np.pi / HEADING_BINS
    counts = np.bincount(((known + np.pi) / width).astype(np.int64) % HEADING_BINS, minlength=HEADING_BINS)
    smooth = np.zeros(HEADING_BINS)
    for shift in (-2, -1, 0, 1, 2):
        smooth += np.roll(counts, shift) * (3 - abs(shift))
    headings: list[float] = []
    highest = smooth.max()
    while len(headings) < MAX_HEADINGS:
        best = int(np.argmax(smooth))
        if smooth[best] < max(MIN_HEADING_SHARE * highest, min_count):
            break
        middle = -np.pi + (best + 0.5) * width
        offset = (known - middle + np.pi) % (2 * np.pi) - np.pi
        near = np.abs(offset) < 3.5 * width
        headings.append(float(middle + np.median(offset[near])))
        bins = -np.pi + (np.arange(HEADING_BINS) + 0.5) * width
        apart = np.abs((bins - headings[-1] + np.pi) % (2 * np.pi) - np.pi)
        smooth[apart < PEAK_SEPARATION] = 0.0
    return headings


def _lattices_along(
    place: Float64Array, height: Float64Array, heading: float, envelope: EnvelopeConfig
) -> list[Candidate]:
    if not len(place):
        return []
    forward, left = (
        np.array([np.cos(heading), np.sin(heading)]),
        np.array([-np.sin(heading), np.cos(heading)]),
    )
    center = place.mean(axis=0)
    s, t = (place - center) @ forward, (place - center) @ left
    low = t.min()
    strip = ((t - low) / STRIP).astype(np.int64)
    num_strips = int(strip.max()) + 1
    groups = _group_fronts(s, height, strip, num_strips)
    candidates = []
    for members in _possible_flights(groups, envelope):
        lattices = find_lattices(
            chosen_groups(groups, members), envelope, noise=0.0, max_lattices=MAX_LATTICES
        )
        candidates += [
            _candidate(lattice, center, heading, low)
            for lattice in lattices
            if lattice.run > 0 and len(lattice.indices) >= 2
        ]
    return candidates


def _group_fronts(s: Float64Array, z: Float64Array, strip: IntArray, num_strips: int) -> NosingGroups:
    """Join the foremost edges of each strip and level across neighbouring strips."""
    level = np.floor(z / LEVEL_BIN).astype(np.int64)
    order = np.lexsort((s, level, strip))
    s, z, strip, level = s[order], z[order], strip[order], level[order]
    is_front = np.ones(len(s), dtype=bool)
    is_front[1:] = (np.diff(strip) != 0) | (np.diff(level) != 0) | (np.diff(s) > FRONT_GAP)
    s, z, strip = s[is_front], z[is_front], strip[is_front]
    scaled = np.column_stack([s / SAME_NOSING, z / SAME_NOSING, strip / (MAX_STRIP_GAP + 0.5)])
    label = _components(cKDTree(scaled).query_pairs(1.0, p=np.inf, output_type="ndarray"), len(s))
    count = int(label.max(initial=-1)) + 1
    size = np.bincount(label, minlength=count)
    strips = np.zeros((count, num_strips), dtype=bool)
    strips[label, strip] = True
    keep = np.flatnonzero(strips.sum(axis=1) >= MIN_STRIPS)
    return NosingGroups(
        distance=(np.bincount(label, s, count) / size)[keep],
        height=(np.bincount(label, z, count) / size)[keep],
        strips=strips[keep],
    )


def _possible_flights(groups: NosingGroups, envelope: EnvelopeConfig) -> list[IntArray]:
    """Indices of the nosings that may be of one flight: each lies a step or two from another of them."""
    if len(groups) < 2:
        return []
    place = np.column_stack([groups.distance, groups.height])
    reach = 2.0 * float(np.hypot(envelope.max_run, envelope.max_rise)) * ENVELOPE_SLACK
    pairs = cKDTree(place).query_pairs(reach, output_type="ndarray")
    offset = place[pairs[:, 1]] - place[pairs[:, 0]]
    pitch = np.degrees(np.arctan2(offset[:, 1], offset[:, 0])) % 180.0
    first = np.argmax(groups.strips, axis=1)
    last = groups.strips.shape[1] - 1 - np.argmax(groups.strips[:, ::-1], axis=1)
    overlap = np.minimum(last[pairs[:, 0]], last[pairs[:, 1]]) - np.maximum(
        first[pairs[:, 0]], first[pairs[:, 1]]
    )
    is_step = (
        (np.abs(offset[:, 1]) > envelope.min_rise / ENVELOPE_SLACK)
        & (pitch > envelope.min_pitch_deg - PITCH_SLACK_DEG)
        & (pitch < envelope.max_pitch_deg + PITCH_SLACK_DEG)
        & (overlap >= MIN_STRIPS - 1)
    )
    label = _components(pairs[is_step], len(groups))
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    size = groups.strips.sum(axis=1)
    return [
        np.sort(part[np.argsort(-size[part], kind="stable")[:MAX_GROUPS]]) for part in parts if len(part) >= 2
    ]


def _components(pairs: IntArray, count: int) -> IntArray:
    """(N,) which connected part each of N things is in, given (P, 2) pairs that belong together."""
    graph = coo_matrix((np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def chosen_groups(groups: NosingGroups, members: IntArray) -> NosingGroups:
    """Return some of the nosings."""
    return NosingGroups(
        distance=groups.distance[members], height=groups.height[members], strips=groups.strips[members]
    )


def _candidate(lattice: Lattice, center: Float64Array, heading: float, low: float) -> Candidate:
    strips = np.flatnonzero(lattice.strips)
    sides = low + STRIP * np.array([strips[0], strips[-1] + 1])
    forward, left = (
        np.array([np.cos(heading), np.sin(heading)]),
        np.array([-np.sin(heading), np.cos(heading)]),
    )
    origin = center + lattice.distance * forward + sides.mean() * left
    return Candidate(
        origin=np.append(origin, lattice.height),
        heading=heading,
        rise=lattice.rise,
        run=lattice.run,
        num_nosings=int(lattice.indices[-1]) + 1,
        width=float(sides[1] - sides[0]),
        score=lattice.score,
    )
