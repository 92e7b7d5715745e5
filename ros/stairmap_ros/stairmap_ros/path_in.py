"""``corrected_path``: where SLAM says now that the robot has been."""

from __future__ import annotations

from nav_msgs.msg import Path
from rclpy.node import Node

from stairmap.errors import StairmapError
from stairmap_ros.live_map import LiveMap
from stairmap_ros.path_corrections import trajectory_from_path


class PathIn:
    """Moves the map by each corrected path.

    Parameters
    ----------
    node
        Who subscribes.
    live_map
        What is moved.
    map_frame
        Coordinate frame that the path must be in.
    """

    def __init__(self, node: Node, live_map: LiveMap, map_frame: str) -> None:
        self._node, self._live_map, self._map_frame = node, live_map, map_frame
        self._subscription = node.create_subscription(Path, "corrected_path", self._take, 1)

    def close(self) -> None:
        """End the subscription."""
        self._node.destroy_subscription(self._subscription)

    def _take(self, message: Path) -> None:
        if message.header.frame_id != self._map_frame:
            self._node.get_logger().warning(
                f"corrected_path is in '{message.header.frame_id}', not in map_frame "
                f"'{self._map_frame}', and not used",
                throttle_duration_sec=60.0,
            )
            return
        try:
            self._live_map.correct(trajectory_from_path(message))
        except StairmapError as error:
            self._node.get_logger().warning(f"corrected_path: {error}", throttle_duration_sec=60.0)
