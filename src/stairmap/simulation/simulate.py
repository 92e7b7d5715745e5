"""Drive a robot through a scene and record what its depth camera sees."""

from __future__ import annotations

from collections.abc import Iterator
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


def simulate(
    scene: Scene,
    sensor: Sensor,
    robot: Robot,
    *,
    seed: int,
    num_frames: int | None = None,
    odometry: OdometryModel | None = None,
) -> Iterator[SimulatedFrame]:
    """Yield the frames of one drive along the scene's route.

    The map is anchored at the true first pose; odometry drifts away from the truth after it.
    The same arguments give the same frames, bit for bit.

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
    """
    drive_seed, odometry_seed, sensor_seed = np.random.SeedSequence([seed, 2]).spawn(3)
    drive = drive_route(scene.route, robot, random=np.random.default_rng(drive_seed), num_frames=num_frames)
    model = OdometryModel() if odometry is None else odometry
    random = np.random.default_rng(odometry_seed)
    true_poses = camera_poses(drive.planar, drive.attitude, robot)
    believed = camera_poses(
        sample_odometry(drive.planar, model, random),
        sample_attitude(drive.attitude, drive.stamps_ns, model, random),
        robot,
    )
    caster = RayCaster(scene.mesh)
    sensor_random = np.random.default_rng(sensor_seed)
    for stamp_ns, true_pose, believed_pose in zip(drive.stamps_ns, true_poses, believed, strict=True):
        rendering = caster.render(sensor.camera, true_pose)
        depth = sensor.measure(rendering, sensor_random)
        frame = DepthFrame(stamp_ns=int(stamp_ns), depth=depth, camera=sensor.camera)
        yield SimulatedFrame(frame, believed_pose, true_pose)
