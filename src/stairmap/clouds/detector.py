"""Detect flights of stairs in points: the one entry for gathered sweeps and finished maps."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Points, Vector
from stairmap.clouds.axes import StairAxes
from stairmap.clouds.candidates import Candidate, find_candidates
from stairmap.clouds.edges import find_edge_cells
from stairmap.clouds.flight import CloudFlight, is_part_of, lies_on, observation_from_flight
from stairmap.clouds.judgement import judge
from stairmap.clouds.noise import estimate_noise
from stairmap.clouds.section import EXTENSION, Section, fit_section
from stairmap.clouds.sides import StepSides, find_sides
from stairmap.clouds.thinning import ThinnedCloud
from stairmap.clouds.tops import Columns, find_tops, sort_into_columns
from stairmap.config import Config
from stairmap.detection.observation import Detection, Rejection
from stairmap.detection.profile import StairProfile
from stairmap.transforms import rotation_between

CELL = 0.05
"""Side of the columns, m: a fifth of a tread."""

MARGIN = 0.9
"""Points this far around a candidate are looked at, m."""

INNER_SHARE = 0.8
"""Steps are measured within this share of the width in which they were found: ends are ragged."""

MIN_SCORE = 5.0
"""Candidates of fewer strips are not worth a look."""


MIN_POINTS = 100
"""Fewest points that can show three steps."""

MAX_NOISE = 0.03
"""Noise that is assumed at most, m: beyond, steps cannot be told from it."""


def detect_points(
    points: Points,
    *,
    up: Vector,
    noise: float | None = None,
    config: Config | None = None,
    stamp_ns: int = 0,
) -> Detection:
    """Detect flights of stairs in points.

    Parameters
    ----------
    points
        (N, 3) finite points, m, in any coordinate frame.
    up
        (3,) unit vector opposite to gravity in it.
    noise
        Standard deviation of a point, m; found from the level surfaces where not given.
    config
        Uses the sections ``envelope`` and ``detection.min_steps``.
    stamp_ns
        Stamp of the result.

    Returns
    -------
    One observation for each flight, in the coordinate frame of the points. Flights that were looked at and
    refused leave their reasons.
    """
    config = Config() if config is None else config
    points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    if len(points) < MIN_POINTS:
        return Detection(
            stamp_ns=stamp_ns,
            observations=(),
            rejections=(Rejection(rule="min_points", measured=len(points), limit=MIN_POINTS, unit="1"),),
        )
    level_from_points = rotation_between(np.asarray(up, dtype=np.float64), np.array([0.0, 0.0, 1.0]))
    turned = points @ level_from_points.T
    cloud = ThinnedCloud(turned.mean(axis=0))
    cloud.add(turned)
    flights, rejections = detect_flights(cloud.points(), noise=noise, config=config)
    observations = tuple(
        observation_from_flight(flight, cloud.origin, level_from_points, stamp_ns) for flight in flights
    )
    return Detection(stamp_ns=stamp_ns, observations=observations, rejections=tuple(rejections))


def detect_flights(
    points: Float32Array, *, noise: float | None = None, config: Config
) -> tuple[list[CloudFlight], list[Rejection]]:
    """Detect the flights in (N, 3) thinned points, z up, m; also return why candidates were refused."""
    columns = sort_into_columns(points, CELL)
    noise = min(estimate_noise(columns) if noise is None else noise, MAX_NOISE)
    tops = find_tops(columns, noise=noise)
    envelope = config.envelope
    edges = find_edge_cells(
        columns, tops, min_rise=envelope.min_rise - 0.01, max_rise=envelope.max_rise + 0.03
    )
    candidates = find_candidates(edges, CELL, envelope)
    flights: list[CloudFlight] = []
    refused: list[Rejection] = []
    for candidate in sorted(candidates, key=lambda item: -item.score):
        if candidate.score < MIN_SCORE:
            break
        if any(is_part_of(candidate, flight) for flight in flights):
            continue
        measured = measure_candidate(columns, candidate, noise)
        if measured is None:
            continue
        section, sides, around = measured
        support, rejections = judge(section, sides, around, noise, config)
        found = CloudFlight(section=section, sides=sides, points=around, num_on=support.num_on)
        if any(lies_on(found, flight) and found.num_on <= flight.num_on for flight in flights):
            continue
        if rejections:
            refused += rejections
            continue
        flights = [
            flight for flight in flights if not (lies_on(flight, found) and flight.num_on < found.num_on)
        ]
        flights.append(found)
    return flights, refused


def measure_candidate(
    columns: Columns, candidate: Candidate, noise: float
) -> tuple[Section, StepSides, Float64Array] | None:
    """Measure a candidate's section, then its sides, then the section over the whole width."""
    axes = StairAxes(origin=candidate.origin, heading=candidate.heading)
    profile = StairProfile(
        distance=0.0, height=0.0, run=candidate.run, rise=candidate.rise, num_steps=candidate.num_nosings
    )
    around = points_around(columns, axes, profile, candidate.width)
    half = 0.5 * INNER_SHARE * candidate.width
    section = fit_section(around, axes, profile, (-half, half), noise)
    if section is not None and section.profile.num_steps > candidate.num_nosings:
        # It goes on: there may be more of it than was looked at.
        around = points_around(columns, section.axes, section.profile, candidate.width)
        section = fit_section(around, section.axes, section.profile, (-half, half), noise)
    if section is None:
        return None
    sides = find_sides(around, section, noise)
    if sides.width > 0.3:
        margin = min(0.5 * (1 - INNER_SHARE) * sides.width, 0.1)
        again = fit_section(
            around, section.axes, section.profile, (sides.right + margin, sides.left - margin), noise
        )
        if again is not None:
            section = again
            sides = find_sides(around, section, noise)
    return section, sides, around


def points_around(columns: Columns, axes: StairAxes, profile: StairProfile, width: float) -> Float64Array:
    """Return the (N, 3) points about a flight of some width, m, that may be of it or stand on it."""
    length = max(profile.num_steps - 1, 1) * profile.run
    start = axes.to_cloud(np.array([profile.distance, 0.0, profile.height]))
    center = start[:2] + 0.5 * length * axes.forward[:2]
    radius = 0.5 * float(np.hypot(length, width)) + MARGIN + EXTENSION * profile.run
    around = columns.within(center, radius).astype(np.float64)
    offset = around - start
    over = offset[:, 2] - profile.rise / profile.run * (offset @ axes.forward)
    return np.asarray(around[(over > -2.5 * profile.rise) & (over < 1.2)])
