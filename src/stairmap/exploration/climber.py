"""Climbs a flight riser by riser, feeling each one, and turns back where it cannot go on."""

from __future__ import annotations

import math

import numpy as np

from stairmap.arrays import Vector
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.pilot import DONE, RUNNING, Progress
from stairmap.exploration.simulated_robot import SimulatedRobot
from stairmap.exploration.stair_links import Link
from stairmap.geometry import wrapped_angle
from stairmap.modeling.landings import top_of
from stairmap.navigation.standoff import STANDOFF

STRIDE = 0.05
"""The climber moves so far before it feels again, m."""

MIN_RISER = 0.05
"""A change of the ground's height over one stride that counts as a riser, m."""

FEEL_AHEAD = 0.10
"""Front feet feel so far ahead, m."""

RISER_TOLERANCE = 0.012
"""Risers above the robot's limit by more than this end the climb, m: first and last of a flight differ."""

MIN_FELT = 3
"""Risers whose mean is held against the limit for flights."""

MAX_SIDESTEP = 0.02
"""Correction across the flight for a stride, m."""

ROOM_AHEAD = 0.12
"""What is kept from a wall ahead beyond the body's radius, m."""

FRAME_DISTANCE = 0.35
"""A frame is taken so often on the stairs, m."""


SIDE_ROOM = 0.10
"""Nearer to the body's side than this nothing should come on stairs, m: where it believes to be is that far
off at times, and it sees what is right beside it."""


class Climber:
    """One climb, up or down.

    Parameters
    ----------
    robot, known
        Who climbs, and what it knows; its model of the flight grows meanwhile.
    link
        The flight.
    is_up
        Whether up.
    """

    def __init__(self, robot: SimulatedRobot, known: ExplorationMap, link: Link, *, is_up: bool) -> None:
        self._robot, self._known, self._link, self._is_up = robot, known, link, is_up
        self.risers: list[float] = []
        self._since_riser = 0.0
        self._since_frame = 0.0
        self._gone = 0.0
        self._way_back: list[tuple[float, float]] = []
        self._failure = ""

    @property
    def has_failed(self) -> bool:
        """Whether it is on its way back."""
        return bool(self._failure)

    def poll(self) -> Progress:
        """Climb to the next riser, or a few strides on the level; the first reason to turn back ends it."""
        if self._failure:
            return self._step_back()
        self._align()
        for _ in range(10):
            refusal = self._refusal()
            if refusal:
                self._failure = refusal
                return RUNNING
            if self._is_at_end():
                return DONE
            z = self._robot.pose.z
            aside = self._aside()
            if not self._robot.is_free_aside(STRIDE, aside):
                self._failure = "something is right beside the body on the stairs"
                return RUNNING
            if not self._robot.climb(STRIDE, aside):
                self._failure = "ran into something on the stairs"
                return RUNNING
            self._way_back.append((STRIDE, aside))
            self._gone += STRIDE
            self._since_frame += STRIDE
            rise = self._robot.pose.z - z
            if abs(rise) > MIN_RISER:
                self.risers.append(rise)
                self._since_riser = 0.0
                break
            self._since_riser += STRIDE
        if self._since_frame >= FRAME_DISTANCE:
            self._since_frame = 0.0
            self._known.take(self._robot.look())
        return RUNNING

    def _align(self) -> None:
        error = wrapped_angle(self._heading() - self._known_heading())
        if abs(error) > math.radians(1.0):
            self._robot.turn(error)

    def _heading(self) -> float:
        heading = self._link.flight.heading
        return heading if self._is_up else heading + math.pi

    def _known_heading(self) -> float:
        return self._known.believed(self._robot.odometry.pose).heading

    def _aside(self) -> float:
        """Way to the left that brings the robot to the middle of the flight, and off what is beside it, m."""
        left, right = self._robot.look_aside()
        if min(left, right) < self._robot.body.radius + SIDE_ROOM:
            return float(np.clip((left - right) / 2, -MAX_SIDESTEP, MAX_SIDESTEP))
        flight = self._link.flight
        place = self._known.believed(self._robot.odometry.pose).place
        lateral = float((place - flight.base)[:2] @ flight.map_from_flight[:2, 1])
        correction = -lateral if self._is_up else lateral
        return float(np.clip(correction, -MAX_SIDESTEP, MAX_SIDESTEP))

    def _is_at_end(self) -> bool:
        """Whether the ground has been level for long enough, or there is no room for more."""
        if not self.risers:
            return False
        flight = self._link.flight
        if self._since_riser >= max(STANDOFF, 1.3 * flight.run):
            return True
        scan = self._known.last_scan
        half = self._robot.body.radius
        if scan is None or self._since_riser < flight.run or not self._is_beyond_last():
            return False
        room = self._robot.look_ahead() - half - ROOM_AHEAD
        return room < STRIDE

    def _is_beyond_last(self) -> bool:
        flight = self._link.flight
        end: Vector = top_of(flight) if self._is_up else flight.base
        return abs(float(end[2]) - self._robot.pose.z) < 1.5 * flight.rise

    def _refusal(self) -> str:
        """Say why the climb cannot go on; empty if it can."""
        profile = self._robot.body.profile
        ahead = self._robot.feel(FEEL_AHEAD)
        if math.isnan(ahead):
            return "feet find no ground ahead"
        single = profile.max_single_rise
        if single is not None and abs(ahead) > single + RISER_TOLERANCE:
            return f"a riser of {abs(ahead):.3f} m is above the robot's single step of {single:g} m"
        limit = profile.max_continuous_rise
        felt = np.abs(self.risers[1:])
        if limit is not None and len(felt) >= MIN_FELT and felt.mean() > limit + RISER_TOLERANCE / 2:
            return f"risers of {felt.mean():.3f} m were felt, above the robot's limit of {limit:g} m"
        flight = self._link.flight
        longest = flight.num_risers * flight.run + 40 * flight.run
        if not self.risers and self._gone > 2 * STANDOFF + flight.run:
            return "there are no steps where they should be"
        return "the stairs do not end" if self._gone > longest else ""

    def _step_back(self) -> Progress:
        for _ in range(10):
            if not self._way_back:
                return Progress(state="failed", reason=self._failure)
            forward, aside = self._way_back.pop()
            if not self._robot.climb(-forward, -aside):
                reason = f"{self._failure}; stuck on the way back"
                return Progress(state="failed", reason=reason, is_stranded=True)
        return RUNNING
