"""Carries out a mission's orders with two actions: Nav2's ``NavigateToPose``, and ``ClimbStairway``."""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient
from rclpy.node import Node
from stairmap_msgs.action import ClimbStairway

from stairmap.arrays import Points
from stairmap.exploration.levels import SAME_LEVEL
from stairmap.exploration.odometry import Planar
from stairmap.exploration.pilot import DONE, RUNNING, Progress
from stairmap.exploration.simulated_pilot import FRAME_DISTANCE, MATCHED_FRAME_ANGLE
from stairmap.exploration.simulated_robot import View
from stairmap.exploration.stair_links import Link
from stairmap.geometry import wrapped_angle
from stairmap_ros.action_order import ActionOrder, Ending
from stairmap_ros.climb_goal import make_climb_goal
from stairmap_ros.map_results_in import MapResultsIn
from stairmap_ros.messages import make_header, pose_at
from stairmap_ros.node_config import ExplorerConfig
from stairmap_ros.robot_map import RobotMap
from stairmap_ros.views_in import ViewsIn

MAX_VIEW_WAIT = 5.0
"""So long a look waits for an image that can be placed, s."""

MAX_ANSWER_WAIT = 3.0
"""So long it waits until the map's node has looked at that image too, s: the next decision needs that."""

REMIND = 10.0
"""How often the log says what is waited for, s."""

CLOSE_WAIT = 5.0
"""How long a goal may take to end after it was cancelled at shutdown, s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Server:
    """An action's client, with names for messages."""

    client: ActionClient
    name: str
    hint: str


