"""A flight of known size, seen by a camera of known pose, without any renderer of the package."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Transform
from stairmap.camera import PinholeCamera
from stairmap.detection.observation import Detection, DetectionTrace, StairEdge, StairObservation
from stairmap.frame import DepthFrame
from stairmap.stairway import Flight, FlightStd, Step
from stairmap.transforms import invert_transform, transform_from_parts, transform_points

CAMERA = PinholeCamera(width=320, height=240, fx=290.0, fy=290.0, cx=159.5, cy=119.5)
STD = FlightStd(rise=0.002, run=0.003, width=0.02, pitch=0.01, heading=0.01, base=[0.01, 0.01, 0.01])


@dataclass(frozen=True)
class View:
    """A frame of a flight with the observation a perfect detector makes of it."""

    frame: DepthFrame
    map_from_camera: Transform
    detection: Detection


def make_flight(**changes: object) -> Flight:
    values: dict[str, object] = {
        "base": np.array([3.0, 1.0, 0.0]),
        "heading": 0.6,
        "rise": 0.165,
        "run": 0.292,
        "width": 1.175,
        "num_risers": 9,
        "std": STD,
    }
    ideal = Flight(**{**values, **changes})
    steps = tuple(
        Step(nosing=nosing, num_observations=max(30 - 4 * i, 0)) for i, nosing in enumerate(ideal.edges())
    )
    return Flight(**{**values, "steps": steps, **changes})


def make_view(flight: Flight, *, distance: float, stamp_ns: int = 0, seed: int = 0) -> View:
    """Look at a flight from a camera 0.6 m high, level distance from the first riser in m."""
    forward = flight.forward
    right = np.array([forward[1], -forward[0], 0.0])
    down = np.array([0.0, 0.0, -1.0])
    tilt = 0.1
    axis_z = np.cos(tilt) * forward + np.sin(tilt) * down
    axis_y = np.cos(tilt) * down - np.sin(tilt) * forward
    position = flight.base - distance * forward + [0, 0, 0.6] + 0.15 * right
    map_from_camera = transform_from_parts(np.stack([right, axis_y, axis_z], axis=1), position)
    camera_from_map = invert_transform(map_from_camera)
    random = np.random.default_rng(seed)
    depth = ray_cast(flight, map_from_camera)
    depth = depth + random.normal(0, 1, depth.shape) * 0.0015 * depth**2
    depth[random.random(depth.shape) < 0.02] = np.nan
    nosings = transform_points(camera_from_map, flight.edges())
    pixels = CAMERA.project(nosings)
    seen = [i for i in range(flight.num_risers) if np.all((pixels[i] > 0) & (pixels[i] < [320, 240]))]
    edges = tuple(
        StairEdge(
            nosing=nosings[i] + random.normal(0, 0.006, (2, 3)),
            step_index=i,
            left_bounded=True,
            right_bounded=i % 4 != 3,
            cue="jump",
            num_pixels=100,
        )
        for i in seen
    )
    up = camera_from_map[:3, 2]
    observation = StairObservation(
        stamp_ns=stamp_ns, view="ascending", up=up, forward=camera_from_map[:3, :3] @ forward, edges=edges,
        rise=0.166, run=0.289, width=1.15, origin=np.zeros(3), covariance=np.zeros((0, 0)),
        points=np.concatenate([edge.nosing for edge in edges]),
    )  # fmt: skip
    lines = pixels[seen].reshape(-1, 4)
    mask = np.zeros(depth.shape, dtype=bool)
    jump = np.abs(np.diff(depth, axis=0)) > 0.1
    mask[:-1] = jump
    steep = np.zeros_like(mask)
    steep[40:80, 100:200] = True
    trace = DetectionTrace(
        edge_pixels=mask,
        candidate_lines=np.concatenate([lines, [[10.0, 20.0, 60.0, 90.0]]]),
        accepted_lines=lines,
        tread_pixels=np.roll(steep, 40, axis=0),
        riser_pixels=steep,
    )
    frame = DepthFrame(stamp_ns=stamp_ns, depth=depth, camera=CAMERA, up=up)
    detection = Detection(stamp_ns=stamp_ns, observations=(observation,), rejections=(), trace=trace)
    return View(frame=frame, map_from_camera=map_from_camera, detection=detection)


def ray_cast(flight: Flight, map_from_camera: Transform) -> np.ndarray:
    """Depth of the flight's surface, its upper floor, the floor and a wall, by Moeller-Trumbore."""
    vertices, triangles = flight.surface()
    corners = transform_points(invert_transform(map_from_camera), vertices)[triangles]
    low, big = flight.base[2], 20.0
    plates = []
    for z, start, end, half in (
        (low, -big, 0.0, big),
        (low, 0.0, big, big),
        (
            low + flight.num_risers * flight.rise,
            (flight.num_risers - 1) * flight.run,
            big,
            flight.width / 2,
        ),
    ):
        local = np.array(
            [[start, -half, z - low], [end, -half, z - low], [end, half, z - low], [start, half, z - low]]
        )
        plate = transform_points(flight.map_from_flight, local)
        plates += [plate[[0, 1, 2]], plate[[0, 2, 3]]]
    corners = np.concatenate([corners, transform_points(invert_transform(map_from_camera), np.array(plates))])
    rays = CAMERA.rays()
    depth = np.full(rays.shape[:2], np.inf)
    for a, b, c in corners:
        edge_1, edge_2 = b - a, c - a
        p = np.cross(rays, edge_2)
        det = p @ edge_1
        det = np.where(np.abs(det) < 1e-12, np.nan, det)
        u = (p @ -a) / det
        q = np.cross(-a, edge_1)
        v = rays @ q / det
        t = (edge_2 @ q) / det
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        depth = np.where(hit & (t < depth), t, depth)
    return np.where(depth < 8, depth, np.nan)
