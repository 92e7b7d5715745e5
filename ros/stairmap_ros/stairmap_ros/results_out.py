"""Publishes stairways: latched, so that who comes late gets the last answer at once."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from stairmap_msgs.msg import DropArray, StairwayArray
from visualization_msgs.msg import MarkerArray

from stairmap_ros.markers import make_marker_array
from stairmap_ros.messages import make_detection_array, make_header, make_stairway_array
from stairmap_ros.navigation_messages import make_drop_array
from stairmap_ros.stairway_map import MapAnswer


class ResultsOut:
    """The publishers of one node.

    Parameters
    ----------
    node
        Whose topics these are: ``~/stairways``, ``~/drops``, ``~/markers`` and, with vision_msgs,
        ``~/detections``.
    map_frame
        Coordinate frame of all results.
    """

    def __init__(self, node: Node, map_frame: str) -> None:
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._node = node
        self._map_frame = map_frame
        self._stairways_out = node.create_publisher(StairwayArray, "~/stairways", latched)
        self._drops_out = node.create_publisher(DropArray, "~/drops", latched)
        self._markers_out = node.create_publisher(MarkerArray, "~/markers", latched)
        empty = make_detection_array((), make_header(map_frame, 0))
        self._detections_out = (
            None if empty is None else node.create_publisher(type(empty), "~/detections", latched)
        )
        self._publishers = [self._stairways_out, self._markers_out, self._drops_out, self._detections_out]
        self.num_stairways = 0

    def close(self) -> None:
        """End the publishers."""
        for publisher in self._publishers:
            if publisher is not None:
                self._node.destroy_publisher(publisher)

    def publish(self, answer: MapAnswer, stamp_ns: int) -> None:
        """Publish stairways and drops as of the stamp of an image, nanoseconds."""
        header, stairways = make_header(self._map_frame, stamp_ns), answer.stairways
        self.num_stairways = len(stairways)
        self._markers_out.publish(make_marker_array(stairways, answer.drops, header))
        self._drops_out.publish(make_drop_array(answer.drops, header))
        self._stairways_out.publish(make_stairway_array(stairways, header))
        if self._detections_out is not None:
            self._detections_out.publish(make_detection_array(stairways, header))
