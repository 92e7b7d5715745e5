"""What a planner hears of the node: masks as Nav2's costmap filters take them, obstacles, floors, portals."""

from __future__ import annotations

from typing import Any

import numpy as np
from geometry_msgs.msg import PoseArray
from nav2_msgs.msg import CostmapFilterInfo
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from robot_messages import vector
from sensor_msgs.msg import PointCloud2
from stairmap_msgs.msg import DropArray, FloorArray, PortalArray

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class PlannerEar:
    """Subscribes as Nav2 does: to the filter info first, then to the mask that it names."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._masks: dict[str, Any] = {}
        self._mask_subscriptions: dict[str, Any] = {}
        self._heard: dict[str, Any] = {}
        self._first_obstacles: list[list[float]] = []
        prefix = "stairmap"
        node.create_subscription(
            CostmapFilterInfo,
            f"{prefix}/keepout_filter_info",
            lambda info: self._follow("current", info),
            LATCHED,
        )
        # Obstacle layers ask with the quality of service of sensors.
        node.create_subscription(
            PointCloud2, f"{prefix}/obstacles", self._take_obstacles, qos_profile_sensor_data
        )
        node.create_subscription(FloorArray, f"{prefix}/floors", self._take_floors, LATCHED)
        node.create_subscription(PortalArray, f"{prefix}/portals", self._take_portals, LATCHED)
        node.create_subscription(DropArray, f"{prefix}/drops", self._take_drops, LATCHED)
        node.create_subscription(PoseArray, f"{prefix}/staging_poses", self._take_staging, LATCHED)

    def heard(self) -> dict[str, Any]:
        """Return what was heard last, as JSON types."""
        return {**self._heard, "masks": self._masks, "first_obstacles": self._first_obstacles}

    def _follow(self, name: str, info: CostmapFilterInfo) -> None:
        if name in self._mask_subscriptions:
            return
        assert (info.type, info.base, info.multiplier) == (0, 0.0, 1.0), info
        self._mask_subscriptions[name] = self._node.create_subscription(
            OccupancyGrid, info.filter_mask_topic, lambda mask: self._take_mask(name, mask), LATCHED
        )

    def _take_mask(self, name: str, mask: OccupancyGrid) -> None:
        cells = np.array(mask.data, dtype=np.int8).reshape(mask.info.height, mask.info.width)
        rows, columns = np.nonzero(cells == 100)
        origin, size = mask.info.origin.position, mask.info.resolution
        places = np.stack([origin.x + (columns + 0.5) * size, origin.y + (rows + 0.5) * size], axis=1)
        self._masks[name] = {
            "frame_id": mask.header.frame_id,
            "height": origin.z,
            "values": np.unique(cells).tolist(),
            "forbidden": np.round(places, 3).tolist(),
        }

    def _take_obstacles(self, cloud: PointCloud2) -> None:
        values = np.frombuffer(cloud.data, dtype=np.float32).reshape(-1, 3)
        self._heard["obstacles"] = np.round(values.astype(float), 3).tolist()
        if len(values) and not self._first_obstacles:
            self._first_obstacles = self._heard["obstacles"]

    def _take_floors(self, message: FloorArray) -> None:
        self._heard["floors"] = [
            {
                "id": floor.id,
                "height": floor.height,
                "is_open": floor.is_open,
                "mask": floor.keepout_mask_topic,
            }
            for floor in message.floors
        ]
        self._heard["current_floor"] = message.current_floor if message.has_current_floor else None
        for floor in message.floors:
            name = f"floor {floor.id}"
            if name not in self._mask_subscriptions:
                self._mask_subscriptions[name] = self._node.create_subscription(
                    OccupancyGrid,
                    floor.keepout_mask_topic,
                    lambda mask, n=name: self._take_mask(n, mask),
                    LATCHED,
                )

    def _take_portals(self, message: PortalArray) -> None:
        self._heard["robot"] = message.robot
        self._heard["portals"] = [
            {
                "stairway": portal.stairway,
                "floors": [portal.lower_floor, portal.upper_floor],
                "lower": vector(portal.lower.position),
                "verdict": portal.verdict,
                "limiting": portal.limiting,
                "open": [portal.is_lower_open, portal.is_upper_open],
                "costs": [portal.cost_up, portal.cost_down],
            }
            for portal in message.portals
        ]

    def _take_drops(self, message: DropArray) -> None:
        self._heard["drops"] = [
            {
                "left": vector(drop.left),
                "right": vector(drop.right),
                "depth": drop.depth,
                "stairway": drop.stairway,
            }
            for drop in message.drops
        ]

    def _take_staging(self, message: PoseArray) -> None:
        self._heard["staging"] = [vector(pose.position) for pose in message.poses]
