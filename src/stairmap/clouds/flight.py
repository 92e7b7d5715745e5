"""A flight as it was measured in a cloud, and the observation that it makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Points, Vector
from stairmap.clouds.candidates import Candidate
from stairmap.clouds.section import Section
from stairmap.clouds.sides import StepSides
from stairmap.detection.observation import StairEdge, StairObservation

TILT_STD = 1e-3
"""Standard deviation of up that a level cloud is believed to have, rad."""

OVERLAP_SHARE = 0.5
"""A flight most of whose nosings lie on one that was accepted before is the same."""

MAX_TURN = np.radians(25.0)
"""Lattices in one place that head less than this apart share their line of nosings, rad."""

MAX_OFF_TREAD = 0.3
"""Treads that two lattices share lie within this share of the rise of each other upward."""

MAX_OFF_LINE = 0.25
"""Nosings of the same flight lie within this of its line of nosings upward, m."""

MAX_POINTS = 2000
"""About so many points go along with an observation."""

MAX_STEP_STD = 0.05
"""Standard deviation of a step's place where only its neighbours tell it, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CloudFlight:
    """A flight as it was measured in a cloud.

    Attributes
    ----------
    section, sides
        Its section and its ends.
    points
        (N, 3) points about it, m.
    num_on
        How many of these lie on its steps.
    """

    section: Section
    sides: StepSides
    points: Points
    num_on: int


def nosing_middles(section: Section, sides: StepSides) -> Points:
    """(K, 3) middles of the nosings, in the cloud, m."""
    profile = section.profile
    return section.axes.to_cloud(
        np.column_stack(
            [profile.nosing_distances, np.full(profile.num_steps, sides.middle), profile.tread_heights[1:]]
        )
    )


def lies_on(one: CloudFlight, other: CloudFlight) -> bool:
    """Whether most steps of a flight lie on those of another: of two lattices on the same steps one is wrong.

    Another lattice that heads nearly as the other does has its nosings near the other's line of nosings; one
    that runs across the steps aslant has its treads at the height of the other's.
    """
    section, profile = one.section, other.section.profile
    turn = section.axes.heading - other.section.axes.heading
    if np.cos(turn) <= 0.0:
        return False
    middles = nosing_middles(section, one.sides)
    is_aslant = np.cos(turn) < np.cos(MAX_TURN)
    if is_aslant:
        middles = middles + 0.5 * section.profile.run * section.axes.forward
    local = other.section.axes.from_cloud(middles)
    index = (local[:, 0] - profile.distance) / profile.run
    on = (
        (index > -1.5)
        & (index < profile.num_steps + 0.5)
        & (local[:, 1] > other.sides.right)
        & (local[:, 1] < other.sides.left)
    )
    if is_aslant:
        off_tread = local[:, 2] - profile.height - np.floor(index) * profile.rise
        on &= np.abs(off_tread) < MAX_OFF_TREAD * profile.rise
    else:
        off_line = local[:, 2] - profile.height - index * profile.rise
        on &= np.abs(off_line) < MAX_OFF_LINE
    return bool(np.count_nonzero(on) > OVERLAP_SHARE * len(on))


def is_part_of(candidate: Candidate, flight: CloudFlight) -> bool:
    """Whether a lattice is but some nosings of a flight, not worth measuring again."""
    profile = flight.section.profile
    if np.cos(candidate.heading - flight.section.axes.heading) < np.cos(MAX_TURN):
        return False
    heading = np.array([np.cos(candidate.heading), np.sin(candidate.heading), 0.0])
    step = candidate.run * heading + [0.0, 0.0, candidate.rise]
    middles = candidate.origin + np.arange(candidate.num_nosings)[:, None] * step
    local = flight.section.axes.from_cloud(middles)
    index = (local[:, 0] - profile.distance) / profile.run
    off_line = local[:, 2] - profile.height - index * profile.rise
    on = (index > -0.5) & (index < profile.num_steps - 0.5) & (np.abs(off_line) < 0.5 * profile.rise)
    on &= (local[:, 1] > flight.sides.right) & (local[:, 1] < flight.sides.left)
    return bool(on.all())


def observation_from_flight(
    flight: CloudFlight, origin: Vector, level_from_points: Float64Array, stamp_ns: int
) -> StairObservation:
    """Return a flight as an observation in the coordinate frame of the points.

    Parameters
    ----------
    flight
        In a level cloud, relative to ``origin``.
    origin
        (3,) where that cloud's coordinates begin, in level coordinates, m.
    level_from_points
        (3, 3) turn of the points into level coordinates.
    stamp_ns
        Stamp of the observation.
    """
    section, sides = flight.section, flight.sides
    profile, axes = section.profile, section.axes
    turn = level_from_points.T

    def out(points: Points) -> Points:
        return np.asarray((axes.to_cloud(points) + origin) @ turn.T)

    edges = []
    nosings, levels = profile.nosing_distances, profile.tread_heights[1:]
    for step in np.flatnonzero(section.is_step_seen).tolist():
        s, z = float(nosings[step]), float(levels[step])
        # The floor at the top may reach farther than the flight.
        is_floor = section.top_seen and step == profile.num_steps - 1
        right, left = (sides.right, sides.left) if is_floor else sides.of_step(step)
        edges.append(
            StairEdge(
                nosing=out(np.array([[s, left, z], [s, right, z]])),
                step_index=step,
                left_bounded=sides.left_bounded,
                right_bounded=sides.right_bounded,
                cue="crease",
                num_pixels=0,
                std=(
                    float(min(section.risers.std[step], MAX_STEP_STD)),
                    float(min(section.treads.std[step + 1], MAX_STEP_STD)),
                ),
            )
        )
    std = section.std
    variances = np.array([std.rise, std.run, std.distance, std.height, TILT_STD, std.heading]) ** 2
    return StairObservation(
        stamp_ns=stamp_ns,
        view="ascending",
        up=turn @ np.array([0.0, 0.0, 1.0]),
        forward=turn @ axes.forward,
        edges=tuple(edges),
        rise=profile.rise,
        run=profile.run,
        width=sides.width,
        origin=out(np.array([[profile.distance, sides.middle, profile.height]]))[0],
        covariance=np.diag(variances),
        floor_seen=section.floor_seen,
        top_seen=section.top_seen,
        overhang=profile.overhang,
        overhang_std=std.overhang,
        points=(flight.points[:: max(len(flight.points) // MAX_POINTS, 1)] + origin) @ turn.T,
    )
