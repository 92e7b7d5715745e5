"""Writes bags of every format, for tests: what a robot with a depth camera says in ROS 1 or ROS 2."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from stairmap.arrays import Transform
from stairmap.camera import PinholeCamera
from stairmap.recordings.base import Recording
from stairmap.transforms import invert_transform, quat_from_rotation, transform_from_parts

KINDS = (
    "ros1",
    "ros1_lz4",
    "ros1_bz2",
    "sqlite",
    "sqlite_humble",
    "sqlite_zstd_messages",
    "mcap",
    "mcap_zstd",
    "bare_db3",
    "bare_mcap",
    "folder_without_metadata",
)
"""Formats that ``write_bag`` knows."""

DEPTH_TOPIC = "/camera/depth/image_rect_raw"
INFO_TOPIC = "/camera/depth/camera_info"
OPTICAL = "camera_depth_optical_frame"

Messages = list[tuple[int, str, Any]]
"""When it was recorded, ns; topic; message."""

BASE_FROM_LINK = transform_from_parts(np.eye(3), [0.1, 0.0, 0.5])
LINK_FROM_OPTICAL = transform_from_parts([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [0.0, 0.02, 0.0])


class Ros:
    """Makes messages of one ROS version."""

    def __init__(self, kind: str) -> None:
        self.is_ros1 = kind.startswith("ros1")
        self.store = get_typestore(Stores.ROS1_NOETIC if self.is_ros1 else Stores.ROS2_HUMBLE)
        if self.is_ros1:
            text = "geometry_msgs/TransformStamped[] transforms\n"
            self.store.register(get_types_from_msg(text, "tf2_msgs/msg/TFMessage"))

    def make(self, name: str, **fields: Any) -> Any:
        return self.store.types[name](**fields)

    def header(self, stamp_ns: int, frame_id: str) -> Any:
        stamp = self.make(
            "builtin_interfaces/msg/Time", sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000
        )
        more = {"seq": 0} if self.is_ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id, **more)

    def image(
        self,
        depth: np.ndarray,
        stamp_ns: int,
        *,
        encoding: str = "16UC1",
        is_bigendian: bool = False,
        padding: int = 0,
        frame_id: str = OPTICAL,
        values_per_metre: float = 1000.0,
    ) -> Any:
        """Depth in metres, NaN for nothing, as an image; any other encoding than 32FC1 is of 16 bits."""
        whole = np.nan_to_num(np.rint(depth * values_per_metre)).astype(np.uint16)
        values = depth if encoding == "32FC1" else whole
        rows = values.astype(values.dtype.newbyteorder(">" if is_bigendian else "<")).view(np.uint8)
        rows = np.hstack([rows, np.zeros((len(rows), padding), dtype=np.uint8)])
        return self.make(
            "sensor_msgs/msg/Image",
            header=self.header(stamp_ns, frame_id),
            height=depth.shape[0],
            width=depth.shape[1],
            encoding=encoding,
            is_bigendian=int(is_bigendian),
            step=rows.shape[1],
            data=rows.ravel(),
        )

    def compressed(self, depth: np.ndarray, stamp_ns: int, *, encoding: str = "16UC1") -> Any:
        """Depth in metres as compressedDepth; 32FC1 quantised as its publisher does by default."""
        factor, offset = 0.0, 0.0
        if encoding == "16UC1":
            values = np.nan_to_num(np.rint(depth * 1000)).astype(np.uint16)
        else:
            factor = 100.0 * 101.0
            offset = 1.0 - factor / 10.0
            values = np.where(np.isnan(depth), 0, np.nan_to_num(factor / depth + offset)).astype(np.uint16)
        data = struct.pack("<iff", 0, factor, offset) + cv2.imencode(".png", values)[1].tobytes()
        return self.make(
            "sensor_msgs/msg/CompressedImage",
            header=self.header(stamp_ns, OPTICAL),
            format=f"{encoding}; compressedDepth png",
            data=np.frombuffer(data, dtype=np.uint8),
        )

    def camera_info(self, camera: PinholeCamera, stamp_ns: int) -> Any:
        k = [camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1]
        p = [camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0]
        matrices = {"d": [0.0] * 5, "k": k, "r": np.eye(3).ravel(), "p": p}
        arrays = {name: np.array(value, dtype=np.float64) for name, value in matrices.items()}
        if self.is_ros1:
            arrays = {name.upper(): value for name, value in arrays.items()}
        return self.make(
            "sensor_msgs/msg/CameraInfo",
            header=self.header(stamp_ns, OPTICAL),
            height=camera.height,
            width=camera.width,
            distortion_model="plumb_bob",
            binning_x=0,
            binning_y=0,
            roi=self.make(
                "sensor_msgs/msg/RegionOfInterest",
                x_offset=0,
                y_offset=0,
                height=0,
                width=0,
                do_rectify=False,
            ),
            **arrays,
        )

    def vector(self, name: str, transform: Transform) -> Any:
        x, y, z = transform[:3, 3].tolist()
        return self.make(f"geometry_msgs/msg/{name}", x=x, y=y, z=z)

    def quaternion(self, transform: Transform) -> Any:
        x, y, z, w = quat_from_rotation(transform[:3, :3]).tolist()
        return self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def tf(self, stamp_ns: int, *links: tuple[str, str, Transform]) -> Any:
        return self.make(
            "tf2_msgs/msg/TFMessage",
            transforms=[
                self.make(
                    "geometry_msgs/msg/TransformStamped",
                    header=self.header(stamp_ns, parent),
                    child_frame_id=child,
                    transform=self.make(
                        "geometry_msgs/msg/Transform",
                        translation=self.vector("Vector3", parent_from_child),
                        rotation=self.quaternion(parent_from_child),
                    ),
                )
                for parent, child, parent_from_child in links
            ],
        )

    def pose(self, transform: Transform) -> Any:
        return self.make(
            "geometry_msgs/msg/Pose",
            position=self.vector("Point", transform),
            orientation=self.quaternion(transform),
        )

    def pose_stamped(self, stamp_ns: int, parent: str, transform: Transform) -> Any:
        return self.make(
            "geometry_msgs/msg/PoseStamped",
            header=self.header(stamp_ns, parent),
            pose=self.pose(transform),
        )

    def odometry(self, stamp_ns: int, parent: str, child: str, transform: Transform) -> Any:
        still = self.make(
            "geometry_msgs/msg/Twist",
            linear=self.vector("Vector3", np.zeros((4, 4))),
            angular=self.vector("Vector3", np.zeros((4, 4))),
        )
        return self.make(
            "nav_msgs/msg/Odometry",
            header=self.header(stamp_ns, parent),
            child_frame_id=child,
            pose=self.make(
                "geometry_msgs/msg/PoseWithCovariance", pose=self.pose(transform), covariance=np.zeros(36)
            ),
            twist=self.make("geometry_msgs/msg/TwistWithCovariance", twist=still, covariance=np.zeros(36)),
        )

    def text(self, data: str) -> Any:
        return self.make("std_msgs/msg/String", data=data)


def depth_messages(ros: Ros, recording: Recording, **options: Any) -> Messages:
    """Images and CameraInfo of a recording's frames, each recorded 5 ms after its stamp."""
    messages: Messages = []
    for frame in recording:
        recorded_ns = frame.stamp_ns + 5_000_000
        messages.append((recorded_ns, INFO_TOPIC, ros.camera_info(frame.camera, frame.stamp_ns)))
        messages.append((recorded_ns, DEPTH_TOPIC, ros.image(frame.depth, frame.stamp_ns, **options)))
    return messages


