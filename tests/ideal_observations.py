"""What a perfect detector would see of known flights, for tests of modeling."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from analytic_stairs import pose_looking
from stairmap.arrays import Float64Array, Transform
from stairmap.config import Config
from stairmap.detection.observation import StairEdge, StairObservation, View
from stairmap.modeling.mapper import StairwayMapper
from stairmap.stairway import Flight, FlightStd, Stairway
from stairmap.trajectory import Trajectory
from stairmap.transforms import invert_transform, rotation_from_vector, transform_points

MS = 1_000_000
NO_STD = FlightStd(rise=0, run=0, width=0, pitch=0, heading=0, base=np.zeros(3))


def make_flight(**changes: Any) -> Flight:
    """A flight up the map's +x from (2, 0, 0), with what is different about it."""
    values: dict[str, Any] = {
        "base": np.array([2.0, 0.0, 0.0]),
        "heading": 0.0,
        "rise": 0.17,
        "run": 0.28,
        "width": 1.2,
        "num_risers": 8,
        "std": NO_STD,
    }
    return Flight(**{**values, **changes})


def poses_before(flight: Flight, num: int, *, distance: float = 2.0) -> list[Transform]:
    """Poses of a camera 0.8 m above the foot that comes closer by 20 mm a frame, a little to the left."""
    left = flight.map_from_flight[:3, 1]
    poses = []
    for index in range(num):
        place = flight.base - (distance - 0.02 * index) * flight.forward + 0.1 * left + [0, 0, 0.8]
        poses.append(pose_looking(tuple(place), yaw=flight.heading - 0.05, down=0.15))
    return poses


def poses_above(flight: Flight, num: int) -> list[Transform]:
    """Poses of a camera on the upper floor that looks down the stairs."""
    top = flight.edges()[-1].mean(axis=0)
    place = top + 0.6 * flight.forward + [0, 0, 0.9]
    return [
        pose_looking(tuple(place - 0.01 * index * flight.forward), yaw=flight.heading + np.pi, down=0.6)
        for index in range(num)
    ]


def observe(
    flight: Flight,
    map_from_camera: Transform,
    stamp_ns: int,
    *,
    steps: Iterable[int] | None = None,
    view: View = "ascending",
    noise: float = 0.0,
    floor_seen: bool = False,
    top_seen: bool = False,
    bounded: bool = True,
    edge_std: tuple[float, float] = (float("nan"), float("nan")),
    overhang: tuple[float, float] = (0.0, float("nan")),
    raised: Mapping[int, float] | None = None,
) -> StairObservation:
    """The observation of some steps of a flight.

    ``noise`` is the standard deviation of each edge's and the origin's place, m; rise and run err by a
    fifth of it. ``edge_std`` (along, up) and ``overhang`` (value, std) are what the detector states, and
    ``raised`` says by how much some nosings lie higher than the lattice, m.
    """
    random = np.random.default_rng(stamp_ns)
    chosen = sorted(range(flight.num_risers) if steps is None else steps)
    camera_from_map = invert_transform(map_from_camera)
    axes = camera_from_map[:3, :3]
    nosings = flight.edges()
    for step, height in ({} if raised is None else raised).items():
        nosings[step, :, 2] += height
    ends = nosings[chosen] + random.normal(0, noise, (len(chosen), 1, 3)) * [1.0, 0.0, 1.0]
    ends = transform_points(camera_from_map, ends)
    origin = flight.edges()[chosen[0]].mean(axis=0) + random.normal(0, noise, 3)
    edges = tuple(
        StairEdge(
            nosing=nosing,
            step_index=step - chosen[0],
            left_bounded=bounded,
            right_bounded=bounded,
            cue="crease",
            num_pixels=300,
            std=edge_std,
        )
        for step, nosing in zip(chosen, ends, strict=True)
    )
    std = np.array([0.002, 0.002, 0.01, 0.01, 0.002, 0.01]) + noise * np.array([0.2, 0.2, 1, 1, 0, 0])
    return StairObservation(
        stamp_ns=stamp_ns,
        view=view,
        up=axes[:, 2],
        forward=axes @ flight.forward,
        edges=edges,
        rise=flight.rise + 0.2 * noise * random.normal(),
        run=flight.run + 0.2 * noise * random.normal(),
        width=flight.width,
        origin=transform_points(camera_from_map, origin),
        covariance=np.diag(std**2),
        floor_seen=floor_seen,
        top_seen=top_seen,
        overhang=overhang[0],
        overhang_std=overhang[1],
        points=ends.reshape(-1, 3),
    )


def observe_all(
    flight: Flight, poses: Sequence[Transform], *, first_stamp: int = 0, **how: Any
) -> list[StairObservation]:
    """One observation from each pose, 100 ms apart."""
    return [
        observe(flight, pose, (first_stamp + index) * 100 * MS, **how) for index, pose in enumerate(poses)
    ]


def trajectory_of(poses: Sequence[Transform] | Float64Array) -> Trajectory:
    """Poses 100 ms apart."""
    return Trajectory(
        stamps_ns=np.arange(len(poses)) * 100 * MS, map_from_camera=np.array(poses).reshape(-1, 4, 4)
    )


def mapper_of(observations: Iterable[StairObservation], config: Config | None = None) -> StairwayMapper:
    """A mapper that has taken in observations."""
    mapper = StairwayMapper(Config() if config is None else config)
    for observation in observations:
        mapper.add(observation)
    return mapper


def turned_map(yaw: float, shift: tuple[float, float, float]) -> Transform:
    """(4, 4) other_map_from_map: turned about z by ``yaw`` rad, then shifted, m."""
    transform = np.eye(4)
    transform[:3, :3] = rotation_from_vector([0.0, 0.0, yaw])
    transform[:3, 3] = shift
    return transform


def moved_flight(other_from_map: Transform, flight: Flight) -> Flight:
    """A flight in a map that is turned about z and shifted."""
    yaw = float(np.arctan2(other_from_map[1, 0], other_from_map[0, 0]))
    return make_flight(
        base=transform_points(other_from_map, flight.base),
        heading=flight.heading + yaw,
        rise=flight.rise,
        run=flight.run,
        width=flight.width,
        num_risers=flight.num_risers,
    )


def assert_is_flight(found: Flight, true: Flight, *, place: float = 0.005, step: float = 0.001) -> None:
    """Compare all measures of a flight: place and width within ``place`` m, rise and run within ``step``."""
    assert found.num_risers == true.num_risers
    assert abs(found.rise - true.rise) < step
    assert abs(found.run - true.run) < step
    assert abs(found.width - true.width) < place
    turn = (found.heading - true.heading + np.pi) % (2 * np.pi) - np.pi
    assert abs(turn) < 0.01
    assert np.abs(found.base - true.base).max() < place
    edges = np.array([item.nosing for item in found.steps])
    assert np.abs(edges - true.edges()).max() < 2 * place


def the_only(stairways: Sequence[Stairway]) -> Stairway:
    """The one stairway of a map."""
    assert len(stairways) == 1, [stairway.to_dict() for stairway in stairways]
    return stairways[0]
