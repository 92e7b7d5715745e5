"""The node's status as ``diagnostic_msgs/DiagnosticArray``."""

from __future__ import annotations

from collections.abc import Mapping

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from stairmap_ros.node_status import Status


def make_diagnostics(
    node_name: str, status: Status, values: Mapping[str, str], stamp: Time
) -> DiagnosticArray:
    """Return the status of one node, of which there may be several, with the numbers behind it."""
    array = DiagnosticArray()
    array.header.stamp = stamp
    array.status = [
        DiagnosticStatus(
            level=bytes([status.level]),
            name=f"{node_name}: stairways",
            message=status.message,
            hardware_id="stairmap",
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )
    ]
    return array
