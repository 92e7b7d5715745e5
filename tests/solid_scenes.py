"""Exact frames of stairs and other solids, for tests of the default method."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, nosings, pose_looking
from stairmap.arrays import Float64Array, Transform
from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame
from stairmap.simulation.render import RayCaster
from stairmap.simulation.triangle_mesh import (
    TriangleMesh,
    joined,
    make_block,
    make_prism,
    make_rectangle,
    make_wall,
)
from stairmap.transforms import invert_transform, transform_points

MAX_DEPTH = 10.0
FLOOR = make_rectangle((-15, -15), (15, 15), 0.0)


def stairs_solid(stairs: AnalyticStairs, *, overhang: float = 0.0, rake: float = 0.0) -> TriangleMesh:
    """Solid steps of a staircase without the floor; nosings stand before their risers by ``overhang``
    m, or risers lean back to the foot by ``rake`` m. The landing is 1.5 m long."""
    parts = []
    for low, high in stairs.boxes():
        x, z = low[0], high[2]
        foot = z - stairs.rise
        back = high[0]
        profile = [(x + rake, foot - 2.0), (back, foot - 2.0), (back, z), (x, z), (x + rake, foot)]
        if overhang > 0:
            profile = [(x + overhang, foot - 2.0), (back, foot - 2.0), (back, z), (x + overhang, z)]
            parts.append(make_block([x, low[1], z - 0.04], [x + overhang, high[1], z]))
        parts.append(make_prism(profile, low[1], high[1]))
    return joined(parts).transformed(stairs.map_from_flight())


def room(*, ahead: float = 5.5, aside: float = 4.0, height: float = 5.0) -> TriangleMesh:
    """Floor, side walls and the wall ahead of a room about the map's origin, m."""
    return joined(
        [
            make_rectangle((-6, -aside), (ahead, aside), 0.0),
            make_wall((ahead, -aside), (ahead, aside), 0.0, height),
            make_wall((-6, aside), (ahead, aside), 0.0, height),
            make_wall((-6, -aside), (ahead, -aside), 0.0, height),
        ]
    )


def frame_of(
    solids: Iterable[TriangleMesh],
    map_from_camera: Transform,
    *,
    camera: PinholeCamera = KINECT_CAMERA,
    stamp_ns: int = 0,
    has_up: bool = True,
) -> DepthFrame:
    """What a perfect camera sees up to 10 m; ``up`` is the true one, or none."""
    depth = RayCaster(joined(solids)).render(camera, map_from_camera).depth
    depth[~(depth < MAX_DEPTH)] = np.nan
    return DepthFrame(
        stamp_ns=stamp_ns,
        depth=depth.astype(np.float32),
        camera=camera,
        up=map_from_camera[2, :3] if has_up else None,
    )


def pose_towards(
    target: tuple[float, float, float],
    *,
    distance: float,
    height: float,
    azimuth: float = 0.0,
    roll: float = 0.0,
    turn: float = 0.0,
) -> Transform:
    """(4, 4) map_from_camera of a camera before the map's origin that looks at a point.

    It stands at a level distance from the origin, m, ``azimuth`` rad to the left of the -x axis, and is
    turned away from the point by ``turn`` rad.
    """
    position = (-distance * np.cos(azimuth), distance * np.sin(azimuth), height)
    sight = np.array(target) - position
    yaw = float(np.arctan2(sight[1], sight[0])) + turn
    down = float(np.arctan2(-sight[2], np.hypot(sight[0], sight[1])))
    return pose_looking(position, yaw=yaw, down=down, roll=roll)


def share_in_view(
    stairs: AnalyticStairs, map_from_camera: Transform, camera: PinholeCamera = KINECT_CAMERA
) -> Float64Array:
    """(num_risers,) share of each nosing that lies in the image and within the detector's 6 m of depth."""
    share = np.linspace(0.02, 0.98, 41)[:, None]
    ends = nosings(stairs)[:, :, None]
    points = ends[:, 0] * (1 - share) + ends[:, 1] * share
    in_camera = transform_points(invert_transform(map_from_camera), points)
    with np.errstate(invalid="ignore"):
        u, v = np.moveaxis(camera.project(in_camera), -1, 0)
        inside = (u > 0) & (u < camera.width - 1) & (v > 0) & (v < camera.height - 1)
    return np.asarray((inside & (in_camera[..., 2] < 6.0)).mean(axis=1))
