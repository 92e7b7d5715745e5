"""Robots as a camera sees them: height, tilt and shake of the body, and drives along a route."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Transform
from stairmap.simulation.scene import Route
from stairmap.transforms import rotation_from_vector, transform_from_parts

FRAME_PERIOD_NS = 100_000_000
"""Frames come at 10 Hz, so that poses are never farther apart than the gap that is interpolated."""

OPTICAL_FROM_BODY_AXES = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Columns: x, y, z of the optical frame in a body frame of x forward, y left, z up (REP 103)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """A platform.

    Attributes
    ----------
    name
        What ``--robot`` calls it.
    camera_height
        Of the camera above the floor, m.
    camera_pitch
        How far the camera looks down, rad.
    speed, turn_rate
        Usual speeds, m/s and rad/s.
    sway
        Amplitude of the heading's swing about the path, rad.
    pitch_swing, roll_swing
        Amplitude of the body's pitch and roll, rad.
    bounce
        Amplitude of the body's height, m.
    gait
        Frequency of the swing, Hz.
    """

    name: str
    camera_height: float
    camera_pitch: float
    speed: float = 0.5
    turn_rate: float = 0.8
    sway: float = 0.0
    pitch_swing: float = 0.0
    roll_swing: float = 0.0
    bounce: float = 0.0
    gait: float = 1.0

    @property
    def body_from_camera(self) -> Transform:
        """(4, 4) camera in the body frame: on the floor below the camera, x forward, z up."""
        tilt = rotation_from_vector([0.0, self.camera_pitch, 0.0])
        return transform_from_parts(tilt @ OPTICAL_FROM_BODY_AXES, [0.0, 0.0, self.camera_height])


ROBOTS: dict[str, Robot] = {
    robot.name: robot
    for robot in (
        Robot(
            name="turtlebot", camera_height=0.30, camera_pitch=np.radians(0), sway=np.radians(1.0),
            pitch_swing=np.radians(0.3), roll_swing=np.radians(0.3), bounce=0.001, gait=0.9,
        ),
        Robot(
            name="packbot", camera_height=0.45, camera_pitch=np.radians(0), sway=np.radians(2.0),
            pitch_swing=np.radians(1.0), roll_swing=np.radians(0.7), bounce=0.003, gait=1.3,
        ),
        Robot(
            name="spot", camera_height=0.60, camera_pitch=np.radians(12), speed=0.7, sway=np.radians(2.0),
            pitch_swing=np.radians(1.5), roll_swing=np.radians(1.5), bounce=0.010, gait=1.7,
        ),
        Robot(
            name="go2", camera_height=0.35, camera_pitch=np.radians(8), speed=0.6, sway=np.radians(2.5),
            pitch_swing=np.radians(2.0), roll_swing=np.radians(2.0), bounce=0.012, gait=2.3,
        ),
        Robot(
            name="humanoid", camera_height=1.30, camera_pitch=np.radians(28), sway=np.radians(3.0),
            pitch_swing=np.radians(2.0), roll_swing=np.radians(2.5), bounce=0.020, gait=0.8,
        ),
    )
}  # fmt: skip
"""Every robot by the name that ``--robot`` takes. Camera heights from the project's issue; tilts and
swings are ours: wheels shake little, tracks more, legs most; low cameras look level, high ones down."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """Where a robot's body was.

    Attributes
    ----------
    stamps_ns
        (N,) stamps, 0.1 s apart.
    planar
        (N, 4) x, y, height of the floor below (m) and heading (rad): what odometry estimates.
    attitude
        (N, 3) roll, pitch (rad; pitch positive nose down) and bounce (m) of the body.
    """

    stamps_ns: IntArray
    planar: Float64Array
    attitude: Float64Array

    def __len__(self) -> int:
        return len(self.stamps_ns)


def drive_route(
    route: Route, robot: Robot, *, random: np.random.Generator, num_frames: int | None = None
) -> Drive:
    """Drive along a route.

    Parameters
    ----------
    route
        Waypoints and turns.
    robot
        Its speeds and swings.
    random
        Draws the phases of the swings.
    num_frames
        Number of frames spread evenly over the drive's time; ``None``: 10 Hz at the robot's
        usual speed. Stamps are 0.1 s apart either way, so fewer frames mean a faster robot.
    """
    times, path = _plan(route, robot)
    if num_frames is None:
        num_frames = int(times[-1] * 1e9 / FRAME_PERIOD_NS) + 1
    if num_frames < 2:
        raise ValueError(f"a drive needs at least two frames, got {num_frames}")
    wanted = np.linspace(0, times[-1], num_frames)
    planar = np.stack([np.interp(wanted, times, path[:, column]) for column in range(4)], axis=1)
    seconds = np.arange(num_frames) * FRAME_PERIOD_NS * 1e-9
    phases = random.uniform(0, 2 * np.pi, 4)
    swings = np.sin(2 * np.pi * robot.gait * seconds[:, None] * [0.5, 0.5, 1.0, 1.0] + phases)
    planar[:, 3] += robot.sway * swings[:, 0]
    attitude = swings[:, 1:] * [robot.roll_swing, robot.pitch_swing, robot.bounce]
    return Drive(
        stamps_ns=np.arange(num_frames, dtype=np.int64) * FRAME_PERIOD_NS, planar=planar, attitude=attitude
    )


def camera_poses(planar: Float64Array, attitude: Float64Array, robot: Robot) -> Float64Array:
    """Return the (N, 4, 4) ``map_from_camera`` of bodies at (N, 4) ``planar`` and (N, 3) ``attitude``."""
    poses = np.empty((len(planar), 4, 4))
    for index, ((x, y, z, heading), (roll, pitch, bounce)) in enumerate(zip(planar, attitude, strict=True)):
        rotation = (
            rotation_from_vector([0, 0, heading])
            @ rotation_from_vector([0, pitch, 0])
            @ rotation_from_vector([roll, 0, 0])
        )
        map_from_body = transform_from_parts(rotation, [x, y, z + bounce])
        poses[index] = map_from_body @ robot.body_from_camera
    return poses


def _plan(route: Route, robot: Robot) -> tuple[Float64Array, Float64Array]:
    """Return (K,) times in s and (K, 4) x, y, z, heading at the ends of straight legs and turns."""
    times, states = [], []
    legs = np.diff(route.waypoints[:, :2], axis=0)
    headings = list(np.arctan2(legs[:, 1], legs[:, 0]))
    heading = headings[0] if route.first_heading is None else route.first_heading
    clock = 0.0

    def add(point: Float64Array, duration: float) -> None:
        nonlocal clock
        # Two states at one time would make the interpolation ambiguous.
        clock += max(duration, 1e-9)
        times.append(clock)
        states.append([*point, heading])

    def turn_to(point: Float64Array, wanted: float) -> None:
        nonlocal heading
        turn = (wanted - heading + np.pi) % (2 * np.pi) - np.pi
        heading += turn
        add(point, abs(turn) / robot.turn_rate)

    add(route.waypoints[0], 0.0)
    for index, leg_heading in enumerate(headings):
        turn_to(route.waypoints[index], leg_heading)
        add(route.waypoints[index + 1], float(np.linalg.norm(legs[index])) / robot.speed)
    if route.last_heading is not None:
        turn_to(route.waypoints[-1], route.last_heading)
    if route.last_pause > 0:
        add(route.waypoints[-1], route.last_pause)
    return np.array(times) - times[0], np.array(states)
