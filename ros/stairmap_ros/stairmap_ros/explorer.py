"""The node that lets a robot explore: it decides as simulated missions do, and acts through actions."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from rclpy.node import Node
from std_srvs.srv import Trigger

from stairmap.errors import ConfigError
from stairmap.exploration.body import load_body
from stairmap.exploration.decision_log import DecisionLog
from stairmap.exploration.landings import classify_landings
from stairmap.exploration.mission import Mission, import_py_trees
from stairmap.exploration.simulated_robot import View
from stairmap_ros.action_pilot import REMIND, ActionPilot
from stairmap_ros.map_results_in import MapResultsIn
from stairmap_ros.mission_record import MissionRecord
from stairmap_ros.parameters import declare_explorer_parameters
from stairmap_ros.robot_map import RobotMap
from stairmap_ros.views_in import ViewsIn, camera_place

TICK = 0.02
"""Pause between two parts of a mission, s: actions and images take longer."""


class ExplorerNode(Node):
    """Depth images, TF and the map node's results in; goals of two actions out.

    Raises
    ------
    StairmapError
        If a parameter is not allowed, or a package is missing.
    """

    def __init__(self) -> None:
        super().__init__(
            "explorer", allow_undeclared_parameters=True, automatically_declare_parameters_from_overrides=True
        )
        self._own = declare_explorer_parameters(self)
        if not self._own.robot:
            raise ConfigError(
                "expected the parameter robot, a profile of stairmap check --list or a YAML file: what it "
                "can climb decides which stairs are climbed; pass robot:=NAME"
            )
        import_py_trees()
        self._body = load_body(self._own.robot)
        self._record = MissionRecord(self, self._own.output)
        self._views = ViewsIn(self, self._own)
        self._results = MapResultsIn(self, self._own.map_node)
        self._pilot: ActionPilot | None = None
        self._is_paused = self._is_stopped = False
        for name, serve in (("pause", self._pause), ("resume", self._resume), ("stop", self._stop)):
            self.create_service(Trigger, f"~/{name}", serve)

    def explore(self, *, should_stop: Callable[[], bool]) -> str:
        """Explore until nothing is left or until told to stop; return why it ended.

        Called by one thread while another spins the node.
        """
        view = self.wait_for_first_view(should_stop)
        if view is None:
            return "stopped before it began"
        mission = self.make_mission(view)
        pilot = self._pilot
        assert pilot is not None
        try:
            while mission.tick():
                if should_stop() or self._is_stopped:
                    mission.stop("stopped" if self._is_stopped else "interrupted")
                    break
                pilot.is_paused = self._is_paused
                self._views.num_stairways = len(self._results.stairways)
                time.sleep(TICK)
        finally:
            pilot.close()
        mission.known.refresh_stairs()
        classify_landings(mission.known)
        self._record.close(mission.known)
        self.get_logger().info(
            f"{mission.stopped}: {len(mission.known.levels.floors)} floors, {mission.known.area():.0f} m², "
            f"{mission.stairs_climbed} flights climbed"
        )
        return mission.stopped

    def wait_for_first_view(self, should_stop: Callable[[], bool]) -> View | None:
        """Return the first image that can be placed, once the map's node is there."""
        view = None
        while view is None or self._results.looked_ns is None:
            if should_stop() or self._is_stopped:
                return None
            newer = self._views.newest()
            view = view if newer is None else newer
            if view is not None:
                self.get_logger().warning(
                    f"waiting for the map's node: nothing on {self._results.topic}",
                    throttle_duration_sec=REMIND,
                    skip_first=True,
                )
            time.sleep(TICK)
        return view

    def make_mission(self, view: View) -> Mission:
        """Return a mission that begins where an image was taken."""
        place = camera_place(view)
        mount = replace(self._body.mount, camera_height=place.height, camera_pitch=place.pitch)
        body = replace(self._body, mount=mount)
        known = RobotMap(body, view.odometry, self._results, allow_unknown=self._own.allow_unknown)
        known.on_frame = lambda _view, _pose, detection: self._views.status.processed(
            detection, time.monotonic()
        )
        self._pilot = ActionPilot(self, self._own, known, views=self._views, results=self._results)
        begun = self.get_clock().now()
        return Mission(
            known=known,
            pilot=self._pilot,
            clock=lambda: (self.get_clock().now() - begun).nanoseconds * 1e-9,
            log=DecisionLog(self._record.write),
            strategy=self._own.strategy,
        )

    def _pause(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._is_paused = True
        response.success, response.message = True, "paused; a climb is finished first"
        return response

    def _resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._is_paused = False
        response.success, response.message = True, "goes on"
        return response

    def _stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._is_stopped = True
        response.success, response.message = True, "the goal at hand is cancelled, and the mission ends"
        return response
