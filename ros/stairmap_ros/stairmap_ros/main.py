"""``ros2 run stairmap_ros stairmap_node``: spins the node until it is told to stop."""

from __future__ import annotations

import signal
import sys
from threading import Event

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from stairmap.errors import StairmapError
from stairmap_ros.node import StairmapNode


def main() -> int:
    """Run the node; return 1 with one line on stderr if it cannot start."""
    # rclpy's own handlers would take the publishers away while the worker still uses them.
    stopped = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    try:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # such as a file of parameters that is not there
        print(f"stairmap: {error}", file=sys.stderr)  # noqa: T201
        return 1
    try:
        node = StairmapNode()
        node.autostart()
    except StairmapError as error:
        print(f"stairmap: {error}", file=sys.stderr)  # noqa: T201
        rclpy.shutdown()
        return 1
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not stopped.is_set():
            executor.spin_once(timeout_sec=0.2)
    finally:
        # Also when the node ends with an error: what it has seen is written.
        node.close()
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
