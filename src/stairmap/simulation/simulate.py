"""Drive a robot through a scene and see what its depth camera sees."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stairmap.arrays import Transform
from stairmap.frame import DepthFrame
from stairmap.simulation.odometry import OdometryModel, sample_attitude, sample_odometry
from stairmap.simulation.render import RayCaster
from stairmap.simulation.robots import Robot, camera_poses, drive_route
from stairmap.simulation.scene import Scene
from stairmap.simulation.sensors import Sensor


class SimulatedFrame(NamedTuple):
    """One frame with the pose that odometry gives and the true one, both (4, 4)."""

    frame: DepthFrame
    map_from_camera_odometry: Transform
    map_from_camera_true: Transform


class Simulation:
    """One drive along a scene's route: its poses at once, its frames on demand.

    The map is anchored at the true first pose; odometry drifts away from the truth after it.
    The same arguments give the same drive, bit for bit.

    Parameters
    ----------
    scene, sensor, robot
        Where, with what and on what.
    seed
        Seed of the drive, the odometry and the sensor's noise.
    num_frames
        See ``drive_route``.
    odometry
        Error model; ``None``: the usual one.

    Attributes
    ----------
    stamps_ns
        (N,) stamps, 0.1 s apart.
    true_poses, odometry_poses
        (N, 4, 4) ``map_from_camera``.
    caster
        The scene, ready for rays.
    """

    def __init__(
        self,
        scene: Scene,
        sensor: Sensor,
        robot: Robot,
        *,
        seed: int,
        num_frames: int | None = None,
        odometry: OdometryModel | None = None,
    ) -> None:
        self.scene, self.sensor = scene, sensor
        pitch = max(robot.camera_pitch, scene.route.min_camera_pitch)
        self.robot = replace(robot, camera_pitch=pitch)
        drive_seed, odometry_seed, self._sensor_seed = np.random.SeedSequence([seed, 2]).spawn(3)
        drive = drive_route(
            scene.route, self.robot, random=np.random.default_rng(drive_seed), num_frames=num_frames
        )
        model = OdometryModel() if odometry is None else odometry
        random = np.random.default_rng(odometry_seed)
        self.stamps_ns = drive.stamps_ns
        self.true_poses = camera_poses(drive.planar, drive.attitude, self.robot)
        self.odometry_poses = camera_poses(
            sample_odometry(drive.planar, model, random),
            sample_attitude(drive.attitude, drive.stamps_ns, model, random),
            self.robot,
        )
        self.caster = RayCaster(scene.mesh)

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def frames(self) -> Iterator[SimulatedFrame]:
        """Yield the frames in order, the same ones on every call."""
        random = np.random.default_rng(self._sensor_seed)
        camera = self.sensor.camera
        for stamp_ns, true_pose, believed_pose in zip(
            self.stamps_ns, self.true_poses, self.odometry_poses, strict=True
        ):
            depth = self.sensor.measure(self.caster.render(camera, true_pose), random)
            frame = DepthFrame(stamp_ns=int(stamp_ns), depth=depth, camera=camera)
            yield SimulatedFrame(frame, believed_pose, true_pose)


def simulate(
    scene: Scene,
    sensor: Sensor,
    robot: Robot,
    *,
    seed: int,
    num_frames: int | None = None,
    odometry: OdometryModel | None = None,
) -> Iterator[SimulatedFrame]:
    """Yield the frames of one drive; see ``Simulation``."""
    simulation = Simulation(scene, sensor, robot, seed=seed, num_frames=num_frames, odometry=odometry)
    yield from simulation.frames()
