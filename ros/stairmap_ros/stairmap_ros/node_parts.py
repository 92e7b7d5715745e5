"""What a configured node is made of: inputs, the map, outputs, and the worker while it is active."""

from __future__ import annotations

import time
from contextlib import ExitStack, closing
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from stairmap.config import Config
from stairmap.errors import StairmapError
from stairmap.navigation.robot_profile import load_robot
from stairmap_ros.depth_in import DepthIn, find_depth_topics, stamp_of
from stairmap_ros.image_worker import ImageWorker
from stairmap_ros.live_map import LiveMap
from stairmap_ros.map_keeper import MapKeeper
from stairmap_ros.map_services import MapServices
from stairmap_ros.navigation_out import NavigationOut
from stairmap_ros.node_config import NodeConfig
from stairmap_ros.node_status import NodeStatus
from stairmap_ros.path_in import PathIn
from stairmap_ros.pending_frames import PendingFrame, PendingFrames
from stairmap_ros.points_in import POINTS_TOPIC, PointsIn
from stairmap_ros.results_out import ResultsOut
from stairmap_ros.stairway_map import StairwayMap
from stairmap_ros.status_out import StatusOut
from stairmap_ros.sweep_worker import SweepWorker
from stairmap_ros.time_jumps import TimeJumps
from stairmap_ros.transforms_in import TransformsIn


class NodeParts:
    """Everything between ``on_configure`` and ``on_cleanup``.

    Callbacks only take note of messages; the worker looks at images. So the node never falls behind, and
    messages are taken in while an image is looked at.

    Parameters
    ----------
    node
        Whose topics these are.
    own, config
        The node's own parameters, and those of the stages.

    Raises
    ------
    StairmapError
        If the map file cannot be used or a message package is missing.
    """

    def __init__(self, node: Node, own: NodeConfig, config: Config) -> None:
        self._node, self._own, self._config = node, own, config
        self._worker: ImageWorker | None = None
        self._sweep_worker: SweepWorker | None = None
        self._depth: DepthIn | None = None
        self._points: PointsIn | None = None
        with ExitStack() as made:
            self._make_outputs_and_map(made, config)
            self._make_inputs(made)
            node.get_logger().info(self._keeper.go_on())
            self._live_map.publish()
            # Nothing has failed: it stays until close().
            self._made = made.pop_all()

    def _make_outputs_and_map(self, made: ExitStack, config: Config) -> None:
        node, own = self._node, self._own
        self._results = made.enter_context(closing(ResultsOut(node, own.map_frame)))
        self._live_map = LiveMap(
            lambda: StairwayMap(config, method=own.method, views_per_place=own.views_per_place),
            self._results.publish,
        )
        self._keeper = made.enter_context(
            closing(MapKeeper(self._live_map, file=own.map_file, map_frame=own.map_frame))
        )
        robot = load_robot(own.robot) if own.robot else None
        navigation = NavigationOut(node, self._live_map, map_frame=own.map_frame, robot=robot)
        self._navigation = made.enter_context(closing(navigation))
        made.enter_context(closing(MapServices(node, self._live_map, self._keeper)))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        save_timer = node.create_timer(own.map_save_period, self.save, clock=steady)
        made.callback(node.destroy_timer, save_timer)

    def _make_inputs(self, made: ExitStack) -> None:
        node, own = self._node, self._own
        self._status = _make_status(node, own)
        self._pending: PendingFrames[Any] = PendingFrames(max_wait=own.max_transform_wait)
        self._jumps = TimeJumps()
        transforms = TransformsIn(
            node,
            max_gap=own.max_transform_gap,
            status=self._status,
            watch_clock=self._watch_clock,
            changed=self._pending.transforms_changed,
        )
        self._transforms = made.enter_context(closing(transforms))
        if own.inputs != "points":
            self._depth = made.enter_context(closing(DepthIn(node, own, self._status, self._take_image)))
        if own.inputs != "depth":
            self._points = made.enter_context(closing(PointsIn(node, own, self._status, self._watch_clock)))
        made.enter_context(closing(PathIn(node, self._live_map, own.map_frame)))
        reports = StatusOut(
            node,
            self._status,
            self._pending,
            is_active=self._is_active,
            count_stairways=lambda: self._results.num_stairways,
        )
        made.enter_context(closing(reports))

    def activate(self) -> None:
        """Begin to look at images."""
        self._pending.open()
        self._status.start(time.monotonic())
        self._worker = ImageWorker(
            self._own,
            pending=self._pending,
            transforms=self._transforms,
            live_map=self._live_map,
            status=self._status,
            camera_info=lambda: None if self._depth is None else self._depth.info,
            now_ns=self._now_ns,
            looked=self._navigation.publish_obstacles,
        )
        if self._points is not None:
            self._sweep_worker = SweepWorker(
                self._own,
                self._config,
                points=self._points,
                transforms=self._transforms,
                live_map=self._live_map,
                status=self._status,
                now_ns=self._now_ns,
                looked=self._navigation.publish_obstacles,
            )

    def deactivate(self) -> None:
        """Stop looking at images; the map and its topics stay."""
        if self._worker is not None:
            self._worker.close()
            self._worker = None
        if self._sweep_worker is not None:
            self._sweep_worker.close()
            self._sweep_worker = None
        self.save()

    def close(self) -> None:
        """Stop everything, write the map, and let others have its file."""
        self.deactivate()
        self._made.close()

    def save(self) -> None:
        """Write the map file if the map has changed."""
        try:
            self._keeper.save_changed()
        except StairmapError as error:
            self._status.set_problem("map file", str(error))
            self._node.get_logger().error(str(error), throttle_duration_sec=60.0)
        else:
            self._status.set_problem("map file", None)

    def _now_ns(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)

    def _is_active(self) -> bool:
        workers = [worker for worker in (self._worker, self._sweep_worker) if worker is not None]
        if not all(worker.is_alive for worker in workers):
            raise RuntimeError("the worker has ended with an error, told above")
        return self._worker is not None

    def _take_image(self, message: Any, arrived: float) -> None:
        stamp_ns = stamp_of(message)
        self._watch_clock("images", stamp_ns)
        if self._depth is not None and self._depth.info is not None and self._worker is not None:
            self._pending.put(PendingFrame(message=message, stamp_ns=stamp_ns, arrived=arrived))

    def _watch_clock(self, source: str, stamp_ns: int) -> None:
        back_ns = self._jumps.find(source, stamp_ns)
        if not back_ns:
            return
        self._status.num_jumps += 1
        self._transforms.clear()
        self._pending.clear()
        if self._points is not None:
            self._points.clear()
        self._live_map.forget_way()
        self._node.get_logger().warning(
            f"{source}: time went back by {back_ns * 1e-9:.1f} s; transforms are forgotten, the map is kept"
        )


def _make_status(node: Node, own: NodeConfig) -> NodeStatus:
    """A status that misses what the node is to look at."""
    topics, wanted = {}, "point cloud"
    if own.inputs != "points":
        found = find_depth_topics(node, own.depth_transport)
        topics = {found.depth: "depth image", found.camera_info: "camera_info"}
        wanted = "depth image with its camera_info"
    if own.inputs != "depth":
        topics[node.resolve_topic_name(POINTS_TOPIC)] = "point cloud"
        wanted = wanted if own.inputs == "points" else f"{wanted}, nor any point cloud,"
    return NodeStatus(topics, max_silence=own.max_silence, now=time.monotonic(), wanted=wanted)