def static_messages(ros: Ros) -> Messages:
    """The camera's mount on ``base_link``, in two links."""
    links = [("base_link", "camera_link", BASE_FROM_LINK), ("camera_link", OPTICAL, LINK_FROM_OPTICAL)]
    return [(0, "/tf_static", ros.tf(0, *links))]


def transform_messages(ros: Ros, recording: Recording) -> Messages:
    """``map`` to ``odom`` to ``base_link`` such that the camera is where the recording says."""
    messages: Messages = []
    for stamp_ns, map_from_base in base_poses(recording):
        map_from_odom = transform_from_parts(np.eye(3), [1.0, 0.1 * stamp_ns * 1e-9, 0.0])
        odom_from_base = invert_transform(map_from_odom) @ map_from_base
        messages.append((stamp_ns, "/tf", ros.tf(stamp_ns, ("odom", "base_link", odom_from_base))))
        messages.append((stamp_ns, "/tf", ros.tf(stamp_ns, ("map", "odom", map_from_odom))))
    return messages


def base_poses(recording: Recording) -> list[tuple[int, Transform]]:
    """Stamps and ``map_from_base`` of a recording's poses."""
    base_from_optical = BASE_FROM_LINK @ LINK_FROM_OPTICAL
    trajectory = recording.check_poses()
    return [
        (int(stamp_ns), pose @ invert_transform(base_from_optical))
        for stamp_ns, pose in zip(trajectory.stamps_ns, trajectory.map_from_camera, strict=True)
    ]


