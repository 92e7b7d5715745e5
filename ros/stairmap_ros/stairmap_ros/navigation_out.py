"""Publishes what planners need: obstacles with each image, floors, portals and masks once a second."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import PoseArray
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import PointCloud2
from stairmap_msgs.msg import FloorArray, PortalArray

from stairmap.navigation.robot_profile import RobotProfile
from stairmap_ros.floor_answers import (
    EMPTY_MASK,
    FloorAnswer,
    answer_floors,
    find_current_level,
    passable_ids,
)
from stairmap_ros.live_map import LiveMap
from stairmap_ros.messages import make_header
from stairmap_ros.navigation_messages import (
    id_of,
    make_cloud,
    make_filter_info,
    make_floor_array,
    make_mask,
    make_portal_array,
    make_staging_poses,
)
from stairmap_ros.obstacle_points import obstacle_points

PERIOD = 1.0
"""Time between two looks at floors and masks, s."""

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class NavigationOut:
    """The topics for planners of one node.

    Parameters
    ----------
    node
        Whose topics these are.
    live_map
        What is told of.
    map_frame
        Coordinate frame of all results.
    robot
        Whose verdicts count; ``None``: no stairs are passable.
    """

    def __init__(self, node: Node, live_map: LiveMap, *, map_frame: str, robot: RobotProfile | None) -> None:
        self._node, self._live_map, self._map_frame, self._robot = node, live_map, map_frame, robot
        self._obstacles_out = node.create_publisher(PointCloud2, "~/obstacles", LATCHED)
        self._floors_out = node.create_publisher(FloorArray, "~/floors", LATCHED)
        self._portals_out = node.create_publisher(PortalArray, "~/portals", LATCHED)
        self._staging_out = node.create_publisher(PoseArray, "~/staging_poses", LATCHED)
        self._masks_out: dict[str, _MaskOut] = {}
        self._answer = FloorAnswer()
        self._told: tuple[Any, ...] = ()
        self._publish_mask("~", EMPTY_MASK, 0.0, stamp_ns=0)
        # Not the ROS clock: masks must come in a simulation that stands still, too.
        self._timer = node.create_timer(
            PERIOD, self.publish_floors, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        self.publish_floors()

    def close(self) -> None:
        """End the topics."""
        self._node.destroy_timer(self._timer)
        for publisher in (self._obstacles_out, self._floors_out, self._portals_out, self._staging_out):
            self._node.destroy_publisher(publisher)
        for mask in self._masks_out.values():
            mask.close()

    def publish_obstacles(self) -> None:
        """Publish the edges that are known and those that the newest image shows."""
        now = self._live_map.state()
        points = obstacle_points(
            now.answer, passable_ids(now.answer, self._robot), now.detection, now.map_from_camera
        )
        self._obstacles_out.publish(make_cloud(points, make_header(self._map_frame, now.stamp_ns)))

    def publish_floors(self) -> None:
        """Publish floors, portals and masks if anything of them has changed."""
        now = self._live_map.state()
        version = self._live_map.version
        if not self._told or self._told[0] != version:
            self._answer = answer_floors(now.answer, now.way, self._robot, self._answer)
        camera = None if now.map_from_camera is None else now.map_from_camera[:3, 3]
        level = find_current_level(self._answer, camera)
        self._answer = FloorAnswer(
            floors=self._answer.floors,
            portals=self._answer.portals,
            masks=self._answer.masks,
            current_level=level,
        )
        if self._told == (version, level):
            return
        self._told = (version, level)
        self._publish(now.stamp_ns)

    def _publish(self, stamp_ns: int) -> None:
        header = make_header(self._map_frame, stamp_ns)
        floors, portals = self._answer.floors, self._answer.portals
        topics: dict[int, tuple[str, str]] = {}
        current: int | None = None
        for floor in () if floors is None else floors.floors:
            # A name has no minus; ids of floors below the first are negative.
            name = f"~/floors/floor_{id_of(floor)}".replace("-", "m")
            mask = self._answer.masks[floor.level]
            topics[id_of(floor)] = self._publish_mask(name, mask, floor.height, stamp_ns)
            if floor.level == self._answer.current_level:
                current = id_of(floor)
                self._publish_mask("~", mask, floor.height, stamp_ns)
        self._floors_out.publish(make_floor_array(floors, current, topics, header))
        robot = "" if self._robot is None else self._robot.name
        self._portals_out.publish(make_portal_array(portals, floors, robot, header))
        self._staging_out.publish(make_staging_poses(portals, header))

    def _publish_mask(self, name: str, mask: Any, height: float, stamp_ns: int) -> tuple[str, str]:
        if name not in self._masks_out:
            self._masks_out[name] = _MaskOut(self._node, name)
        return self._masks_out[name].publish(make_mask(mask, height, make_header(self._map_frame, stamp_ns)))


class _MaskOut:
    """A keep-out mask, and the filter info that names it to Nav2."""

    def __init__(self, node: Node, name: str) -> None:
        self._node = node
        self._mask_out = node.create_publisher(OccupancyGridMessage, f"{name}/keepout_mask", LATCHED)
        self._info = make_filter_info(self._mask_out.topic_name, make_header("", 0))
        self._info_out = (
            None
            if self._info is None
            else node.create_publisher(type(self._info), f"{name}/keepout_filter_info", LATCHED)
        )
        self._last: OccupancyGridMessage | None = None

    def publish(self, mask: OccupancyGridMessage) -> tuple[str, str]:
        """Publish a mask that differs from the last; return the topics of mask and info."""
        last, self._last = self._last, mask
        if last is None and self._info_out is not None:
            self._info.header = mask.header
            self._info_out.publish(self._info)
        # Costmaps are made anew with each mask.
        if last is None or last.info.origin != mask.info.origin or last.data != mask.data:
            self._mask_out.publish(mask)
        return self._mask_out.topic_name, "" if self._info_out is None else self._info_out.topic_name

    def close(self) -> None:
        """End the topics."""
        self._node.destroy_publisher(self._mask_out)
        if self._info_out is not None:
            self._node.destroy_publisher(self._info_out)
