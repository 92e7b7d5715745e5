"""What the detector makes of a few hard views, in numbers: who changes a limit on purpose writes them anew.

Frames have a sensor's noise and lean on limits that clean views never need: a post before the stairs, an up
that is off, sloping ground, few rows of far steps, treads seen through slabs, the ground's end beside a wall.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from analytic_stairs import AnalyticStairs, nosings, pose_looking
from drop_scenes import deep_well, dock, stairs_down
from solid_scenes import pose_towards, room, stairs_solid
from stairmap.arrays import Transform, Vector
from stairmap.config import Config
from stairmap.detection.detector import StairEdgeDetector
from stairmap.detection.observation import Detection
from stairmap.frame import DepthFrame
from stairmap.simulation.render import RayCaster
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_block, make_rectangle
from stairmap.transforms import rotation_from_vector

DETECTOR = StairEdgeDetector(Config())
STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=7)


def view(
    *solids: TriangleMesh,
    pose: Transform,
    sensor: str = "kinect_v2",
    seed: int = 0,
    tilt: tuple[float, float, float] = (0.0, 0.0, 0.0),
    up_std: float | None = None,
    has_up: bool = True,
) -> Detection:
    """Detection in one frame of a sensor, its up turned by ``tilt``, rad."""
    device = make_sensor(sensor, factor=0.5)
    rendering = RayCaster(joined(solids)).render(device.camera, pose)
    up: Vector | None = rotation_from_vector(tilt) @ pose[2, :3] if has_up else None
    depth = device.measure(rendering, np.random.default_rng(seed))
    frame = DepthFrame(stamp_ns=0, depth=depth, camera=device.camera, up=up, up_std=up_std)
    return DETECTOR.detect(frame, trace=True)


@cache
def behind_a_post() -> Detection:
    """Stairs from 25 degrees aside, a post before them and a box on them, with an up that is off."""
    post = make_block((-0.5, 0.15, 0.0), (-0.4, 0.3, 2.0))
    box = make_block((0.35, -0.4, 0.34), (0.55, -0.1, 0.6))
    pose = pose_towards((0.7, 0.1, 0.5), distance=2.0, height=1.2, azimuth=0.44, roll=0.15)
    return view(
        stairs_solid(STAIRS, overhang=0.02), room(aside=1.4), post, box,
        pose=pose, tilt=(0.03, -0.01, 0.02), sensor="d435",
    )  # fmt: skip


@cache
def far_steps() -> Detection:
    """Low steps of which few rows show, without an up."""
    stairs = AnalyticStairs(rise=0.15, run=0.32, width=2.0, num_risers=6)
    pose = pose_towards((0.9, 0.0, 0.5), distance=2.9, height=1.1, turn=0.08)
    return view(stairs_solid(stairs), room(ahead=3.4), pose=pose, seed=1, has_up=False)


@cache
def slabs() -> Detection:
    """Stairs without risers before a wall."""
    boards = [
        make_block((0.28 * k - 0.02, -0.6, 0.18 * (k + 1) - 0.045), (0.28 * (k + 1), 0.6, 0.18 * (k + 1)))
        for k in range(6)
    ]
    pose = pose_towards((0.6, 0.0, 0.5), distance=1.6, height=0.9, azimuth=-0.1)
    return view(*boards, room(ahead=3.2), pose=pose, seed=2, up_std=0.01)


@cache
def down_the_stairs() -> Detection:
    """From the upper floor, before the edge, with a phone."""
    pose = pose_looking((-0.75, 0.1, 1.3), yaw=0.06, down=0.66)
    return view(stairs_down(9), pose=pose, sensor="phone_lidar", seed=3)


@cache
def two_flights() -> Detection:
    """A flight, a lower and narrower one beside it, and a turned wall."""
    other = AnalyticStairs(rise=0.14, run=0.34, width=0.8, num_risers=4)
    shift = np.eye(4)
    shift[:3, :3] = rotation_from_vector([0.0, 0.0, 0.5])
    shift[:3, 3] = (0.1, -1.75, 0.0)
    pose = pose_towards((0.6, -0.8, 0.3), distance=2.3, height=1.3, azimuth=0.05)
    return view(
        stairs_solid(STAIRS), stairs_solid(other).transformed(shift), room(aside=3.0), pose=pose, seed=4
    )


@cache
def sloping_ground() -> Detection:
    """Stairs on ground that climbs with them by 3 %, with an up that is known well."""
    slope = np.eye(4)
    slope[:3, :3] = rotation_from_vector([0.01, -0.03, 0.0])
    pose = pose_towards((0.6, 0.0, 0.4), distance=1.7, height=1.0, azimuth=-0.2)
    solids = joined([stairs_solid(STAIRS), make_rectangle((-9, -9), (9, 9), 0.0)]).transformed(slope)
    return view(solids, pose=pose, seed=5, up_std=np.radians(0.4), tilt=(0.004, 0.0, 0.002))


@cache
def ground_that_ends() -> Detection:
    """A dock aside of a low wall, seen aslant."""
    wall = make_block((-3.0, 0.7, 0.0), (0.0, 0.8, 0.4))
    pose = pose_looking((-1.3, -0.2, 0.7), yaw=0.25, down=0.4, roll=0.05)
    return view(dock(0.35), wall, pose=pose, seed=6, sensor="d435", tilt=(0.01, 0.0, 0.01))


@cache
def ground_before_nothing() -> Detection:
    """A well so deep that nothing comes back."""
    return view(deep_well(), pose=pose_looking((-1.2, 0.3, 0.9), yaw=-0.1, down=0.45), seed=7)


@cache
def shelves() -> Detection:
    """Boards with gaps as large as steps, which are no stairs."""
    boards = [
        make_block((0.28 * k, -0.6, 0.19 * k + 0.14), (0.28 * k + 0.1, 0.6, 0.19 * (k + 1))) for k in range(6)
    ]
    return view(*boards, room(), pose=pose_towards((0.6, 0.0, 0.5), distance=1.7, height=1.5), seed=8)


@cache
def down_to_a_floor() -> Detection:
    """From above the last step, rolled, with an up that is unsure."""
    top = nosings(STAIRS)[-1].mean(axis=0)
    pose = pose_looking((top[0] + 0.5, 0.2, top[2] + 1.1), yaw=np.pi - 0.15, down=0.75)
    floor = make_rectangle((-9, -9), (9, 9), 0.0)
    return view(stairs_solid(STAIRS), floor, pose=pose, seed=9, tilt=(-0.02, 0.0, 0.015))


def numbers(detection: Detection) -> list[list[float]]:
    """Lengths, mm, directions, thousandths, tens of steps and of what is so, and counts of rays."""
    rows = []
    for seen in detection.observations:
        std = 1e3 * np.sqrt(np.diag(seen.covariance))
        first, last = seen.edges[0], seen.edges[-1]
        lengths = [seen.rise, seen.run, seen.width, seen.overhang, seen.overhang_std]
        places = [*seen.origin, *first.nosing.ravel(), *last.nosing.ravel(), *first.std, *last.std]
        rows.append(
            [
                *(1e3 * np.array([*lengths, *places, *seen.up, *seen.forward])), *std,
                seen.covariance[0, 1] * 1e6, seen.covariance[1, 2] * 1e6, seen.covariance[0, 3] * 1e6,
                1e-3 * seen.rise_information[0, 0], 1e-3 * seen.rise_information[1, 1],
            ]
        )  # fmt: skip
        rows.append(
            [
                10 * len(seen.edges), 10 * seen.num_steps,
                10 * seen.floor_seen, 10 * seen.top_seen, 10 * (seen.view == "ascending"),
                *(edge.num_pixels / 16 for edge in seen.edges),
                *(10 * edge.left_bounded + 20 * edge.right_bounded for edge in seen.edges),
                *(10 * (edge.cue == "crease") for edge in seen.edges),
            ]
        )  # fmt: skip
    rows += [[1e3 * rule.measured, 1e3 * rule.limit] for rule in detection.rejections]
    if detection.ground is not None:
        ground = detection.ground
        rows.append([1e3 * ground.height, *(1e3 * ground.up), *(1e3 * ground.forward)])
        rows.append([ground.is_seen.sum(), *ground.is_seen.sum(axis=0)[4:26:3], len(ground.bearing)])
    for drop in (*detection.drops, *detection.voids):
        depth = -1.0 if np.isnan(drop.depth) else 1e3 * drop.depth
        rows.append([*(1e3 * drop.edge.ravel()), depth, 1e3 * drop.distance])
        rows.append([drop.num_rays])
    trace = detection.trace
    assert trace is not None
    rows.append(
        [
            *(mask.sum() / 100 for mask in (trace.edge_pixels, trace.tread_pixels, trace.riser_pixels)),
            10 * len(trace.candidate_lines), 10 * len(trace.accepted_lines),
            *trace.candidate_lines.mean(axis=0),
        ]
        if len(trace.candidate_lines)
        else [0.0]
    )  # fmt: skip
    return [[float(value) for value in row] for row in rows]


VIEWS: tuple[Callable[[], Detection], ...] = (
    behind_a_post, far_steps, slabs, down_the_stairs, two_flights, sloping_ground, ground_that_ends,
    ground_before_nothing, shelves, down_to_a_floor,
)  # fmt: skip
VALUES = Path(__file__).with_name("view_values.json")
"""What each view gave; ``PYTHONPATH=src:tests python tests/detection/test_view_values.py`` writes it anew."""


@pytest.mark.parametrize("make", VIEWS, ids=lambda make: make.__name__)
def test_a_hard_view_gives_the_numbers_it_gave(make: Callable[[], Detection]) -> None:
    found, expected = numbers(make()), json.loads(VALUES.read_text())[make.__name__]
    assert [len(row) for row in found] == [len(row) for row in expected]
    for row, values in zip(found, expected, strict=True):
        # On another machine a ray or two may fall on the other side of a limit.
        is_count = all(value == round(value) for value in values)
        np.testing.assert_allclose(row, values, rtol=3e-3, atol=1.01 if is_count else 0.3)


def write_values() -> None:
    """Keep what the views give now."""
    values = {
        make.__name__: [[float(f"{value:.5g}") for value in row] for row in numbers(make())] for make in VIEWS
    }
    lines = [
        f' "{name}": [\n' + ",\n".join(f"  {json.dumps(row)}" for row in rows) + "\n ]"
        for name, rows in values.items()
    ]
    VALUES.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    write_values()
