"""What the simulated robot sends and hears: arrays into messages, messages into JSON types."""

from __future__ import annotations

import array
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TransformStamped
from sensor_msgs.msg import CompressedImage, Image
from stairmap_msgs.msg import StairwayArray
from visualization_msgs.msg import Marker

from stairmap.transforms import invert_transform, quat_from_rotation, transform_from_parts

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from rvl_encoder import encode_rvl

BASE_FROM_OPTICAL = transform_from_parts([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [0.3, 0.0, 0.4])


def transform_message(
    parent: str, child: str, parent_from_child: np.ndarray, stamp_ns: int
) -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, time_message(stamp_ns)
    position, turn = message.transform.translation, message.transform.rotation
    position.x, position.y, position.z = parent_from_child[:3, 3].tolist()
    turn.x, turn.y, turn.z, turn.w = quat_from_rotation(parent_from_child[:3, :3]).tolist()
    return message


def pose_message(map_from_camera: np.ndarray, stamp: Time) -> PoseStamped:
    map_from_base = map_from_camera @ invert_transform(BASE_FROM_OPTICAL)
    message = PoseStamped()
    message.header.stamp = stamp
    position, turn = message.pose.position, message.pose.orientation
    position.x, position.y, position.z = map_from_base[:3, 3].tolist()
    turn.x, turn.y, turn.z, turn.w = quat_from_rotation(map_from_base[:3, :3]).tolist()
    return message


def compressed_image(depth: np.ndarray, kind: str) -> CompressedImage:
    data = encode_rvl(depth) if kind == "rvl" else cv2.imencode(".png", depth)[1].tobytes()
    return CompressedImage(format=f"16UC1; compressedDepth {kind}", data=array.array("B", bytes(12) + data))


def raw_image(depth: np.ndarray) -> Image:
    height, width = depth.shape
    data = array.array("B", depth.tobytes())
    return Image(height=height, width=width, encoding="16UC1", step=2 * width, data=data)


def time_message(stamp_ns: int) -> Time:
    return Time(sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000)


def ns_from(stamp: Any) -> int:
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def vector(point: Any) -> list[float]:
    return [point.x, point.y, point.z]


def stairway_dict(stairway: Any, message: StairwayArray) -> dict[str, Any]:
    flights = []
    for flight in stairway.flights:
        turn = flight.pose.pose.orientation
        flights.append(
            {
                "base": vector(flight.pose.pose.position),
                "heading": float(2.0 * np.arctan2(turn.z, turn.w)),
                "rise": flight.rise,
                "run": flight.run,
                "width": flight.width,
                "num_risers": flight.num_risers,
                "covariance": np.asarray(flight.covariance).tolist(),
                "pose_covariance": np.asarray(flight.pose.covariance).tolist(),
                "num_steps": len(flight.steps),
                "box_center": vector(flight.box_center),
                "box_size": vector(flight.box_size),
            }
        )
    return {
        "id": stairway.id,
        "frame_id": message.header.frame_id,
        "num_observations": stairway.num_observations,
        "first_seen_ns": ns_from(stairway.first_seen),
        "last_seen_ns": ns_from(stairway.last_seen),
        "flights": flights,
    }


def marker_dict(marker: Marker) -> dict[str, Any]:
    return {
        "ns": marker.ns,
        "frame_id": marker.header.frame_id,
        "text": marker.text,
        "points": [vector(point) for point in marker.points],
        "position": vector(marker.pose.position),
        "scale": vector(marker.scale),
    }
