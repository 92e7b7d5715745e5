"""A run as an MCAP file that Foxglove opens: scene, transforms, depth, clouds, measures over time.

The only module that imports foxglove (extra ``foxglove``). Topics and schemas are listed in docs/viewers.md.
Everything is in metres, radians and map coordinates, unless its ``frame_id`` is ``camera``.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import stairmap
from stairmap.arrays import Points
from stairmap.errors import MissingPackageError
from stairmap.export.summary import format_table
from stairmap.stairway import Stairway
from stairmap.transforms import quat_from_rotation
from stairmap.visualization.error_keeping_file import ErrorKeepingFile
from stairmap.visualization.foxglove_scene import FoxgloveScene
from stairmap.visualization.frame_view import FrameView
from stairmap.visualization.stairway_labels import height_colors
from stairmap.visualization.voxel_cloud import VoxelCloud

CAMERA_FRAME = "camera"

MAP_VOXEL = 0.04
MAX_MAP_POINTS = 150_000
MAX_FRAME_POINTS = 8_000

_POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgba", "u1", 4)])


def import_foxglove() -> Any:
    """Return the package foxglove.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    try:
        import foxglove  # noqa: PLC0415
        import foxglove.channels  # noqa: PLC0415
        import foxglove.messages  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("foxglove-sdk", "foxglove", "writing an MCAP file for Foxglove") from error
    return foxglove


