"""A RealSense camera without hardware: librealsense's software device, fed with frames of our own."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyrealsense2 as rs

from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame

DEPTH_UNIT = 0.001


class SoftwareRealSense:
    """A device with a depth stream and, if wanted, an accelerometer; real frames go through librealsense."""

    def __init__(self, camera: PinholeCamera, *, has_accelerometer: bool = False, distortion: float = 0.0):
        self.device = rs.software_device()
        self.device.register_info(rs.camera_info.name, "Software D435i")
        self.device.register_info(rs.camera_info.serial_number, "0123")
        self._camera = camera
        self._depth = self.device.add_sensor("Stereo Module")
        self._depth.add_read_only_option(rs.option.depth_units, DEPTH_UNIT)
        self.depth_profile = self._depth.add_video_stream(self._video_stream(distortion))
        self._motion: Any = None
        if has_accelerometer:
            stream = rs.motion_stream()
            stream.type, stream.index, stream.uid, stream.fps = rs.stream.accel, 0, 1, 100
            stream.fmt, stream.intrinsics = rs.format.motion_xyz32f, rs.motion_device_intrinsic()
            self._motion = self.device.add_sensor("Motion Module")
            self._motion_profile = self._motion.add_motion_stream(stream)
        self._num_sent = 0

    def send(self, frame: DepthFrame) -> None:
        """Deliver a frame as the camera would."""
        self._num_sent += 1
        counts = np.nan_to_num(np.asarray(frame.depth) / DEPTH_UNIT)
        image = rs.software_video_frame()
        image.pixels = np.ascontiguousarray(np.rint(counts), dtype=np.uint16)
        image.bpp, image.stride = 2, 2 * self._camera.width
        image.timestamp, image.frame_number = frame.stamp_ns * 1e-6, self._num_sent
        image.domain, image.depth_units = rs.timestamp_domain.system_time, DEPTH_UNIT
        image.profile = self.depth_profile.as_video_stream_profile()
        self._depth.on_video_frame(image)

    def send_acceleration(self, reading: Sequence[float]) -> None:
        """Deliver a reading of the accelerometer, m/s²."""
        motion = rs.software_motion_frame()
        values = rs.vector()
        values.x, values.y, values.z = (float(value) for value in reading)
        motion.data, motion.timestamp, motion.frame_number = values, 1.0, 1
        motion.domain, motion.profile = (
            rs.timestamp_domain.system_time,
            self._motion_profile.as_motion_stream_profile(),
        )
        self._motion.on_motion_frame(motion)

    def record(self, path: Path, frames: Sequence[DepthFrame], *, period: float) -> Path:
        """Write frames with librealsense's recorder, ``period`` seconds apart."""
        recorder = rs.recorder(str(path), self.device)
        sensor = recorder.query_sensors()[0]
        sensor.open(self.depth_profile)
        sensor.start(rs.frame_queue(1))
        for frame in frames:
            self.send(frame)
            time.sleep(period)
        sensor.stop()
        sensor.close()
        return path

    def _video_stream(self, distortion: float) -> Any:
        intrinsics = rs.intrinsics()
        intrinsics.width, intrinsics.height = self._camera.width, self._camera.height
        intrinsics.fx, intrinsics.fy = self._camera.fx, self._camera.fy
        intrinsics.ppx, intrinsics.ppy = self._camera.cx, self._camera.cy
        intrinsics.model, intrinsics.coeffs = rs.distortion.brown_conrady, [distortion, 0, 0, 0, 0]
        stream = rs.video_stream()
        stream.type, stream.index, stream.uid, stream.fps = rs.stream.depth, 0, 0, 30
        stream.width, stream.height, stream.bpp, stream.fmt = (
            self._camera.width,
            self._camera.height,
            2,
            rs.format.z16,
        )
        stream.intrinsics = intrinsics
        return stream
