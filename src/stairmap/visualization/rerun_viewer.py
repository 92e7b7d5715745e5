"""A run in the rerun viewer: depth, cloud, stair edges, stairways, and the measures as they converge.

The only module that imports rerun (extra ``rerun``). Everything is logged under ``map/`` in map
coordinates and metres; ``measures/`` holds plots in mm and deg, ``log`` one line a frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import Points
from stairmap.camera import PinholeCamera
from stairmap.errors import MissingPackageError, OutputError
from stairmap.output_files import discard_partial, output_error, partial_path, write_whole
from stairmap.stairway import Stairway
from stairmap.visualization.frame_view import FrameView
from stairmap.visualization.rerun_blueprint import make_blueprint
from stairmap.visualization.rerun_stairways import stairway_entities
from stairmap.visualization.stairway_labels import (
    EDGE_COLOR,
    NOSING_COLOR,
    TRAJECTORY_COLOR,
    Viewpoint,
    find_viewpoint,
    height_colors,
    measures_markdown,
    stairway_color,
)
from stairmap.visualization.voxel_cloud import VoxelCloud

MAP_VOXEL = 0.04
"""Edge of the map cloud's voxels at the start, m."""

MAX_MAP_POINTS = 600_000
MAX_FRAME_POINTS = 20_000
"""Of the cloud of one frame."""

MEASURES: Mapping[str, tuple[str, float]] = {"rise": ("mm", 1e3), "run": ("mm", 1e3), "width": ("mm", 1e3)}
"""What is plotted: unit, and how many of it are one metre."""

_DEPTH_UNITS_PER_METRE = 1000.0
_FIRST_PLAUSIBLE_DATE_NS = 946_684_800_000_000_000
"""Stamps after the year 2000 are dates; smaller ones are times since some start."""


