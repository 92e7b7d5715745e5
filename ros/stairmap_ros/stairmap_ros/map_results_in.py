"""What the map's node publishes, as the explorer takes it: stairways, and where the robot must not go."""

from __future__ import annotations

from functools import partial
from typing import Any

from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from stairmap_msgs.msg import FloorArray, StairwayArray

from stairmap.exploration.levels import SAME_LEVEL
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.stairway import Stairway
from stairmap_ros.stairway_messages_in import mask_from_message, stairways_from_message
from stairmap_ros.transforms_in import ns_from_time

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class MapResultsIn:
    """Hears stairways, floors and the keep-out mask of each floor.

    Parameters
    ----------
    node
        Who subscribes.
    map_node
        Name of the map's node.

    Attributes
    ----------
    topic
        Where stairways come from.
    stairways
        The newest.
    looked_ns
        Stamp of the newest image that the map's node looked at, nanoseconds; ``None`` before it said
        anything.
    num_changes
        Grows when the stairways change.
    """

    def __init__(self, node: Node, map_node: str) -> None:
        self._node = node
        self.topic = node.resolve_topic_name(f"{map_node}/stairways")
        self.stairways: tuple[Stairway, ...] = ()
        self.looked_ns: int | None = None
        self.num_changes = 0
        self._told: Any = None
        self._heights: dict[str, float] = {}
        self._masks: dict[str, OccupancyGrid] = {}
        node.create_subscription(StairwayArray, self.topic, self._take_stairways, LATCHED)
        node.create_subscription(FloorArray, f"{map_node}/floors", self._take_floors, LATCHED)

    def mask(self, height: float) -> OccupancyGrid | None:
        """Return the keep-out mask of the floor at a height, m; ``None`` if there is none."""
        # Callbacks of another thread replace the dictionaries, they do not change them.
        heights, masks = self._heights, self._masks
        near = [topic for topic in masks if abs(heights.get(topic, 1e9) - height) < SAME_LEVEL]
        return masks[min(near, key=lambda topic: abs(heights[topic] - height))] if near else None

    def _take_stairways(self, message: StairwayArray) -> None:
        if self._told != message.stairways:
            self._told = message.stairways
            self.stairways = stairways_from_message(message)
            self.num_changes += 1
        self.looked_ns = ns_from_time(message.header.stamp)

    def _take_floors(self, message: FloorArray) -> None:
        named = {floor.keepout_mask_topic: floor.height for floor in message.floors}
        named.pop("", None)
        for topic in named.keys() - self._heights.keys():
            take = partial(self._take_mask, topic)
            self._node.create_subscription(OccupancyGridMessage, topic, take, LATCHED)
        # A floor that was given up keeps its subscription, but no height.
        self._heights = {**dict.fromkeys(self._heights, float("inf")), **named}

    def _take_mask(self, topic: str, message: OccupancyGridMessage) -> None:
        self._masks = {**self._masks, topic: mask_from_message(message)}
