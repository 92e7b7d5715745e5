"""Carries out a mission's orders with a simulated robot, and feeds what it sees into the map."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from stairmap.arrays import Points
from stairmap.exploration.climber import Climber
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.pilot import DONE, RUNNING, Progress
from stairmap.exploration.scans import FLOOR, HIGH
from stairmap.exploration.simulated_robot import SimulatedRobot
from stairmap.exploration.stair_links import Link
from stairmap.geometry import wrapped_angle
from stairmap.simulation.sensors import Sensor

FRAME_DISTANCE = 0.40
"""A frame is taken so often on the way, m."""

FRAME_ANGLE = math.radians(40)
"""And after a turn so large: the views overlap by 30 deg."""

MATCHED_FRAME_ANGLE = math.radians(20)
"""After so large a turn where frames are laid over each other: they must have much in common, for odometry
errs by 7 % of a turn."""

ARRIVED = 0.08
"""A point of the way counts as reached so near to it, m."""

MAX_BEARING = math.radians(8)
"""The robot turns on the spot before it drives on with a larger error of heading."""

MIN_BLOCKING_POINTS = 4
"""So many points of a scan ahead are an obstacle; fewer are noise at an edge."""

STOPPING = 0.08
"""What is kept before an obstacle ahead beyond the body's radius, m."""

MIN_STEP = 0.05
"""Shortest way that the robot goes at a time before an obstacle, m."""

NEAR_ENOUGH = 0.4
"""Before an obstacle the end of the way counts as reached so near to it, m."""


class SimulatedPilot:
    """A pilot of a simulated robot.

    Parameters
    ----------
    robot
        Whom it steers.
    known
        What the robot knows; frames enter it.
    fine_sensor
        The camera at its full resolution, for looks at stairs.
    """

    def __init__(self, robot: SimulatedRobot, known: ExplorationMap, fine_sensor: Sensor) -> None:
        self.robot, self._known, self._fine = robot, known, fine_sensor
        self._frame_angle = FRAME_ANGLE if robot.odometry.is_perfect else MATCHED_FRAME_ANGLE
        self._poll: Callable[[], Progress] = lambda: DONE
        self._way: list[np.ndarray] = []
        self._since_distance, self._since_angle = math.inf, 0.0
        self.climber: Climber | None = None
        self.blocking: Points = np.empty((0, 2))

    def drive(self, way: Points) -> None:
        """Begin to drive along (N, 2) points, m, map."""
        self._way = [point[:2] for point in way[1:]] if len(way) > 1 else list(way)
        self._poll = self._drive_on

    def turn(self, heading: float) -> None:
        """Begin to turn to a heading, rad."""
        self._poll = lambda: self._turn_on(heading)

    def look(self, *, is_tilted: bool, is_fine: bool) -> None:
        """Take a frame."""
        self._take(is_tilted=is_tilted, is_fine=is_fine)
        self._poll = lambda: DONE

    def climb(self, link: Link, *, is_up: bool) -> None:
        """Begin to climb."""
        self.climber = Climber(self.robot, self._known, link, is_up=is_up)
        self._poll = self._climb_on

    def poll(self) -> Progress:
        """Do the next part of the order."""
        return self._poll()

    def _take(self, *, is_tilted: bool = False, is_fine: bool = False) -> None:
        self._known.take(self.robot.look(is_tilted=is_tilted, sensor=self._fine if is_fine else None))
        self._since_distance, self._since_angle = 0.0, 0.0

    def _climb_on(self) -> Progress:
        assert self.climber is not None
        progress = self.climber.poll()
        # Frames are taken on the way up only; after a climb that failed the robot stands where it began.
        self._known.believe(self.robot.odometry.pose)
        return progress

    def _turn_on(self, heading: float) -> Progress:
        error = wrapped_angle(heading - self._known.pose.heading)
        if abs(error) < math.radians(2):
            if self._since_angle > math.radians(5):
                self._take()
            return DONE
        part = float(np.clip(error, -self._frame_angle, self._frame_angle))
        self.robot.turn(part)
        self._since_angle += abs(part)
        self._known.believe(self.robot.odometry.pose)
        if self._since_angle >= 0.95 * self._frame_angle:
            self._take()
        return RUNNING

    def _drive_on(self) -> Progress:
        pose = self._known.pose
        while self._way and math.dist(self._way[0], (pose.x, pose.y)) < ARRIVED:
            self._way.pop(0)
        if not self._way:
            return DONE
        ahead = self._way[0] - [pose.x, pose.y]
        distance = float(np.hypot(*ahead))
        error = wrapped_angle(math.atan2(ahead[1], ahead[0]) - pose.heading)
        if abs(error) > MAX_BEARING:
            return self._turn_on_way(error)
        self.robot.turn(error)
        step = min(distance, FRAME_DISTANCE, max(FRAME_DISTANCE - self._since_distance, 0.1))
        if self._since_distance == math.inf or self._since_angle > math.radians(20):
            self._known.believe(self.robot.odometry.pose)
            self._take()
        room = self._room_ahead(step)
        if room >= step:
            room = self.robot.free_way(step)
            if room < step:
                self._note_ahead(room)
        if room < step:
            step = math.floor(room / MIN_STEP) * MIN_STEP
            if step <= 0:
                if len(self._way) == 1 and distance < NEAR_ENOUGH:
                    return DONE
                return Progress(state="failed", reason="something stands in the way")
        if not self.robot.drive(step):
            self._known.believe(self.robot.odometry.pose)
            self._note_ahead(0.0)
            return Progress(state="failed", reason="ran into something")
        self._since_distance += step
        self._known.believe(self.robot.odometry.pose)
        if self._since_distance >= 0.95 * FRAME_DISTANCE:
            self._take()
        return RUNNING

    def _note_ahead(self, room: float) -> None:
        """Note that something stands ahead beyond the room that is left, m."""
        pose = self._known.pose
        beyond = room + self.robot.body.radius + MIN_STEP
        at = (pose.x + beyond * math.cos(pose.heading), pose.y + beyond * math.sin(pose.heading))
        self.blocking = np.array([at])

    def _turn_on_way(self, error: float) -> Progress:
        part = float(np.clip(error, -self._frame_angle, self._frame_angle))
        self.robot.turn(part)
        self._since_angle += abs(part)
        self._known.believe(self.robot.odometry.pose)
        if self._since_angle >= 0.95 * self._frame_angle:
            self._take()
        return RUNNING

    def _room_ahead(self, step: float) -> float:
        """Return how far the last scan lets the robot go ahead, m, of a step; its body keeps clear."""
        scan = self._known.last_scan
        if scan is None or not self._known.poses:
            return step
        points = scan.placed(self._known.poses[-1])[(scan.kinds != FLOOR) & (scan.kinds != HIGH)]
        pose = self._known.pose
        offset = points[:, :2] - [pose.x, pose.y]
        cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
        along = offset[:, 0] * cosine + offset[:, 1] * sine
        across = offset[:, 1] * cosine - offset[:, 0] * sine
        radius = self.robot.body.radius
        near = (along > 0) & (along < step + radius + STOPPING) & (np.abs(across) < radius)
        self.blocking = np.empty((0, 2))
        if np.count_nonzero(near) < MIN_BLOCKING_POINTS:
            return step
        self.blocking = points[near, :2]
        return (
            float(np.partition(along[near], MIN_BLOCKING_POINTS - 1)[MIN_BLOCKING_POINTS - 1])
            - radius
            - STOPPING
        )
