"""Sweeps of a LiDAR: the subscription, and the sweeps that wait for their transforms, oldest first."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2

from stairmap_ros.node_config import NodeConfig
from stairmap_ros.node_status import NodeStatus
from stairmap_ros.transforms_in import ns_from_time

POINTS_TOPIC = "points"

MAX_WAITING = 20
"""Sweeps that may wait: 2 s at 10 Hz, 20 MB of a Mid-360. A worker that is slower loses the oldest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WaitingSweep:
    """A ``PointCloud2``, and its arrival on the monotonic clock, s."""

    message: Any
    arrived: float


class PointsIn:
    """Takes sweeps and keeps them until they are looked at. Safe to use from several threads.

    Parameters
    ----------
    node
        Who subscribes.
    own
        Reliability.
    status
        Where what came is noted.
    watch_clock
        Called with a name and each stamp, nanoseconds.

    Attributes
    ----------
    topic
        Full name, remaps applied.
    num_lost
        Sweeps that were given up because newer ones came.
    """

    def __init__(
        self, node: Node, own: NodeConfig, status: NodeStatus, watch_clock: Callable[[str, int], None]
    ) -> None:
        self._node, self._status, self._watch_clock = node, status, watch_clock
        self.topic = node.resolve_topic_name(POINTS_TOPIC)
        self.num_lost = 0
        self._waiting: deque[WaitingSweep] = deque()
        self._changed = Condition()
        self._is_open = False
        qos = QoSProfile(depth=5, reliability=ReliabilityPolicy[own.reliability.upper()])
        self._subscription = node.create_subscription(PointCloud2, self.topic, self._take, qos)

    def open(self) -> None:
        """Begin to keep sweeps; those of before are forgotten."""
        with self._changed:
            self._is_open = True
            self._waiting.clear()

    def shut(self) -> None:
        """Keep none any more, and wake who waits."""
        with self._changed:
            self._is_open = False
            self._changed.notify_all()

    def close(self) -> None:
        """End the subscription."""
        self.shut()
        self._node.destroy_subscription(self._subscription)

    def clear(self) -> None:
        """Forget all sweeps that wait."""
        with self._changed:
            self._waiting.clear()

    def next(self, timeout: float) -> WaitingSweep | None:
        """Return the oldest sweep, after so long, s, at most; ``None`` if there is none."""
        with self._changed:
            if not self._waiting and self._is_open:
                self._changed.wait(timeout)
            return self._waiting.popleft() if self._waiting else None

    @property
    def is_open(self) -> bool:
        """Whether sweeps are kept."""
        return self._is_open

    def _take(self, message: PointCloud2) -> None:
        now = time.monotonic()
        self._status.message_came(self.topic, now)
        self._status.pair_came(now)
        self._watch_clock("points", ns_from_time(message.header.stamp))
        with self._changed:
            if not self._is_open:
                return
            self._waiting.append(WaitingSweep(message=message, arrived=now))
            if len(self._waiting) > MAX_WAITING:
                self._waiting.popleft()
                self.num_lost += 1
            self._changed.notify_all()