def import_rerun() -> Any:
    """Return the package rerun.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    try:
        import rerun  # noqa: PLC0415
        import rerun.blueprint  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("rerun-sdk", "rerun", "the 3-D viewer") from error
    return rerun


class RerunViewer:
    """Sends a run to rerun: to a file or to a viewer that listens.

    Parameters
    ----------
    name
        Title of the recording in the viewer.
    viewpoint
        Where to look from at the start.
    positions
        (N, 3) way of the camera, map, m.
    is_map
        Whether frames share one map; without poses each frame's cloud stands alone.
    opens_log
        Whether the lines of the frames are shown first, instead of the table of measures.
    follows
        Whether to look at the first stairway when it is found, as in a run that goes on.

    Raises
    ------
    MissingPackageError
        If rerun is not installed.
    """

    def __init__(
        self,
        name: str,
        *,
        viewpoint: Viewpoint,
        positions: Points,
        is_map: bool,
        opens_log: bool = False,
        follows: bool = False,
    ) -> None:
        self._rr = import_rerun()
        self._stream = self._rr.RecordingStream("stairmap", recording_id=None, send_properties=True)
        self._name, self._viewpoint, self._positions, self._is_map = name, viewpoint, positions, is_map
        self._opens_log, self._follows = opens_log, follows
        self._cloud = VoxelCloud(MAP_VOXEL, MAX_MAP_POINTS)
        self._camera: PinholeCamera | None = None
        self._path: Path | None = None
        self._shown_ids: set[int] = set()
        self._styled_paths: set[str] = set()

    def save(self, path: Path) -> None:
        """Write everything from now on to an ``.rrd`` file.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise output_error(path, error) from error
        write_whole(partial_path(path), b"", durable=False)
        self._path = path
        self._stream.save(partial_path(path), default_blueprint=self._blueprint())
        self._log_static()

    def connect(self, port: int) -> None:
        """Send everything from now on to the viewer that listens at this port of 127.0.0.1."""
        blueprint = self._blueprint()
        self._stream.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy", default_blueprint=blueprint)
        self._stream.send_blueprint(blueprint)
        self._log_static()

    def close(self) -> None:
        """Wait until everything has been written or sent.

        A window that was closed in the meantime is no error: nobody looks any more.

        Raises
        ------
        OutputError
            If the file could not be written to its end.
        """
        try:
            self._stream.flush()
            self._stream.disconnect()
            if self._path is not None:
                partial_path(self._path).replace(self._path)
        except RuntimeError as error:
            if self._path is not None:
                discard_partial(self._path)
                raise OutputError(f"cannot write {self._path}: {error}") from error
        except OSError as error:
            if self._path is not None:
                raise output_error(self._path, error) from error
            raise

    def show_frame(self, view: FrameView) -> None:
        """Log one frame."""
        rr = self._rr
        self._set_time(view.number, view.stamp_ns)
        pose = view.map_from_camera
        self._stream.log("map/camera", rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
        map_edges = view.map_edges()
        self._stream.log("map/edges", rr.LineStrips3D(map_edges, colors=EDGE_COLOR, radii=0.008))
        level = rr.TextLogLevel.INFO if view.observations else rr.TextLogLevel.WARN
        self._stream.log("log", rr.TextLog(view.describe(), level=level))
        for seen in view.observations:
            for name, (_, factor) in MEASURES.items():
                self._stream.log(f"measures/{name}/single_frames", rr.Scalars(getattr(seen, name) * factor))
        if view.frame is not None:
            self._show_depth(view)

    def show_stairways(self, stairways: Sequence[Stairway], number: int, stamp_ns: int) -> None:
        """Log the stairways as they are known after this frame."""
        rr = self._rr
        if stairways and not self._shown_ids and self._follows:
            self._viewpoint, self._opens_log = find_viewpoint(stairways, self._positions), False
            self._stream.send_blueprint(self._blueprint())
        self._set_time(number, stamp_ns)
        for gone in self._shown_ids - {stairway.id for stairway in stairways}:
            self._stream.log(f"map/stairways/{gone}", rr.Clear(recursive=True))
        self._shown_ids = {stairway.id for stairway in stairways}
        # rerun's labels have the same size at any distance, so from afar they stand higher to hide no step.
        lift = max(0.35, 0.13 * self._viewpoint.distance)
        for stairway in stairways:
            for path, entity in stairway_entities(rr, stairway, label_lift=lift):
                self._stream.log(f"map/stairways/{stairway.id}/{path}", entity)
            self._show_measures(stairway)
        self._stream.log(
            "summary", rr.TextDocument(measures_markdown(stairways), media_type=rr.MediaType.MARKDOWN)
        )

    def _blueprint(self) -> Any:
        return make_blueprint(
            self._rr, self._viewpoint, MEASURES, is_map=self._is_map, opens_log=self._opens_log
        )

    def _show_measures(self, stairway: Stairway) -> None:
        flight = stairway.flights[0]
        for name, (_, factor) in MEASURES.items():
            value, std = getattr(flight, name) * factor, getattr(flight.std, name) * factor
            path = f"measures/{name}/stairway_{stairway.id}"
            if path not in self._styled_paths:
                self._styled_paths.add(path)
                self._stream.log(path, self._measure_lines(stairway.id), static=True)
            self._stream.log(path, self._rr.Scalars([value, value - std, value + std]))

    def _measure_lines(self, stairway_id: int) -> Any:
        """Style of the estimate and of the two lines one standard deviation beside it."""
        color = stairway_color(stairway_id)
        name = f"stairway {stairway_id}"
        return self._rr.SeriesLines(
            names=[name, f"{name} − std", f"{name} + std"], colors=[color] * 3, widths=[2.5, 0.7, 0.7]
        )

    def _show_depth(self, view: FrameView) -> None:
        rr, frame = self._rr, view.frame
        assert frame is not None
        if frame.camera != self._camera:
            self._camera = frame.camera
            self._stream.log("map/camera/image", self._pinhole(frame.camera), static=True)
        units = np.nan_to_num(np.clip(frame.depth * _DEPTH_UNITS_PER_METRE, 0, 65535)).astype(np.uint16)
        self._stream.log(
            "map/camera/image/depth",
            rr.DepthImage(units, meter=_DEPTH_UNITS_PER_METRE, colormap=rr.components.Colormap.Viridis),
        )
        pixels = frame.camera.project(view.camera_edges())
        self._stream.log(
            "map/camera/image/edges",
            rr.LineStrips2D(pixels[np.isfinite(pixels).all(axis=(1, 2))], colors=NOSING_COLOR, radii=2.0),
        )
        points = view.camera_points(max_points=MAX_FRAME_POINTS)
        points = points @ view.map_from_camera[:3, :3].T + view.map_from_camera[:3, 3]
        if self._is_map:
            points = self._cloud.add(points)
        self._log_cloud(points)

    def _pinhole(self, camera: PinholeCamera) -> Any:
        return self._rr.Pinhole(
            focal_length=[camera.fx, camera.fy],
            principal_point=[camera.cx, camera.cy],
            resolution=[camera.width, camera.height],
            camera_xyz=self._rr.ViewCoordinates.RDF,
            image_plane_distance=0.35,
        )

    def _log_cloud(self, points: Points) -> None:
        low = self._viewpoint.target[2] - 1.5
        colors = height_colors(points[:, 2], low, low + 3.5)
        self._stream.log("map/cloud", self._rr.Points3D(points, colors=colors, radii=0.008))

    def _log_static(self) -> None:
        rr = self._rr
        self._stream.send_recording_name(self._name)
        self._stream.log("map", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        if len(self._positions):
            way = rr.LineStrips3D([self._positions], colors=TRAJECTORY_COLOR, radii=0.01)
            self._stream.log("map/trajectory", way, static=True)
        for name in MEASURES:
            dots = rr.SeriesPoints(colors=(150, 150, 150), names="single frames", marker_sizes=2.0)
            self._stream.log(f"measures/{name}/single_frames", dots, static=True)

    def _set_time(self, number: int, stamp_ns: int) -> None:
        self._stream.set_time("frame", sequence=number)
        if stamp_ns > _FIRST_PLAUSIBLE_DATE_NS:
            self._stream.set_time("stamp", timestamp=np.datetime64(stamp_ns, "ns"))
        else:
            self._stream.set_time("stamp", duration=np.timedelta64(stamp_ns, "ns"))
