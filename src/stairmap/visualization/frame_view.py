"""One frame as viewers show it: depth, pose, the stair edges seen in it, or why there are none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Points, Transform, Vector
from stairmap.detection.observation import Detection, Rejection
from stairmap.export.loading import SavedObservation
from stairmap.frame import DepthFrame
from stairmap.transforms import transform_from_parts, transform_points


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameView:
    """One frame as viewers show it.

    Attributes
    ----------
    number
        Its number, from 0.
    stamp_ns
        When it was taken, in nanoseconds.
    map_from_camera
        (4, 4) pose of the camera's optical coordinate frame.
    observations
        What was seen, edges in the camera frame.
    rejections
        Why something was not accepted.
    frame
        The depth image; ``None`` where the recording is not at hand.
    """

    number: int
    stamp_ns: int
    map_from_camera: Transform
    observations: tuple[SavedObservation, ...]
    rejections: tuple[Rejection, ...]
    frame: DepthFrame | None = None

    def camera_edges(self) -> Points:
        """Return the (N, 2, 3) stair edges of all observations, camera frame, m."""
        return np.concatenate([np.empty((0, 2, 3)), *(seen.edges for seen in self.observations)])

    def map_edges(self) -> Points:
        """Return the (N, 2, 3) stair edges of all observations, map, m."""
        return transform_points(self.map_from_camera, self.camera_edges())

    def camera_points(self, *, max_points: int) -> Points:
        """Return at most about so many (N, 3) points of the depth image, evenly spread, camera frame, m."""
        if self.frame is None:
            return np.empty((0, 3))
        stride = max(int(np.ceil(np.sqrt(self.frame.depth.size / max_points))), 1)
        depth = self.frame.depth[::stride, ::stride]
        points = self.frame.camera.strided(stride).unproject(depth)
        return points[np.isfinite(depth)]

    def describe(self) -> str:
        """Return one line: what was seen, or the reasons against."""
        parts = [
            f"{seen.view}, {seen.num_steps} steps, rise {seen.rise * 1e3:.0f} mm, "
            f"run {seen.run * 1e3:.0f} mm, width {seen.width * 1e3:.0f} mm"
            for seen in self.observations
        ]
        if not parts:
            parts = ["no stairs", *(str(rejection) for rejection in self.rejections)]
        return f"frame {self.number}: {'; '.join(parts)}"


def frame_view_from_detection(
    number: int, frame: DepthFrame, map_from_camera: Transform, detection: Detection
) -> FrameView:
    """Return the view of a frame that was just looked at."""
    observations = tuple(
        SavedObservation(
            view=seen.view,
            rise=seen.rise,
            run=seen.run,
            width=seen.width,
            num_steps=seen.num_steps,
            edges=np.array([edge.nosing for edge in seen.edges]),
        )
        for seen in detection.observations
    )
    return FrameView(
        number=number,
        stamp_ns=frame.stamp_ns,
        map_from_camera=map_from_camera,
        observations=observations,
        rejections=detection.rejections,
        frame=frame,
    )


def level_from_camera(up: Vector | None) -> Transform:
    """Return the (4, 4) turn into a level coordinate frame at the camera: x where it looks, z up.

    Parameters
    ----------
    up
        (3,) direction opposite to gravity, camera frame; without it the camera is taken to be level.
    """
    z = np.array([0.0, -1.0, 0.0]) if up is None else np.asarray(up, dtype=np.float64)
    z = z / np.linalg.norm(z)
    # A camera that looks straight up or down has no level viewing direction; its image's top has one.
    looking = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < 0.999 else np.array([0.0, -1.0, 0.0])
    x = looking - (looking @ z) * z
    x = x / np.linalg.norm(x)
    return transform_from_parts(np.stack([x, np.cross(z, x), z]), np.zeros(3))
