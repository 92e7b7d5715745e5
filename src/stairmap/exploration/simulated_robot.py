"""A robot in a simulated world: it drives, turns, climbs riser by riser, and looks.

It moves as it is told, whether that is wise or not: what it runs into and where it falls is counted.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace

import numpy as np

from stairmap.arrays import Float64Array, Transform, Vector
from stairmap.exploration.body import Body
from stairmap.exploration.odometry import Planar, RunningOdometry
from stairmap.exploration.state_file import State
from stairmap.exploration.world import DOWN, MIN_SUPPORT, World
from stairmap.frame import DepthFrame
from stairmap.simulation.odometry import OdometryModel
from stairmap.simulation.robots import camera_poses
from stairmap.simulation.sensors import Sensor

MICRO_STEP = 0.05
"""The world is asked so often on the way, m."""

LEG_REACH = 0.35
"""How far up or down feet feel for the next step, m."""

SAFE_SUPPORT = 0.6
"""Share of the footprint that must have ground below it before the robot goes on by itself."""

SENSED_ROOM = 0.02
"""The sensors about the body stop it so far before a surface, m."""

LOOK_TILT = math.radians(35)
"""How far the camera looks down at least when the robot tilts its body at an edge, rad."""

FRAME_TIME = 0.1
"""Time that a frame takes, s."""

STAIR_BODY_BOTTOM = 0.40
"""On stairs the body is held this high above the step below its middle, m."""


@dataclass(slots=True, kw_only=True)
class Counters:
    """What happened to the robot: falls, collisions, stops by its own sensors, way (m) and time (s)."""

    falls: int = 0
    sensor_stops: int = 0
    collisions: int = 0
    path_m: float = 0.0
    time_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """A frame with what the robot knows of where it was taken.

    Attributes
    ----------
    frame
        Depth image.
    odometry
        Where odometry believes the robot to be.
    body_from_camera
        (4, 4) camera in the level body frame: on the ground below the robot, x ahead, z up; with the tilt
        that the IMU measured.
    """

    frame: DepthFrame
    odometry: Planar
    body_from_camera: Transform


class SimulatedRobot:
    """A robot that does what it is told.

    Parameters
    ----------
    world
        Where.
    body
        What it is.
    sensor
        Its depth camera while driving; see ``look`` for a finer one.
    start
        Where it begins; x, y, z of the ground, heading.
    seed
        Seed of odometry, sensor and gait.
    model
        Error of its odometry.
    """

    def __init__(
        self, world: World, body: Body, sensor: Sensor, start: Planar, *, seed: int, model: OdometryModel
    ) -> None:
        self.world, self.body, self.sensor = world, body, sensor
        self.pose = start
        self.counters = Counters()
        odometry_seed, sensor_seed, gait_seed = np.random.SeedSequence([seed, 15]).spawn(3)
        self.odometry = RunningOdometry(start, model, np.random.default_rng(odometry_seed))
        self._random = np.random.default_rng(sensor_seed)
        self._phases = np.random.default_rng(gait_seed).uniform(0, 2 * math.pi, 3)
        self._num_frames, self._asked_s = 0, 0.0
        self.true_poses: list[Transform] = []

    def state(self) -> State:
        """Return where it is, what happened to it and where its draws are, to go on from."""
        return {
            "pose": self.pose.to_row(),
            "counters": asdict(self.counters),
            "odometry": self.odometry.state(),
            "random": self._random.bit_generator.state,
            "num_frames": self._num_frames,
            "asked_s": self._asked_s,
            "true_poses": np.array(self.true_poses).reshape(-1, 4, 4),
        }

    def restore(self, state: State) -> None:
        """Go on from a state of a robot with the same body, world and seed.

        Raises
        ------
        ValueError, TypeError
            If it is none.
        """
        self.pose = Planar.from_row(state["pose"])
        self.counters = Counters(**state["counters"])
        self.odometry.restore(state["odometry"])
        self._random.bit_generator.state = state["random"]
        self._num_frames, self._asked_s = int(state["num_frames"]), float(state["asked_s"])
        self.true_poses = list(np.array(state["true_poses"], dtype=np.float64).reshape(-1, 4, 4))

    def turn(self, angle: float) -> None:
        """Turn on the spot, rad, counter-clockwise."""
        self.pose = replace(self.pose, heading=self.pose.heading + angle)
        self.odometry.move(0.0, 0.0, angle, self.pose.z)
        self.counters.time_s += abs(angle) / self.body.mount.turn_rate

    def drive(self, forward: float, left: float = 0.0) -> bool:
        """Move over a floor, m; return whether it went well. After a collision it stands before it."""
        return self._move(forward, left, is_on_stairs=False)

    def climb(self, forward: float, left: float = 0.0) -> bool:
        """Move over steps, m; likewise."""
        return self._move(forward, left, is_on_stairs=True)

    def feel(self, forward: float) -> float:
        """Return the height of the ground so far ahead relative to that below the robot, m; NaN for none."""
        place = self.pose.place + forward * self.pose.forward
        return self.world.foot(place, reach=LEG_REACH) - self.pose.z

    def free_way(self, forward: float) -> float:
        """Return how far ahead of a way, m, the sensors about the body and its feet let it go.

        Legged robots see what is right beside them and feel edges, wheeled ones have bumpers and cliff
        sensors: they stop just before. A stop is counted.
        """
        num = max(math.ceil(forward / MICRO_STEP), 1)
        last = self.pose.place
        wide = replace(self.body, radius=self.body.radius + SENSED_ROOM)
        # Who stands nearer to something already is still led past it.
        bodies = [self.body] if self.world.is_blocked(last, wide) else [self.body, wide]
        for index in range(num):
            place = last + forward / num * self.pose.forward
            share, height = self.world.support(place, self.body.radius)
            place[2] = last[2] if math.isnan(height) else height
            is_free = all(
                not self.world.is_blocked(place, body) and self.world.can_pass(last, place, body)
                for body in bodies
            )
            if share < SAFE_SUPPORT or not is_free:
                self.counters.sensor_stops += 1
                return index * forward / num
            last = place
        return forward

    def is_free_aside(self, forward: float, left: float) -> bool:
        """Tell whether nothing on stairs would touch the body's sides after a step, m; a stop is counted."""
        ahead = self.pose.forward
        target = self.pose.place + forward * ahead + left * np.array([-ahead[1], ahead[0], 0.0])
        height = self.world.foot(target, reach=LEG_REACH)
        target[2] = self.pose.z if math.isnan(height) else height
        if not self._touches_aside(target):
            return True
        self.counters.sensor_stops += 1
        return False

    def look_ahead(self) -> float:
        """Return how far the nearest surface ahead of the body is, m: bumpers' sensors; infinite for none."""
        ahead = self.pose.forward
        aside = np.array([-ahead[1], ahead[0], 0.0])
        heights = np.linspace(STAIR_BODY_BOTTOM, self.body.top, 3)[:, None, None] * -DOWN
        shifts = np.array([-0.9, 0.0, 0.9])[:, None] * aside * self.body.radius
        starts = (self.pose.place + heights + shifts).reshape(-1, 3)
        return float(self.world.caster.distances(starts, ahead, 3.0).min())

    def look_aside(self) -> tuple[float, float]:
        """Return how far the nearest surface left and right of the body on stairs is, m; inf for none."""
        ahead = self.pose.forward
        aside = np.array([-ahead[1], ahead[0], 0.0])
        heights = np.linspace(STAIR_BODY_BOTTOM, self.body.top, 3)
        starts = self.pose.place + heights[:, None] * -DOWN
        left, right = (float(self.world.caster.distances(starts, s * aside, 1.0).min()) for s in (1.0, -1.0))
        return left, right

    def look(self, *, is_tilted: bool = False, sensor: Sensor | None = None) -> View:
        """Take a frame."""
        sensor = self.sensor if sensor is None else sensor
        mount = self.body.mount
        if is_tilted:
            mount = replace(mount, camera_pitch=max(mount.camera_pitch, LOOK_TILT))
        self.counters.time_s += FRAME_TIME
        seconds = self.counters.time_s
        swings = np.sin(2 * math.pi * mount.gait * seconds * np.array([0.5, 1.0, 1.0]) + self._phases)
        attitude = swings * [mount.roll_swing, mount.pitch_swing, mount.bounce]
        believed = self.odometry.attitude(attitude, seconds - self._asked_s)
        self._asked_s = seconds
        true_pose = camera_poses(self.pose.to_row()[None], attitude[None], mount)[0]
        level = camera_poses(np.zeros((1, 4)), believed[None], mount)[0]
        depth = sensor.measure(self.world.caster.render(sensor.camera, true_pose), self._random)
        self._num_frames += 1
        self.true_poses.append(true_pose)
        frame = DepthFrame(
            stamp_ns=round(seconds * 1e9) + self._num_frames, depth=depth, camera=sensor.camera
        )
        return View(frame=frame, odometry=self.odometry.pose, body_from_camera=level)

    def _move(self, forward: float, left: float, *, is_on_stairs: bool) -> bool:
        length = math.hypot(forward, left)
        num = max(math.ceil(length / MICRO_STEP), 1)
        ahead = self.pose.forward
        aside = np.array([-ahead[1], ahead[0], 0.0])
        step = (forward * ahead + left * aside) / num
        speed = self.body.profile.stair_speed if is_on_stairs else self.body.profile.floor_speed
        for _ in range(num):
            target = self._step_on_stairs(step) if is_on_stairs else self._step_on_floor(step)
            self.counters.time_s += length / num / speed
            if target is None:
                return False
            rise = abs(target[2] - self.pose.z) if is_on_stairs else 0.0
            self.counters.path_m += math.hypot(length / num, rise)
            self.pose = replace(self.pose, x=float(target[0]), y=float(target[1]), z=float(target[2]))
            self.odometry.move(forward / num, left / num, 0.0, self.pose.z)
        return True

    def _step_on_floor(self, step: Vector) -> Float64Array | None:
        place = self.pose.place
        share, height = self.world.support(place + step, self.body.radius)
        if share < MIN_SUPPORT:
            self.counters.falls += 1
            return None
        target = place + step
        target[2] = height
        if not self.world.can_pass(place, target, self.body) or self.world.is_blocked(target, self.body):
            self.counters.collisions += 1
            return None
        return np.asarray(target)

    def _step_on_stairs(self, step: Vector) -> Float64Array | None:
        target = self.pose.place + step
        height = self.world.foot(target, reach=LEG_REACH)
        if math.isnan(height):
            self.counters.falls += 1
            return None
        target[2] = height
        if self._touches_aside(target):
            self.counters.collisions += 1
            return None
        return np.asarray(target)

    def _touches_aside(self, place: Vector) -> bool:
        ahead = self.pose.forward
        aside = np.array([-ahead[1], ahead[0], 0.0])
        heights = np.linspace(STAIR_BODY_BOTTOM, self.body.top, 3)
        starts = place + heights[:, None] * -DOWN
        return any(
            bool(np.isfinite(self.world.caster.distances(starts, sign * aside, self.body.radius)).any())
            for sign in (-1.0, 1.0)
        )
