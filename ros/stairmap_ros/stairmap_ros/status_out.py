"""Says once a second how the node fares: on ``/diagnostics``, and in the log whenever it changes."""

from __future__ import annotations

import time
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from stairmap_ros.diagnostics import make_diagnostics
from stairmap_ros.node_status import CLOCK, Level, NodeStatus, Status
from stairmap_ros.pending_frames import PendingFrames

PERIOD = 1.0
"""Time between two reports, s."""

MAX_CLOCK_WAIT = 3.0
"""How long /clock may take to come, s."""

NO_CLOCK = (
    "use_sim_time is true, but nothing comes on /clock: start the simulation, play the bag with --clock, "
    "or set use_sim_time to false"
)

INACTIVE = "inactive: a lifecycle manager must activate it"


class StatusOut:
    """Reports of one node.

    Parameters
    ----------
    node
        Who reports.
    status, pending
        What there is to be said.
    is_active
        Whether the node looks at images.
    count_stairways
        Gives how many are confirmed.
    """

    def __init__(
        self,
        node: Node,
        status: NodeStatus,
        pending: PendingFrames[object],
        *,
        is_active: Callable[[], bool],
        count_stairways: Callable[[], int],
    ) -> None:
        self._node, self._status, self._pending = node, status, pending
        self._is_active, self._count_stairways = is_active, count_stairways
        self._started = time.monotonic()
        self._last_kind = ""
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        # Not the ROS clock: with use_sim_time and no /clock the node would never say why nothing comes.
        self._timer = node.create_timer(PERIOD, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        """End the reports."""
        self._node.destroy_timer(self._timer)
        self._node.destroy_publisher(self._publisher)

    def _report(self) -> None:
        now = time.monotonic()
        self._watch_clock(now)
        status = self._find_status(now)
        values = self._status.values(self._pending.num_superseded, self._pending.num_unplaced)
        name = self._node.get_fully_qualified_name().lstrip("/")
        stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(make_diagnostics(name, status, values, stamp))
        if status.kind != self._last_kind:
            # rclpy wants one severity for each place in the code.
            if status.level is Level.OK:
                self._node.get_logger().info(status.message)
            else:
                self._node.get_logger().warning(status.message)
            self._last_kind = status.kind

    def _find_status(self, now: float) -> Status:
        if not self._is_active():
            return Status(level=Level.OK, kind="inactive", message=INACTIVE)
        problem = self._pending.last_problem
        return self._status.status(self._count_stairways(), None if problem is None else str(problem), now)

    def _watch_clock(self, now: float) -> None:
        uses_sim_time = bool(self._node.get_parameter("use_sim_time").value)
        stands_still = uses_sim_time and self._node.get_clock().now().nanoseconds == 0
        is_late = now - self._started > MAX_CLOCK_WAIT
        self._status.set_problem(CLOCK, NO_CLOCK if stands_still and is_late else None)
