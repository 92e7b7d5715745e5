"""Depth images and their camera_info: subscriptions that hear whatever a driver publishes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from stairmap.recordings.camera_info import find_camera_info_oddities
from stairmap_ros.node_config import InputConfig
from stairmap_ros.node_status import NodeStatus
from stairmap_ros.transforms_in import ns_from_time

DEPTH_TOPIC = "depth/image_rect_raw"
CAMERA_INFO_TOPIC = "depth/camera_info"
COMPRESSED = "compressedDepth"

LATCHED_PERIOD = 0.5
"""How often a latched camera_info is looked for until one has come, s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthTopics:
    """Full names of the topics, remaps applied."""

    depth: str
    camera_info: str


def find_depth_topics(node: Node, depth_transport: str) -> DepthTopics:
    """Return where depth comes from: a remap of the image's topic moves its compressed copy along."""
    depth = node.resolve_topic_name(DEPTH_TOPIC)
    if depth_transport == COMPRESSED:
        depth = node.resolve_topic_name(f"{depth}/{COMPRESSED}")
    return DepthTopics(depth=depth, camera_info=node.resolve_topic_name(CAMERA_INFO_TOPIC))


class DepthIn:
    """Takes depth images whose camera_info is known.

    Parameters
    ----------
    node
        Who subscribes.
    own
        Reliability and transport.
    status
        Where what came is noted.
    take
        Called with each image message and its arrival on the monotonic clock, s.
    """

    def __init__(
        self, node: Node, own: InputConfig, status: NodeStatus, take: Callable[[Any, float], None]
    ) -> None:
        self._node, self._status, self._take = node, status, take
        self._topics = find_depth_topics(node, own.depth_transport)
        self._info: CameraInfo | None = None
        kind = CompressedImage if own.depth_transport == COMPRESSED else Image
        qos = QoSProfile(depth=5, reliability=ReliabilityPolicy[own.reliability.upper()])
        self._subscriptions = [
            node.create_subscription(kind, self._topics.depth, self._take_image, qos),
            node.create_subscription(CameraInfo, self._topics.camera_info, self._take_info, qos),
        ]
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(LATCHED_PERIOD, self._ask_for_latched_info, clock=steady)

    @property
    def info(self) -> CameraInfo | None:
        """The newest camera_info."""
        return self._info

    def close(self) -> None:
        """End the subscriptions."""
        self._node.destroy_timer(self._timer)
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    def _take_image(self, message: Any) -> None:
        now = time.monotonic()
        self._status.message_came(self._topics.depth, now)
        if self._info is not None:
            self._status.pair_came(now)
        self._take(message, now)

    def _ask_for_latched_info(self) -> None:
        """Subscribe to a camera_info that was published once and is kept for who asks for what is latched.

        Only where there is such a publisher: every other one would warn of a subscription that does not fit.
        """
        if self._info is not None:
            self._timer.cancel()
            return
        publishers = self._node.get_publishers_info_by_topic(self._topics.camera_info)
        if any(
            publisher.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for publisher in publishers
        ):
            self._timer.cancel()
            latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            self._subscriptions.append(
                self._node.create_subscription(CameraInfo, self._topics.camera_info, self._take_info, latched)
            )

    def _take_info(self, message: CameraInfo) -> None:
        self._status.message_came(self._topics.camera_info, time.monotonic())
        if self._info is None or list(message.d) != list(self._info.d):
            for oddity in find_camera_info_oddities(message):
                self._status.note("camera_info", f"{self._topics.camera_info}: {oddity}")
                self._node.get_logger().warning(f"{self._topics.camera_info}: {oddity}")
        self._info = message


def stamp_of(message: Any) -> int:
    """Return the stamp of a message with a header, nanoseconds."""
    return ns_from_time(message.header.stamp)
