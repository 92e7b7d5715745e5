"""Tasks of the benchmark: a frame, a drive or a map, generated from a seed, with its truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from stairmap.camera import PinholeCamera
from stairmap.output_files import write_whole
from stairmap.recordings.depth_png import encode_depth_png
from stairmap.simulation.finished_maps import MAP_KINDS, MIN_RETURNS, FinishedMap
from stairmap.simulation.odometry import PERFECT_ODOMETRY
from stairmap.simulation.recording import DEPTH_SCALE, write_simulation
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scene import Scene
from stairmap.simulation.scenes import SCENE_GROUPS, make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.simulate import Simulation
from stairmap.simulation.visibility import measure_visibility
from stairmap.stairway import Flight

TaskKind = Literal["frame", "drive", "cloud"]

KINDS: tuple[TaskKind, ...] = ("frame", "drive", "cloud")

STAIRS = (*SCENE_GROUPS["stairs"], *SCENE_GROUPS["table1"])
LOOK_ALIKES = SCENE_GROUPS["look-alikes"]

LOOK_ALIKE_SHARE = 3
"""Each N-th task shows no stairs, only what looks like some."""

SENSOR_NAMES = ("kinect_v1", "kinect_v2", "d435", "phone_lidar")
ROBOT_NAMES = ("turtlebot", "packbot", "spot", "go2", "humanoid")

SENSOR_FACTOR = 0.5
"""Frames have this part of the sensors' rows and columns: 320x240, as most methods of the field use."""

FRAME_STEPS = 3
"""A flight must be found where a frame, or a drive, shows this many of its nosings ..."""

NEAR = 3.5
"""... from a distance of no more, m: what depth cameras of the field resolve."""

SEEN_SHARE = 0.7
"""A flight must be found in a map when the scanner saw this share of its steps."""

NUM_DRIVE_FRAMES = 40
"""Frames of a drive."""

NUM_FRAME_CHOICES = 8
"""A single frame is one of this many of a drive, evenly spread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueFlight:
    """A flight that is there, in the map, and whether it must be found or only may be."""

    flight: Flight
    must_be_found: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What a program is asked, and the truth, which it is not told.

    Attributes
    ----------
    kind
        ``frame``, ``drive`` or ``cloud``.
    name
        Scene, sensor and number.
    request
        JSON types, a line of the protocol.
    truth
        The flights that are there.
    """

    kind: TaskKind
    name: str
    request: dict[str, Any]
    truth: tuple[TrueFlight, ...]


def make_tasks(kind: TaskKind, number: int, *, seed: int, folder: Path) -> Iterator[Task]:
    """Generate tasks, one after the other; the same seed gives the same tasks, bit for bit.

    Parameters
    ----------
    kind, number
        Which, and how many.
    seed
        Of all.
    folder
        Where their files go.

    Raises
    ------
    MissingPackageError
        Without the extra ``sim``.
    """
    make = {"frame": _make_frame, "drive": _make_drive, "cloud": _make_cloud}[kind]
    for index in range(number):
        random = np.random.default_rng([seed, KINDS.index(kind), index])
        names = LOOK_ALIKES if index % LOOK_ALIKE_SHARE == LOOK_ALIKE_SHARE - 1 else STAIRS
        name = names[int(random.integers(len(names)))]
        scene = make_scene(name, int(random.integers(2**31)))
        yield make(scene, random, folder / f"{kind}{index:04d}")


def _make_frame(scene: Scene, random: np.random.Generator, folder: Path) -> Task:
    simulation, sensor_name = _make_simulation(scene, random)
    number = int(random.integers(len(simulation)))
    found = next(frame for index, frame in enumerate(simulation.frames()) if index == number)
    folder.mkdir(parents=True)
    path = write_whole(folder / "depth.png", encode_depth_png(found.frame.depth, DEPTH_SCALE))
    pose = found.map_from_camera_true
    request = {
        "task": "frame",
        "depth": str(path.resolve()),
        "depth_scale": DEPTH_SCALE,
        "camera": _camera_values(found.frame.camera),
        "map_from_camera": pose.tolist(),
    }
    truth = _seen_flights(simulation, pose[None])
    return Task(kind="frame", name=f"{scene.name} {sensor_name} {folder.name}", request=request, truth=truth)


