"""``ros2 run stairmap_ros play_recording RECORDING``: publishes any recording as a robot would.

Depth (32FC1, metres), camera_info and TF with stamps of now. To try the node without a robot: record with
``stairmap simulate``, or take an image folder or a bag.
"""

from __future__ import annotations

import argparse
import array
import signal
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage

from stairmap.arrays import Transform
from stairmap.camera import PinholeCamera
from stairmap.errors import StairmapError
from stairmap.frame import DepthFrame
from stairmap.recordings.open import open_recording
from stairmap.transforms import quat_from_rotation
from stairmap_ros.messages import time_from_ns

OPTICAL = "camera_depth_optical_frame"


def main() -> int:
    """Publish a recording; return 1 with one line on stderr if it cannot be read."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path, help="image folder or bag, with poses")
    parser.add_argument("--rate", type=float, default=1.0, help="how many times faster than it was taken")
    parser.add_argument("--loop", action="store_true", help="from the beginning again at its end")
    arguments = parser.parse_args(remove_ros_args(sys.argv)[1:])
    # rclpy's own handlers would take the publishers away while they are used.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        player = Player()
        while True:
            player.play(arguments.recording, arguments.rate)
            if not arguments.loop:
                return 0
    except StairmapError as error:
        print(f"play_recording: {error}", file=sys.stderr)  # noqa: T201
        return 1
    except KeyboardInterrupt:
        return 130
    finally:
        rclpy.try_shutdown()


class Player(Node):
    """Publishes the frames of a recording."""

    def __init__(self) -> None:
        super().__init__("play_recording")
        self._depth_out = self.create_publisher(Image, "depth/image_rect_raw", qos_profile_sensor_data)
        self._info_out = self.create_publisher(CameraInfo, "depth/camera_info", qos_profile_sensor_data)
        self._tf_out = self.create_publisher(TFMessage, "/tf", 100)

    def play(self, path: Path, rate: float) -> None:
        """Publish a recording once, its frames as far apart as they were taken.

        Raises
        ------
        StairmapError
            If it cannot be read or has no poses.
        """
        recording = open_recording(path)
        trajectory = recording.check_poses()
        self._wait_for_listener()
        first_ns, started = recording.time_range_ns[0], time.monotonic()
        for frame in recording:
            if not trajectory.has_pose(np.array([frame.stamp_ns]))[0]:
                continue
            due = started + (frame.stamp_ns - first_ns) * 1e-9 / rate
            time.sleep(max(0.0, due - time.monotonic()))
            self._publish(frame, trajectory.pose_at(frame.stamp_ns), recording.frame_id)

    def _wait_for_listener(self) -> None:
        """Wait until somebody listens, and until the two have found each other for good."""
        while self._depth_out.get_subscription_count() == 0:
            self.get_logger().info("waiting for the node to subscribe", once=True)
            time.sleep(0.1)
        time.sleep(1.0)

    def _publish(self, frame: DepthFrame, map_from_camera: Transform, map_frame: str) -> None:
        stamp = time_from_ns(time.time_ns())
        transform = TransformStamped(child_frame_id=OPTICAL)
        transform.header.frame_id, transform.header.stamp = map_frame, stamp
        position, turn = transform.transform.translation, transform.transform.rotation
        position.x, position.y, position.z = map_from_camera[:3, 3].tolist()
        turn.x, turn.y, turn.z, turn.w = quat_from_rotation(map_from_camera[:3, :3]).tolist()
        self._tf_out.publish(TFMessage(transforms=[transform]))
        self._info_out.publish(make_camera_info(frame.camera, stamp))
        camera = frame.camera
        image = Image(width=camera.width, height=camera.height, encoding="32FC1", step=4 * camera.width)
        image.header.frame_id, image.header.stamp = OPTICAL, stamp
        image.data = array.array("B", frame.depth.tobytes())
        self._depth_out.publish(image)


def make_camera_info(camera: PinholeCamera, stamp: Time) -> CameraInfo:
    """Return the intrinsics of a rectified camera as a message."""
    info = CameraInfo(width=camera.width, height=camera.height, distortion_model="plumb_bob")
    info.header.frame_id, info.header.stamp = OPTICAL, stamp
    info.d = [0.0] * 5
    info.k = np.array([camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1])
    info.r = np.eye(3).ravel()
    info.p = np.array([camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0])
    return info


if __name__ == "__main__":
    sys.exit(main())
