"""A robot in a simulated world as its own process: it publishes what it sees and serves two actions.

Runs in the environment of ``make_environment.py``, as ``exploring_robot.py WORLD.npz OUT.json``. WORLD holds
``vertices``, ``triangles``, ``start`` (x, y, z, heading) and ``stuck_after``: going down it stays behind so
many risers (0: it does not). What happened to the robot is in OUT.json when
it is told to end (SIGTERM). It moves as fast as it can: stamps are of the wall clock, way and speed are not.
"""

from __future__ import annotations

import json
import math
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path
from threading import Event, RLock
from types import SimpleNamespace
from typing import Any

import numpy as np
import rclpy
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from robot_messages import raw_image, time_message, transform_message
from sensor_msgs.msg import CameraInfo, Image
from stairmap_msgs.action import ClimbStairway
from tf2_msgs.msg import TFMessage

from stairmap.exploration.body import load_body
from stairmap.exploration.climber import Climber
from stairmap.exploration.exploration_map import map_from_body
from stairmap.exploration.level_search import LevelSearch
from stairmap.exploration.odometry import Planar
from stairmap.exploration.pilot import Progress
from stairmap.exploration.simulated_robot import LEG_REACH, SimulatedRobot, View
from stairmap.exploration.world import STEP_OVER, World
from stairmap.geometry import wrapped_angle
from stairmap.navigation.floors import FloorError
from stairmap.navigation.occupancy import FREE, UNKNOWN, OccupancyGrid
from stairmap.navigation.planner import FloorPlanner
from stairmap.simulation.odometry import PERFECT_ODOMETRY
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.triangle_mesh import TriangleMesh
from stairmap_ros.stairway_messages_in import flight_from_message, yaw_of

OPTICAL = "camera_depth_optical_frame"
CELL = 0.1
STEP, TURN = 0.2, math.radians(20)
IDLE_PERIOD = 0.2
MARGIN = 0.08
"""What the planner keeps from walls beyond the body, m."""


