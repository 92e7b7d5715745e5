"""The node: converts what comes in, calls the pipeline in a worker thread, publishes what comes out.

Callbacks only take note of messages; the worker looks at the newest image that can be placed. So the node
never falls behind, and messages are taken in while an image is looked at.
"""

from __future__ import annotations

import time
from pathlib import Path
from threading import Lock, Thread
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Path as PathMessage
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from stairmap.arrays import Transform
from stairmap.errors import StairmapError, TransformLookupError
from stairmap.recordings.camera_info import camera_from_info
from stairmap.recordings.depth_message import depth_from_message
from stairmap.recordings.transform_buffer import TransformBuffer
from stairmap_ros.diagnostics import make_diagnostics
from stairmap_ros.map_file import check_map_file, load_map, save_map
from stairmap_ros.node_status import Level, NodeStatus
from stairmap_ros.parameters import declare_parameters
from stairmap_ros.path_corrections import PathCorrections, trajectory_from_path
from stairmap_ros.pending_frames import PendingFrame, PendingFrames, PlacedFrame
from stairmap_ros.results_out import ResultsOut
from stairmap_ros.stairway_map import StairwayMap
from stairmap_ros.time_jumps import TimeJumps
from stairmap_ros.transforms_in import MAX_AGE_NS, add_transform, ns_from_time, subscribe_transforms

DEPTH_TOPIC = "depth/image_rect_raw"
CAMERA_INFO_TOPIC = "depth/camera_info"