def robot_messages(ros: Ros, recording: Recording, **options: Any) -> Messages:
    """Depth, CameraInfo, transforms and a topic that is none of our business."""
    return [
        *static_messages(ros),
        (1, "/chatter", ros.text("hello")),
        *transform_messages(ros, recording),
        *depth_messages(ros, recording, **options),
    ]


def write_bag(folder: Path, kind: str, ros: Ros, messages: Iterable[tuple[int, str, Any]]) -> Path:
    """Write messages in the order in which they were recorded; return the path that a user would give."""
    return write_ordered_bag(folder, kind, ros, sorted(messages, key=lambda message: message[0]))


def write_ordered_bag(folder: Path, kind: str, ros: Ros, messages: Iterable[tuple[int, str, Any]]) -> Path:
    """Write messages as they come; see ``write_bag``."""
    if ros.is_ros1:
        return _write_ros1(folder / "walk.bag", kind, ros, messages)
    return _write_ros2(folder / "walk", kind, ros, messages)


def _write_ros1(path: Path, kind: str, ros: Ros, messages: Iterable[tuple[int, str, Any]]) -> Path:
    writer = Ros1Writer(path)
    if kind != "ros1":
        writer.set_compression(Ros1Writer.CompressionFormat[kind.removeprefix("ros1_").upper()])
    with writer:
        connections: dict[str, Any] = {}
        for recorded_ns, topic, message in messages:
            name = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=ros.store)
            writer.write(connections[topic], recorded_ns, ros.store.serialize_ros1(message, name))
    return path


def _write_ros2(path: Path, kind: str, ros: Ros, messages: Iterable[tuple[int, str, Any]]) -> Path:
    is_mcap = "mcap" in kind
    writer = Ros2Writer(
        path,
        version=8 if kind == "sqlite_humble" else 9,
        storage_plugin=StoragePlugin.MCAP if is_mcap else StoragePlugin.SQLITE3,
    )
    if "zstd" in kind:
        mode = CompressionMode.STORAGE if is_mcap else CompressionMode.MESSAGE
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for recorded_ns, topic, message in messages:
            name = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=ros.store)
            writer.write(connections[topic], recorded_ns, ros.store.serialize_cdr(message, name))
    if kind == "folder_without_metadata":
        (path / "metadata.yaml").unlink()
    if kind.startswith("bare_"):
        (file,) = (file for file in path.iterdir() if file.name != "metadata.yaml")
        bare = path.with_suffix(file.suffix)
        shutil.move(file, bare)
        shutil.rmtree(path)
        return bare
    return path