def _make_drive(scene: Scene, random: np.random.Generator, folder: Path) -> Task:
    sensor_name, robot, seed = _draw(random)
    sensor = make_sensor(sensor_name, factor=SENSOR_FACTOR)
    write_simulation(
        folder, scene, sensor, robot, seed=seed, num_frames=NUM_DRIVE_FRAMES, odometry=PERFECT_ODOMETRY
    )
    # Truth must not lie where a program may read it.
    for name in ("truth.json", "groundtruth_true.tum"):
        (folder / name).unlink()
    simulation = Simulation(
        scene, sensor, robot, seed=seed, num_frames=NUM_DRIVE_FRAMES, odometry=PERFECT_ODOMETRY
    )
    request = {"task": "drive", "recording": str(folder.resolve())}
    truth = _seen_flights(simulation, simulation.true_poses)
    return Task(kind="drive", name=f"{scene.name} {sensor_name} {folder.name}", request=request, truth=truth)


def _make_cloud(scene: Scene, random: np.random.Generator, folder: Path) -> Task:
    kind = MAP_KINDS["scanner_3mm"]
    finished = FinishedMap(scene, kind, seed=int(random.integers(2**31)))
    returns = [np.zeros(flight.num_risers, dtype=np.int64) for flight in finished.flights]
    points = []
    for part in finished.parts():
        points.append(part.points)
        returns = [total + found for total, found in zip(returns, part.returns, strict=True)]
    folder.mkdir(parents=True)
    cloud = np.concatenate(points).astype("<f4")
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(cloud)}\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n"
    )
    path = write_whole(folder / "map.ply", header.encode() + cloud.tobytes())
    num_asked = sum(len(stairway.flights) for stairway in scene.stairways)
    truth = tuple(
        TrueFlight(
            flight=flight,
            must_be_found=index < num_asked and float((counts >= MIN_RETURNS).mean()) >= SEEN_SHARE,
        )
        for index, (flight, counts) in enumerate(zip(finished.flights, returns, strict=True))
    )
    request = {"task": "cloud", "cloud": str(path.resolve())}
    return Task(kind="cloud", name=f"{scene.name} {kind.name} {folder.name}", request=request, truth=truth)


def _make_simulation(scene: Scene, random: np.random.Generator) -> tuple[Simulation, str]:
    sensor_name, robot, seed = _draw(random)
    sensor = make_sensor(sensor_name, factor=SENSOR_FACTOR)
    drive = Simulation(
        scene, sensor, robot, seed=seed, num_frames=NUM_FRAME_CHOICES, odometry=PERFECT_ODOMETRY
    )
    return drive, sensor_name


def _draw(random: np.random.Generator) -> tuple[str, Any, int]:
    sensor_name = SENSOR_NAMES[int(random.integers(len(SENSOR_NAMES)))]
    robot = ROBOTS[ROBOT_NAMES[int(random.integers(len(ROBOT_NAMES)))]]
    return sensor_name, robot, int(random.integers(2**31))


def _seen_flights(simulation: Simulation, poses: Any) -> tuple[TrueFlight, ...]:
    scene, sensor = simulation.scene, simulation.sensor
    flights = []
    for is_optional, stairways in ((False, scene.stairways), (True, scene.optional_stairways)):
        for flight in (flight for stairway in stairways for flight in stairway.flights):
            seen = measure_visibility(flight, simulation.caster, sensor.camera, poses, sensor.max_depth)
            must = seen.num_frames_within(NEAR, float(np.radians(60)), min_nosings=FRAME_STEPS) > 0
            flights.append(TrueFlight(flight=flight, must_be_found=must and not is_optional))
    return tuple(flights)


def _camera_values(camera: PinholeCamera) -> dict[str, float]:
    return {name: getattr(camera, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