class StairmapNode(Node):
    """Depth images, camera_info and TF in; stairways, markers, detections and diagnostics out.

    Raises
    ------
    StairmapError
        If a parameter is not allowed, the map file cannot be used or a message package is missing.
    """

    def __init__(self) -> None:
        super().__init__("stairmap")
        self._own, config = declare_parameters(self)
        self._map = StairwayMap(config, method=self._own.method, views_per_place=self._own.views_per_place)
        self._map_lock = Lock()
        self._map_file = check_map_file(self._own.map_file)
        if self._map_file is not None:
            self._map.snapshot()  # of a method that cannot be kept: better now than after an hour
        self._saved_version = 0
        if self._map_file is not None:
            self._go_on_from_file(self._map_file)
        self._buffer = TransformBuffer(max_age_ns=MAX_AGE_NS)
        self._pending: PendingFrames[Any] = PendingFrames(max_wait=self._own.max_transform_wait)
        self._jumps = TimeJumps()
        self._info: CameraInfo | None = None
        self._corrections = PathCorrections(first=len(self._map.viewpoints))
        self._last_kind = ""
        self._last_stamp_ns = 0
        self._results = ResultsOut(self, self._own.map_frame)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._subscribe()
        self._worker = Thread(target=self._work, name="stairmap worker", daemon=True)
        self._worker.start()
        # Not the ROS clock: with use_sim_time and no /clock the node would never say why nothing comes.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._report, clock=steady)
        self.create_timer(self._own.map_save_period, self.save, clock=steady)
        with self._map_lock:
            self._results.publish(self._map.stairways(), stamp_ns=0)

    def close(self) -> None:
        """Stop the worker and write the map."""
        self._pending.close()
        self._worker.join(timeout=5.0)
        self.save()

    def save(self) -> None:
        """Write the map file if the map has changed."""
        if self._map_file is None or self._map.version == self._saved_version:
            return
        try:
            with self._map_lock:
                version = self._map.version
                snapshot = self._map.snapshot()
            save_map(self._map_file, snapshot, map_frame=self._own.map_frame)
            self._saved_version = version
            self._status.set_problem(None)
        except StairmapError as error:
            self._status.set_problem(str(error))
            self.get_logger().error(str(error), throttle_duration_sec=60.0)

    def _go_on_from_file(self, file: Path) -> None:
        num_images = load_map(file, self._map, map_frame=self._own.map_frame)
        self._saved_version = self._map.version
        if num_images:
            num_stairways = len(self._map.stairways())
            self.get_logger().info(f"goes on from {file}: {num_images} images, {num_stairways} stairways")
        else:
            self.get_logger().info(f"new map, to be kept in {file}")

    def _subscribe(self) -> None:
        reliability = ReliabilityPolicy[self._own.reliability.upper()]
        qos = QoSProfile(depth=5, reliability=reliability)
        is_raw = self._own.depth_transport == "raw"
        topic = DEPTH_TOPIC if is_raw else f"{DEPTH_TOPIC}/compressedDepth"
        depth = self.create_subscription(Image if is_raw else CompressedImage, topic, self._take_image, qos)
        info = self.create_subscription(CameraInfo, CAMERA_INFO_TOPIC, self._take_info, qos)
        self._depth_topic, self._info_topic = depth.topic_name, info.topic_name
        self._status = NodeStatus(
            {self._depth_topic: "depth image", self._info_topic: "camera_info"},
            max_silence=self._own.max_silence,
            now=time.monotonic(),
        )
        self.create_subscription(PathMessage, "corrected_path", self._take_path, 1)
        subscribe_transforms(self, self._take_transforms)

    def _take_image(self, message: Any) -> None:
        now = time.monotonic()
        stamp_ns = ns_from_time(message.header.stamp)
        self._status.message_came(self._depth_topic, now)
        self._watch_clock("images", stamp_ns)
        if self._info is not None:
            self._status.pair_came(now)
            self._pending.put(PendingFrame(message=message, stamp_ns=stamp_ns, arrived=now))

    def _take_info(self, message: CameraInfo) -> None:
        self._status.message_came(self._info_topic, time.monotonic())
        self._info = message

    def _take_transforms(self, message: Any, is_static: bool) -> None:
        for stamped in message.transforms:
            if not is_static:
                self._watch_clock(f"/tf of {stamped.child_frame_id}", ns_from_time(stamped.header.stamp))
            if not add_transform(self._buffer, stamped, is_static=is_static):
                self._status.num_invalid_transforms += 1
                self.get_logger().warning(
                    f"the transform from {stamped.child_frame_id} to {stamped.header.frame_id} has a value "
                    "that is not finite or a quaternion whose length is not 1, and is not used",
                    throttle_duration_sec=10.0,
                )
        self._pending.transforms_changed()

    def _take_path(self, message: PathMessage) -> None:
        """Move the map by what SLAM says now about where the robot has been."""
        if message.header.frame_id != self._own.map_frame:
            self.get_logger().warning(
                f"corrected_path is in '{message.header.frame_id}', not in map_frame "
                f"'{self._own.map_frame}', and not used",
                throttle_duration_sec=60.0,
            )
            return
        with self._map_lock:
            try:
                first, poses = self._corrections.corrected(
                    trajectory_from_path(message), self._map.viewpoints.stamps_ns, self._map.poses
                )
            except StairmapError as error:
                self.get_logger().warning(f"corrected_path: {error}", throttle_duration_sec=60.0)
                return
            self._map.correct(first, poses)
            self._results.publish(self._map.stairways(), self._last_stamp_ns)

    def _watch_clock(self, source: str, stamp_ns: int) -> None:
        back_ns = self._jumps.find(source, stamp_ns)
        if back_ns:
            self._status.num_jumps += 1
            self._buffer.clear()
            self._pending.clear()
            with self._map_lock:
                self._corrections = PathCorrections(first=len(self._map.viewpoints))
            self.get_logger().warning(
                f"{source}: time went back by {back_ns * 1e-9:.1f} s; transforms are forgotten, "
                "the map is kept"
            )

    def _work(self) -> None:
        while self._pending.wait(timeout=0.1):
            placed = self._pending.take(self._find_pose, time.monotonic())
            if placed is not None:
                try:
                    self._process(placed)
                except StairmapError as error:
                    self._status.refuse(str(error), time.monotonic())

    def _find_pose(self, frame: PendingFrame[Any]) -> Transform:
        camera_frame = self._own.camera_frame or frame.message.header.frame_id
        return self._buffer.lookup(self._own.map_frame, camera_frame, frame.stamp_ns)

    def _process(self, placed: PlacedFrame[Any]) -> None:
        message, stamp_ns = placed.frame.message, placed.frame.stamp_ns
        depth = depth_from_message(message)
        camera = camera_from_info(self._info, (depth.shape[1], depth.shape[0]))
        frame = self._map.frame(depth, camera)
        detection = self._map.detect(frame, placed.map_from_camera)
        with self._map_lock:
            self._map.add(frame, detection, stamp_ns, placed.map_from_camera)
            self._note_body_pose(placed)
            self._last_stamp_ns = stamp_ns
            self._results.publish(self._map.stairways(), stamp_ns)
        self._status.processed(detection, time.monotonic())
        self._status.published((self.get_clock().now().nanoseconds - stamp_ns) * 1e-9)

    def _note_body_pose(self, placed: PlacedFrame[Any]) -> None:
        try:
            map_from_body = self._buffer.lookup(
                self._own.map_frame, self._own.path_frame, placed.frame.stamp_ns
            )
        except TransformLookupError:
            return
        self._corrections.add(placed.frame.stamp_ns, map_from_body)

    def _report(self) -> None:
        if not self._worker.is_alive():
            raise RuntimeError("the worker has ended with an error, told above")
        num_stairways = self._results.num_stairways
        problem = self._pending.last_problem
        status = self._status.status(
            num_stairways, None if problem is None else str(problem), time.monotonic()
        )
        values = self._status.values(self._pending.num_superseded, self._pending.num_unplaced)
        name = self.get_fully_qualified_name().lstrip("/")
        stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(make_diagnostics(name, status, values, stamp))
        if status.kind != self._last_kind:
            # rclpy wants one severity for each place in the code.
            if status.level is Level.OK:
                self.get_logger().info(status.message)
            else:
                self.get_logger().warning(status.message)
            self._last_kind = status.kind