class FoxgloveFile:
    """Writes a run to an MCAP file; an existing one is replaced.

    Parameters
    ----------
    path
        The file.
    name
        Name of the run, for the file's metadata.
    frame_id
        Name of the map's coordinate frame.
    positions
        (N, 3) way of the camera, map, m.

    Raises
    ------
    MissingPackageError
        If foxglove-sdk is not installed.
    OutputError
        If the file cannot be written.
    """

    def __init__(self, path: Path, *, name: str, frame_id: str, positions: Points) -> None:
        self._foxglove = import_foxglove()
        self._name, self._frame_id, self._positions = name, frame_id, positions
        self._context = self._foxglove.Context()
        self._file = ErrorKeepingFile(path)
        self._writer = self._foxglove.open_mcap(self._file, context=self._context)
        self._scene = FoxgloveScene(self._foxglove.messages, frame_id)
        self._channels: dict[str, Any] = {}
        self._cloud = VoxelCloud(MAP_VOXEL, MAX_MAP_POINTS)
        self._first_stamp_ns: int | None = None
        self._stairways: tuple[Stairway, ...] = ()

    def show_frame(self, view: FrameView) -> None:
        """Write one frame: transform, log line, and where there is depth, image, calibration and cloud.

        Raises
        ------
        OutputError
            If the file cannot be written any more.
        """
        messages, stamp = self._foxglove.messages, self._timestamp(view.stamp_ns)
        if self._first_stamp_ns is None:
            self._first_stamp_ns = view.stamp_ns
            self._write_way(view.stamp_ns)
        pose = view.map_from_camera
        transform = messages.FrameTransform(
            timestamp=stamp,
            parent_frame_id=self._frame_id,
            child_frame_id=CAMERA_FRAME,
            translation=messages.Vector3(x=pose[0, 3], y=pose[1, 3], z=pose[2, 3]),
            rotation=self._quaternion(pose[:3, :3]),
        )
        self._write("/tf", "FrameTransforms", messages.FrameTransforms(transforms=[transform]), view.stamp_ns)
        level = messages.LogLevel.Info if view.observations else messages.LogLevel.Warning
        line = messages.Log(timestamp=stamp, level=level, message=view.describe(), name="stairmap")
        self._write("/log", "Log", line, view.stamp_ns)
        edges = self._scene.edges_update(view.map_edges(), stamp)
        self._write("/stair_edges", "SceneUpdate", edges, view.stamp_ns)
        if view.frame is not None:
            self._write_depth(view)
        self._file.check()

    def show_stairways(self, stairways: Sequence[Stairway], number: int, stamp_ns: int) -> None:
        """Write the stairways as they are known after this frame."""
        self._stairways = tuple(stairways)
        update = self._scene.stairways_update(stairways, self._timestamp(stamp_ns))
        self._write("/stairways", "SceneUpdate", update, stamp_ns)
        for stairway in stairways:
            flight = stairway.flights[0]
            values = {
                "frame": number,
                "num_observations": stairway.num_observations,
                **{name: float(getattr(flight, name)) for name in ("rise", "run", "width", "pitch")},
                **{f"{name}_std": float(getattr(flight.std, name)) for name in ("rise", "run", "width")},
            }
            finite = {name: value for name, value in values.items() if np.isfinite(value)}
            self._json_channel(f"/measures/stairway_{stairway.id}").log(finite, log_time=stamp_ns)

    def close(self) -> None:
        """Write the map's cloud and metadata, and end the file.

        Raises
        ------
        OutputError
            If the file cannot be written to its end.
        """
        if self._first_stamp_ns is not None and len(self._cloud.points):
            # Stamped as the first message, so that the map is there wherever one looks into the run.
            cloud = self._cloud_message(self._cloud.points, self._frame_id, self._first_stamp_ns, np.eye(4))
            self._write("/map/cloud", "PointCloud", cloud, self._first_stamp_ns)
        self._writer.write_metadata(
            "stairmap",
            {
                "software": f"stairmap {stairmap.__version__}",
                "run": self._name,
                "frame_id": self._frame_id,
                "num_stairways": str(len(self._stairways)),
                "stairways": format_table(self._stairways),
            },
        )
        self._writer.close()
        self._file.close()
        self._file.check()

    def _write_way(self, stamp_ns: int) -> None:
        if len(self._positions):
            update = self._scene.way_update(self._positions, self._timestamp(stamp_ns))
            self._write("/trajectory", "SceneUpdate", update, stamp_ns)

    def _write_depth(self, view: FrameView) -> None:
        frame, messages = view.frame, self._foxglove.messages
        assert frame is not None
        camera, stamp = frame.camera, self._timestamp(view.stamp_ns)
        matrix = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0]
        calibration = messages.CameraCalibration(
            timestamp=stamp,
            frame_id=CAMERA_FRAME,
            width=camera.width,
            height=camera.height,
            K=matrix,
            R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            P=[*matrix[:3], 0.0, *matrix[3:6], 0.0, *matrix[6:], 0.0],
        )
        self._write("/camera/calibration", "CameraCalibration", calibration, view.stamp_ns)
        millimetres = np.nan_to_num(np.clip(frame.depth * 1e3, 0, 65535)).astype("<u2")
        image = messages.RawImage(
            timestamp=stamp,
            frame_id=CAMERA_FRAME,
            width=camera.width,
            height=camera.height,
            encoding="16UC1",
            step=2 * camera.width,
            data=millimetres.tobytes(),
        )
        self._write("/camera/depth", "RawImage", image, view.stamp_ns)
        points, pose = view.camera_points(max_points=MAX_FRAME_POINTS), view.map_from_camera
        cloud = self._cloud_message(points, CAMERA_FRAME, view.stamp_ns, pose)
        self._write("/camera/points", "PointCloud", cloud, view.stamp_ns)
        if len(self._positions):
            self._cloud.add(points @ pose[:3, :3].T + pose[:3, 3])

    def _cloud_message(self, points: Points, frame_id: str, stamp_ns: int, map_from_points: Points) -> Any:
        messages = self._foxglove.messages
        table = np.zeros(len(points), dtype=_POINT)
        table["x"], table["y"], table["z"] = points.T
        heights = points @ map_from_points[2, :3] + map_from_points[2, 3]
        low, high = np.percentile(heights, [2, 98]) if len(heights) else (0.0, 1.0)
        table["rgba"][:, :3], table["rgba"][:, 3] = height_colors(heights, low, high), 255
        numeric = messages.PackedElementFieldNumericType
        names = [("x", 0, numeric.Float32), ("y", 4, numeric.Float32), ("z", 8, numeric.Float32)]
        names += [(name, 12 + i, numeric.Uint8) for i, name in enumerate(("red", "green", "blue", "alpha"))]
        return messages.PointCloud(
            timestamp=self._timestamp(stamp_ns),
            frame_id=frame_id,
            point_stride=_POINT.itemsize,
            fields=[messages.PackedElementField(name=n, offset=o, type=t) for n, o, t in names],
            data=table.tobytes(),
        )

    def _write(self, topic: str, schema: str, message: Any, stamp_ns: int) -> None:
        if topic not in self._channels:
            make = getattr(self._foxglove.channels, f"{schema}Channel")
            self._channels[topic] = make(topic, context=self._context)
        self._channels[topic].log(message, log_time=stamp_ns)

    def _json_channel(self, topic: str) -> Any:
        if topic not in self._channels:
            self._channels[topic] = self._foxglove.Channel(topic, context=self._context)
        return self._channels[topic]

    def _timestamp(self, stamp_ns: int) -> Any:
        return self._foxglove.messages.Timestamp(*divmod(stamp_ns, 1_000_000_000))

    def _quaternion(self, rotation: Points) -> Any:
        x, y, z, w = quat_from_rotation(rotation)
        return self._foxglove.messages.Quaternion(x=x, y=y, z=z, w=w)