class ExploringRobot(Node):
    """Serves ``navigate_to_pose`` and ``climb_stairway``."""

    def __init__(self, world: World, start: Planar, *, stuck_after: int = 0) -> None:
        super().__init__("exploring_robot")
        self.body = load_body("spot")
        sensor = make_sensor("kinect_v2", factor=0.5)
        self.robot = SimulatedRobot(world, self.body, sensor, start, seed=1, model=PERFECT_ODOMETRY)
        self.goals: list[dict[str, Any]] = []
        self._stuck_after = stuck_after
        self._lock = RLock()
        self._ground: dict[int, OccupancyGrid] = {}
        self._tf_out = self.create_publisher(TFMessage, "/tf", 100)
        self._depth_out = self.create_publisher(Image, "depth/image_rect_raw", 5)
        self._info_out = self.create_publisher(CameraInfo, "depth/camera_info", 5)
        group = ReentrantCallbackGroup()
        for kind, name, execute in (
            (NavigateToPose, "navigate_to_pose", self._navigate),
            (ClimbStairway, "climb_stairway", self._climb),
        ):
            ActionServer(
                self,
                kind,
                name,
                execute_callback=execute,
                cancel_callback=lambda _: CancelResponse.ACCEPT,
                callback_group=group,
            )
        self.create_timer(IDLE_PERIOD, self.look, callback_group=group)

    def look(self) -> None:
        """Publish a frame of now."""
        with self._lock:
            self.publish(self.robot.look())

    def publish(self, view: View) -> None:
        """Publish a frame with the robot's pose."""
        stamp_ns = time.time_ns()
        self._tf_out.publish(
            TFMessage(
                transforms=[
                    transform_message("map", "base_footprint", map_from_body(view.odometry), stamp_ns),
                    transform_message("base_footprint", OPTICAL, view.body_from_camera, stamp_ns),
                ]
            )
        )
        camera = view.frame.camera
        info = CameraInfo(height=camera.height, width=camera.width)
        info.k = np.array([camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1])
        info.p = np.array([camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0])
        image = raw_image(np.rint(np.nan_to_num(view.frame.depth * 1000.0)).astype(np.uint16))
        for message in (info, image):
            message.header.frame_id, message.header.stamp = OPTICAL, time_message(stamp_ns)
        self._info_out.publish(info)
        self._depth_out.publish(image)

    def _navigate(self, handle: Any) -> NavigateToPose.Result:
        goal = handle.request.pose.pose
        target = np.array([goal.position.x, goal.position.y])
        way = self._plan(target)
        self._note("navigate", end=target.tolist(), found=way is not None)
        if way is None:
            handle.abort()
            return NavigateToPose.Result(error_code=9001, error_msg="no way to the goal")
        for x, y in way[1:]:
            while (distance := math.dist((x, y), (self.robot.pose.x, self.robot.pose.y))) > 0.02:
                ahead = math.atan2(y - self.robot.pose.y, x - self.robot.pose.x)
                if not self._turn(ahead, handle):
                    return NavigateToPose.Result()
                with self._lock:
                    went_well = self.robot.drive(min(distance, STEP))
                self.look()
                if not went_well:
                    handle.abort()
                    return NavigateToPose.Result(error_code=9002, error_msg="ran into something")
        if self._turn(yaw_of(goal.orientation), handle):
            handle.succeed()
        return NavigateToPose.Result()

    def _turn(self, heading: float, handle: Any) -> bool:
        """Turn; false if the goal was cancelled meanwhile."""
        while True:
            if handle.is_cancel_requested:
                handle.canceled()
                self.goals[-1]["is_cancelled"] = True
                return False
            error = wrapped_angle(heading - self.robot.pose.heading)
            if abs(error) < 1e-3:
                return True
            with self._lock:
                self.robot.turn(float(np.clip(error, -TURN, TURN)))
            if abs(error) > TURN / 2:
                self.look()

    def _climb(self, handle: Any) -> ClimbStairway.Result:
        goal = handle.request
        is_up = goal.direction == ClimbStairway.Goal.UP
        self._note("climb", flights=len(goal.flights), is_up=is_up, stairway=goal.stairway)
        known = SimpleNamespace(take=self.publish, believed=lambda pose: pose, last_scan=())
        link = SimpleNamespace(flight=flight_from_message(goal.flights[0]))
        climber = Climber(self.robot, known, link, is_up=is_up)
        feedback = ClimbStairway.Feedback()
        while True:
            with self._lock:
                progress = climber.poll()
            self.look()
            feedback.step = len(climber.risers)
            handle.publish_feedback(feedback)
            if not is_up and len(climber.risers) == self._stuck_after > 0:
                progress = Progress(state="failed", reason="a leg is stuck")
            if progress.state != "running":
                break
        result = ClimbStairway.Result(arrived=progress.state == "done", reason=progress.reason)
        result.pose.header = goal.header
        place = result.pose.pose.position
        place.x, place.y, place.z = self.robot.pose.place.tolist()
        handle.succeed() if result.arrived else handle.abort()
        return result

    def _note(self, kind: str, **values: Any) -> None:
        self.goals.append({"kind": kind, **values})

    def _plan(self, target: np.ndarray) -> np.ndarray | None:
        """Return the way to a place on the level where the robot is, by the true ground."""
        key = round(self.robot.pose.z * 10)
        if key not in self._ground:
            self._ground[key] = self._true_ground(self.robot.pose.z)
        grid = self._ground[key]
        planner = FloorPlanner({0: grid}, (), self.body.profile)
        try:
            found = planner.search(0, self.robot.pose.place[:2])
        except FloorError:
            return None
        search = LevelSearch(
            level=0, grid=grid, open_ground=grid, opaque=grid.cells != FREE, planner=planner, found=found
        )
        return search.way_to(target)

    def _true_ground(self, height: float) -> OccupancyGrid:
        world = self.robot.world
        columns, rows = np.ceil((world.high - world.low)[:2] / CELL).astype(int)
        cells = np.full((rows, columns), UNKNOWN, dtype=np.int8)
        grid = OccupancyGrid(cells=cells, resolution=CELL, origin=tuple(world.low[:2].tolist()))
        index = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), -1).reshape(-1, 2)
        places = np.column_stack([grid.centers(*index.T), np.full(len(index), height)])
        angles = np.arange(24) * math.pi / 12
        ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(24)], axis=1) * (self.body.radius + MARGIN)
        feet = (places[:, None] + np.concatenate([np.zeros((1, 3)), ring])).reshape(-1, 3)
        # From above the lowest steps: below their treads the floor may go on.
        is_level = np.abs(world.ground(feet, up=LEG_REACH).reshape(len(places), -1) - height) < STEP_OVER
        is_free = is_level.all(axis=1)
        wide = replace(self.body, radius=self.body.radius + MARGIN)
        if is_free.any():
            is_free[is_free] = ~world.are_blocked(places[is_free], wide)
        cells = cells.copy()
        cells[index[is_free, 0], index[is_free, 1]] = FREE
        return replace(grid, cells=cells)

    def outcome(self) -> dict[str, Any]:
        """Return what happened to the robot as JSON types."""
        counters = self.robot.counters
        return {
            "falls": counters.falls,
            "collisions": counters.collisions,
            "path_m": counters.path_m,
            "height": self.robot.pose.z,
            "goals": self.goals,
        }


def main() -> None:
    """Serve until told to end."""
    world_file, out_file = (Path(name) for name in sys.argv[1:])
    stopped = Event()
    signal.signal(signal.SIGTERM, lambda *_: stopped.set())
    with np.load(world_file) as arrays:
        mesh = TriangleMesh(vertices=arrays["vertices"], triangles=arrays["triangles"])
        x, y, z, heading = arrays["start"].tolist()
        stuck_after = int(arrays["stuck_after"])
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    robot = ExploringRobot(World(mesh), Planar(x=x, y=y, z=z, heading=heading), stuck_after=stuck_after)
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(robot)
    try:
        while not stopped.is_set():
            executor.spin_once(timeout_sec=0.1)
    except ExternalShutdownException:
        pass
    out_file.write_text(json.dumps(robot.outcome()))
    executor.shutdown()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
