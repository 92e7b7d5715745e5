"""The thread that looks at images: decodes each, hands it to the map, and notes what is wrong with it."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Thread
from typing import Any

from sensor_msgs.msg import CameraInfo

from stairmap.arrays import Transform
from stairmap.errors import StairmapError, TransformLookupError
from stairmap.recordings.camera_info import camera_from_info
from stairmap.recordings.depth_message import depth_from_message
from stairmap.recordings.depth_unit_watch import DepthUnitWatch
from stairmap_ros.depth_unit import check_depth_unit, describe_unit_mistake
from stairmap_ros.live_map import LiveMap, PlacedDepth
from stairmap_ros.node_config import NodeConfig
from stairmap_ros.node_status import NodeStatus
from stairmap_ros.pending_frames import PendingFrame, PendingFrames, PlacedFrame
from stairmap_ros.transforms_in import TransformsIn

WAIT = 0.1
"""How long the worker sleeps at most, s: images whose transform never comes are given up in time."""


class ImageWorker:
    """Looks at images while the node is active.

    Parameters
    ----------
    own
        Coordinate frames and the depth's unit.
    pending, transforms
        Images that wait, and where they were taken.
    live_map
        What they enter.
    status
        Where what is wrong with them is noted.
    camera_info
        Gives the newest camera_info.
    now_ns
        Gives the ROS time, nanoseconds.
    looked
        Called after each image.
    """

    def __init__(
        self,
        own: NodeConfig,
        *,
        pending: PendingFrames[Any],
        transforms: TransformsIn,
        live_map: LiveMap,
        status: NodeStatus,
        camera_info: Callable[[], CameraInfo | None],
        now_ns: Callable[[], int],
        looked: Callable[[], None],
    ) -> None:
        self._own, self._pending, self._transforms = own, pending, transforms
        self._live_map, self._status = live_map, status
        self._camera_info, self._now_ns, self._looked = camera_info, now_ns, looked
        self._unit_watch = DepthUnitWatch()
        self._thread = Thread(target=self._work, name="stairmap worker", daemon=True)
        self._thread.start()

    @property
    def is_alive(self) -> bool:
        """False after an error that nobody foresaw."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Stop looking, after the image at hand."""
        self._pending.close()
        self._thread.join(timeout=5.0)

    def _work(self) -> None:
        while self._pending.wait(timeout=WAIT):
            placed = self._pending.take(self._find_pose, time.monotonic())
            if placed is not None:
                try:
                    self._look(placed)
                except StairmapError as error:
                    self._status.refuse(str(error), time.monotonic())

    def _find_pose(self, frame: PendingFrame[Any]) -> Transform:
        camera_frame = self._own.camera_frame or frame.message.header.frame_id
        return self._transforms.lookup(self._own.map_frame, camera_frame, frame.stamp_ns)

    def _look(self, placed: PlacedFrame[Any]) -> None:
        message, stamp_ns = placed.frame.message, placed.frame.stamp_ns
        depth = depth_from_message(message, values_per_metre=1.0 / self._own.depth_unit)
        check_depth_unit(depth, message)
        camera = camera_from_info(self._camera_info(), (depth.shape[1], depth.shape[0]))
        image = PlacedDepth(
            depth=depth,
            camera=camera,
            stamp_ns=stamp_ns,
            map_from_camera=placed.map_from_camera,
            map_from_body=self._find_body(stamp_ns),
        )
        detection = self._live_map.look(image)
        self._looked()
        self._watch_unit(image, message)
        self._status.processed(detection, time.monotonic())
        self._status.published((self._now_ns() - stamp_ns) * 1e-9)

    def _find_body(self, stamp_ns: int) -> Transform | None:
        try:
            return self._transforms.lookup(self._own.map_frame, self._own.path_frame, stamp_ns)
        except TransformLookupError:
            return None

    def _watch_unit(self, image: PlacedDepth, message: Any) -> None:
        if self._unit_watch.is_sure:
            return
        self._unit_watch.add(image.depth, image.camera, image.stamp_ns, image.map_from_camera)
        mistake = self._unit_watch.mistake()
        if mistake is not None:
            self._status.set_problem("unit", describe_unit_mistake(mistake, message, self._own.depth_unit))
