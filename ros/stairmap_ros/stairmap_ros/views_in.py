"""Depth images with the robot's pose, as the map of an exploring robot takes them."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node

from stairmap.arrays import Transform
from stairmap.errors import StairmapError
from stairmap.exploration.exploration_map import map_from_body
from stairmap.exploration.odometry import Planar
from stairmap.exploration.simulated_robot import View
from stairmap.frame import DepthFrame
from stairmap.recordings.camera_info import camera_from_info
from stairmap.recordings.depth_message import depth_from_message
from stairmap.transforms import invert_transform
from stairmap_ros.depth_in import DepthIn, find_depth_topics, stamp_of
from stairmap_ros.depth_unit import check_depth_unit
from stairmap_ros.node_config import ExplorerConfig
from stairmap_ros.node_status import NodeStatus
from stairmap_ros.pending_frames import PendingFrame, PendingFrames
from stairmap_ros.status_out import StatusOut
from stairmap_ros.time_jumps import TimeJumps
from stairmap_ros.transforms_in import TransformsIn


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPlace:
    """How a camera sits on a robot: m above the ground, and rad that it looks down."""

    height: float
    pitch: float


class ViewsIn:
    """Hears depth images, camera_info and TF.

    Parameters
    ----------
    node
        Who subscribes.
    own
        Coordinate frames, and how images come.

    Attributes
    ----------
    status
        How the inputs fare; it is told on /diagnostics and in the log.
    num_jumps
        How often time went back.

    Raises
    ------
    StairmapError
        If tf2_msgs is not installed.
    """

    def __init__(self, node: Node, own: ExplorerConfig) -> None:
        self._node, self._own = node, own
        topics = find_depth_topics(node, own.depth_transport)
        named = {topics.depth: "depth image", topics.camera_info: "camera_info"}
        self.status = NodeStatus(named, max_silence=own.max_silence, now=time.monotonic())
        self._pending: PendingFrames[Any] = PendingFrames(max_wait=own.max_transform_wait)
        self._jumps = TimeJumps()
        self._last_ns = -1
        self.num_stairways = 0
        self._transforms = TransformsIn(
            node,
            max_gap=own.max_transform_gap,
            status=self.status,
            watch_clock=self._watch_clock,
            changed=self._pending.transforms_changed,
        )
        self._depth = DepthIn(node, own, self.status, self._take_image)
        self._reports = StatusOut(
            node,
            self.status,
            self._pending,
            is_active=lambda: True,
            count_stairways=lambda: self.num_stairways,
        )

    def newest(self) -> View | None:
        """Return the newest image that can be placed, if it is newer than the last one returned."""
        newest = None
        while (placed := self._pending.take(self._find_pose, time.monotonic())) is not None:
            if placed.frame.stamp_ns > self._last_ns:
                newest, self._last_ns = placed, placed.frame.stamp_ns
        if newest is None:
            return None
        try:
            return self._make_view(newest.frame.message, newest.frame.stamp_ns, newest.map_from_camera)
        except StairmapError as error:
            self.status.refuse(str(error), time.monotonic())
            return None

    def _make_view(self, message: Any, stamp_ns: int, map_from_camera: Transform) -> View:
        own = self._own
        depth = depth_from_message(message, values_per_metre=1.0 / own.depth_unit)
        check_depth_unit(depth, message)
        camera = camera_from_info(self._depth.info, (depth.shape[1], depth.shape[0]))
        pose = planar_from(
            self._transforms.lookup(own.map_frame, own.robot_frame, stamp_ns), own.robot_height
        )
        return View(
            frame=DepthFrame(stamp_ns=stamp_ns, depth=depth, camera=camera),
            odometry=pose,
            body_from_camera=invert_transform(map_from_body(pose)) @ map_from_camera,
        )

    def _find_pose(self, frame: PendingFrame[Any]) -> Transform:
        """Return the camera's pose; the robot's must be known as well."""
        camera_frame = self._own.camera_frame or frame.message.header.frame_id
        self._transforms.lookup(self._own.map_frame, self._own.robot_frame, frame.stamp_ns)
        return self._transforms.lookup(self._own.map_frame, camera_frame, frame.stamp_ns)

    def _take_image(self, message: Any, arrived: float) -> None:
        stamp_ns = stamp_of(message)
        self._watch_clock("images", stamp_ns)
        if self._depth.info is not None:
            self._pending.put(PendingFrame(message=message, stamp_ns=stamp_ns, arrived=arrived))

    def _watch_clock(self, source: str, stamp_ns: int) -> None:
        if self._jumps.find(source, stamp_ns):
            self.status.num_jumps += 1
            self._transforms.clear()
            self._pending.clear()
            self._last_ns = -1


def planar_from(map_from_robot: Transform, height: float) -> Planar:
    """Return where a robot stands whose coordinate frame is so high above the ground, m."""
    x, y, z = (float(value) for value in map_from_robot[:3, 3])
    return Planar(x=x, y=y, z=z - height, heading=math.atan2(map_from_robot[1, 0], map_from_robot[0, 0]))


def camera_place(view: View) -> CameraPlace:
    """Return how the camera of a view sits on its robot."""
    forward = view.body_from_camera[:3, 2]
    return CameraPlace(
        height=float(view.body_from_camera[2, 3]),
        pitch=math.atan2(-float(forward[2]), math.hypot(float(forward[0]), float(forward[1]))),
    )