class ActionPilot:
    """A pilot (``stairmap.exploration.pilot``) of a robot behind two actions.

    Nav2 keeps its own map of what stands in the way, so ``blocking`` stays empty: a place that cannot be
    reached is given up after some tries.

    Parameters
    ----------
    node
        Whose clients these are.
    own
        Names of actions and coordinate frames.
    known
        What the robot knows; images enter it.
    views, results
        Where images and the map node's answers come from.

    Attributes
    ----------
    is_paused
        While it is set no goal is sent, and driving is interrupted; a climb is finished first.
    """

    def __init__(
        self, node: Node, own: ExplorerConfig, known: RobotMap, *, views: ViewsIn, results: MapResultsIn
    ) -> None:
        self._node, self._own, self._known = node, own, known
        self._views, self._results = views, results
        self._navigate = _Server(
            client=ActionClient(node, NavigateToPose, own.navigate_action),
            name=own.navigate_action,
            hint="is Nav2 active?",
        )
        self._climb = _Server(
            client=ActionClient(node, ClimbStairway, own.climb_action),
            name=own.climb_action,
            hint="the robot's own software must serve it",
        )
        self.blocking: Points = np.empty((0, 2))
        self.is_paused = False
        self._steps: Iterator[Progress] = iter(())
        self._order: ActionOrder | None = None
        self._taken_at: Planar | None = None

    def drive(self, way: Points) -> None:
        """Begin to drive to the end of (N, 2) points, m, map; Nav2 finds its own way there."""
        end = np.asarray(way)[-1]
        before = np.asarray(way)[-2] if len(way) > 1 else self._known.pose.place[:2]
        heading = math.atan2(end[1] - before[1], end[0] - before[0])
        self._steps = self._go_to(float(end[0]), float(end[1]), heading)

    def turn(self, heading: float) -> None:
        """Begin to turn to a heading, rad, map; an image is taken at the end."""
        self._steps = self._turn_to(heading)

    def look(self, *, is_tilted: bool, is_fine: bool) -> None:
        """Take the next image, as the camera gives it: it is neither tilted nor finer than others."""
        self._steps = self._look_standing()

    def climb(self, link: Link, *, is_up: bool) -> None:
        """Begin to use a flight."""
        self._steps = self._climb_flight(link, is_up=is_up)

    def poll(self) -> Progress:
        """Do the next part of the order."""
        return next(self._steps, DONE)

    def close(self) -> None:
        """Cancel the goal at hand and wait for its end, at most ``CLOSE_WAIT``."""
        deadline = time.monotonic() + CLOSE_WAIT
        if self._order is not None:
            self._order.cancel()
        while self._order is not None and self._order.poll() is None and time.monotonic() < deadline:
            time.sleep(0.02)

    def _go_to(self, x: float, y: float, heading: float) -> Iterator[Progress]:
        pose = PoseStamped(pose=pose_at(np.array([x, y, self._known.pose.z]), heading))
        pose.header = make_header(self._own.map_frame, self._now_ns())
        ending = yield from self._carry_out(self._navigate, NavigateToPose.Goal(pose=pose), may_pause=True)
        if ending.state != "succeeded":
            yield Progress(state="failed", reason=ending.reason)

    def _turn_to(self, heading: float) -> Iterator[Progress]:
        yield from self._stop()
        pose = self._known.pose
        for progress in self._go_to(pose.x, pose.y, heading):
            yield progress
            if progress.state == "failed":
                return
        yield from self._take_next()

    def _look_standing(self) -> Iterator[Progress]:
        yield from self._stop()
        yield from self._take_next()

    def _take_next(self) -> Iterator[Progress]:
        """Take the first image of after now, and wait until the map's node has looked at it."""
        begun, asked_ns = time.monotonic(), self._now_ns()
        while True:
            view = self._see()
            if view is not None and view.frame.stamp_ns >= asked_ns:
                break
            if time.monotonic() - begun > MAX_VIEW_WAIT:
                reason = f"no depth image could be placed for {MAX_VIEW_WAIT:g} s"
                self._node.get_logger().warning(reason)
                yield Progress(state="failed", reason=reason)
                return
            yield RUNNING
        self._take(view)
        begun = time.monotonic()
        while (self._results.looked_ns or 0) < view.frame.stamp_ns:
            if time.monotonic() - begun > MAX_ANSWER_WAIT:
                self._node.get_logger().warning(
                    f"the map's node says nothing of the last image on {self._results.topic}; is it active?",
                    throttle_duration_sec=REMIND,
                )
                return
            yield RUNNING

    def _climb_flight(self, link: Link, *, is_up: bool) -> Iterator[Progress]:
        begun = self._known.pose.z
        header = make_header(self._own.map_frame, self._now_ns())
        goal = make_climb_goal(link, header, is_up=is_up)
        ending = yield from self._carry_out(self._climb, goal, may_pause=False)
        # The next image tells where the robot stands, whatever the server said.
        for progress in self._take_next():
            if progress.state == "failed":
                yield Progress(state="failed", reason=progress.reason, is_stranded=True)
                return
            yield progress
        if ending.state == "succeeded" and ending.result.arrived:
            return
        reason = getattr(ending.result, "reason", "") or ending.reason or "the robot did not arrive"
        height = self._known.pose.z - begun
        yield Progress(state="failed", reason=reason, is_stranded=abs(height) > SAME_LEVEL)

    def _stop(self) -> Iterator[Progress]:
        """Cancel the drive that a mission left because it was not needed any more."""
        if self._order is not None:
            self._order.cancel()
            while self._order.poll() is None:
                self._see()
                yield RUNNING
            self._order = None

    def _carry_out(self, server: _Server, goal: Any, *, may_pause: bool) -> Generator[Progress, None, Ending]:
        """Send a goal when nothing else is under way, and again after a pause; return how it ended."""
        yield from self._stop()
        while True:
            yield from self._wait_for(server)
            order = self._order = ActionOrder(self._node, server.client, goal, server.name)
            is_interrupted = False
            while (ending := order.poll()) is None:
                view = self._see()
                if view is not None and self._is_elsewhere(view.odometry):
                    self._take(view)
                if self.is_paused and may_pause and not is_interrupted:
                    is_interrupted = True
                    order.cancel()
                yield RUNNING
            self._order = None
            if ending.state != "cancelled" or not is_interrupted:
                return ending

    def _wait_for(self, server: _Server) -> Iterator[Progress]:
        """Wait until the pause is over and somebody serves an action."""
        while self.is_paused or not server.client.server_is_ready():
            if not self.is_paused:
                self._node.get_logger().warning(
                    f"waiting for the action {server.name}: nobody serves it; {server.hint}",
                    throttle_duration_sec=REMIND,
                )
            self._see()
            yield RUNNING

    def _see(self) -> View | None:
        """Return a new image, if there is one; the robot is where it was taken."""
        view = self._views.newest()
        if view is not None:
            self._known.believe(view.odometry)
        return view

    def _take(self, view: View) -> None:
        self._known.take(view)
        self._taken_at = view.odometry

    def _is_elsewhere(self, pose: Planar) -> bool:
        """Tell whether the last image was taken from a place that is far enough off."""
        last = self._taken_at
        if last is None:
            return True
        turn = abs(wrapped_angle(pose.heading - last.heading))
        way = float(np.linalg.norm(pose.place - last.place))
        return way >= FRAME_DISTANCE or turn >= MATCHED_FRAME_ANGLE

    def _now_ns(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)
