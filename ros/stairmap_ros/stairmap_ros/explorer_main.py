"""``ros2 run stairmap_ros explorer``: explores, and ends when nothing is left or when it is told to stop."""

from __future__ import annotations

import signal
import sys
from contextlib import suppress
from threading import Event, Thread

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from stairmap.errors import StairmapError


def main() -> int:
    """Run the node; return 1 with one line on stderr if it cannot start."""
    # rclpy's own handlers would take the clients away before goals are cancelled.
    stopped = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    try:
        from stairmap_ros.explorer import ExplorerNode  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name != "nav2_msgs":
            raise
        message = "nav2_msgs is not installed; run: sudo apt install ros-$ROS_DISTRO-nav2-msgs"
        print(f"explorer: {message}", file=sys.stderr)  # noqa: T201
        return 1
    try:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # such as a file of parameters that is not there
        print(f"explorer: {error}", file=sys.stderr)  # noqa: T201
        return 1
    try:
        node = ExplorerNode()
    except StairmapError as error:
        print(f"explorer: {error}", file=sys.stderr)  # noqa: T201
        rclpy.shutdown()
        return 1
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinning = Thread(target=_spin, args=(executor,), name="explorer's callbacks", daemon=True)
    spinning.start()
    try:
        node.explore(should_stop=stopped.is_set)
    finally:
        executor.shutdown()
        spinning.join(timeout=5.0)
        node.destroy_node()
        rclpy.shutdown()
    return 0


def _spin(executor: SingleThreadedExecutor) -> None:
    with suppress(ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    sys.exit(main())
