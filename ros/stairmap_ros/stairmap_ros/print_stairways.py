"""``ros2 run stairmap_ros print_stairways``: prints what the node knows when it changes."""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.utilities import remove_ros_args
from stairmap_msgs.msg import Stairway, StairwayArray


def main() -> int:
    """Print until Ctrl-C, or until the first answer with --once."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--once", action="store_true", help="end after the first stairway")
    arguments = parser.parse_args(remove_ros_args(sys.argv)[1:])
    rclpy.init()
    node = Node("print_stairways")
    latest: dict[str, StairwayArray] = {}
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(
        StairwayArray, "stairmap/stairways", lambda message: latest.update(array=message), latched
    )
    printed = None
    try:
        while True:
            end = time.monotonic() + 1.0
            while time.monotonic() < end:
                rclpy.spin_once(node, timeout_sec=0.1)
            text = describe(latest["array"]) if "array" in latest else None
            if text is not None and text != printed:
                print(text, flush=True)  # noqa: T201
                printed = text
            if arguments.once and "array" in latest and latest["array"].stairways:
                return 0
    except (KeyboardInterrupt, ExternalShutdownException):
        return 130
    finally:
        rclpy.try_shutdown()


def describe(array: StairwayArray) -> str:
    """Return one line per flight, in mm and degrees."""
    lines = [describe_flights(stairway, array.header.frame_id) for stairway in array.stairways]
    return "\n".join(lines) or "no stairway so far"


def describe_flights(stairway: Stairway, map_frame: str) -> str:
    """Return the flights of a stairway, a line each."""
    lines = []
    for number, flight in enumerate(stairway.flights, start=1):
        rise_std, run_std, width_std = np.sqrt(np.reshape(flight.covariance, (4, 4)).diagonal()[:3]) * 1e3
        base = flight.pose.pose.position
        lines.append(
            f"stairway {stairway.id}/{number}: {flight.num_risers} risers, "
            f"rise {flight.rise * 1e3:.0f} ± {rise_std:.0f}, run {flight.run * 1e3:.0f} ± {run_std:.0f}, "
            f"width {flight.width * 1e3:.0f} ± {width_std:.0f} mm, {np.degrees(flight.pitch):.1f} deg, "
            f"at {base.x:.2f}, {base.y:.2f}, {base.z:.2f} m in {map_frame}, "
            f"{stairway.num_observations} images"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
