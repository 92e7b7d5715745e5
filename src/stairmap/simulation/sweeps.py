"""Drive a robot through a scene and measure what its LiDAR measures, while it moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, Transform
from stairmap.simulation.lidars import MAX_INCIDENCE, Lidar
from stairmap.simulation.odometry import OdometryModel, sample_attitude, sample_odometry
from stairmap.simulation.render import RayCaster
from stairmap.simulation.robots import OPTICAL_FROM_BODY_AXES, Robot, camera_poses, drive_route
from stairmap.simulation.scene import Scene
from stairmap.sweep import Sweep
from stairmap.trajectory import Trajectory
from stairmap.transforms import interpolate_poses

DROPOUT = 0.01
"""Share of beams without an echo (ours)."""


class SimulatedSweep(NamedTuple):
    """A sweep, the (N, 3) places in the true map that its points were measured of, and their lasers."""

    sweep: Sweep
    true_points: Points
    rings: IntArray


class LidarDrive:
    """One drive along a scene's route with a LiDAR in the camera's place, tilted as it is.

    The robot moves on during a sweep, so a wall is bent unless each point is placed by the pose of its own
    time. The map is anchored at the true first pose; odometry drifts away from the truth after it. The same
    arguments give the same drive, bit for bit.

    Parameters
    ----------
    scene, lidar, robot
        Where, with what and on what.
    seed
        Seed of the drive, the odometry and the noise.
    num_frames
        See ``drive_route``; there is one sweep less.
    odometry
        Error model; ``None``: the usual one.

    Attributes
    ----------
    true_path, odometry_path
        ``map_from_sensor`` every 0.1 s.
    caster
        The scene, ready for rays.
    """

    def __init__(
        self,
        scene: Scene,
        lidar: Lidar,
        robot: Robot,
        *,
        seed: int,
        num_frames: int | None = None,
        odometry: OdometryModel | None = None,
    ) -> None:
        self.scene, self.lidar = scene, lidar
        pitch = max(robot.camera_pitch, scene.route.min_camera_pitch)
        self.robot = replace(robot, camera_pitch=pitch)
        drive_seed, odometry_seed, self._noise_seed = np.random.SeedSequence([seed, 3]).spawn(3)
        drive = drive_route(
            scene.route, self.robot, random=np.random.default_rng(drive_seed), num_frames=num_frames
        )
        model = OdometryModel() if odometry is None else odometry
        random = np.random.default_rng(odometry_seed)
        believed = sample_odometry(drive.planar, model, random)
        attitude = sample_attitude(drive.attitude, drive.stamps_ns, model, random)
        self.true_path = self._path(drive.stamps_ns, drive.planar, drive.attitude)
        self.odometry_path = self._path(drive.stamps_ns, believed, attitude)
        self.caster = RayCaster(scene.mesh)

    def __len__(self) -> int:
        return len(self.true_path) - 1

    @property
    def base_from_lidar(self) -> Transform:
        """(4, 4) mount: the camera's place and tilt, x forward; the base is on the floor below."""
        mount = self.robot.body_from_camera.copy()
        mount[:3, :3] = mount[:3, :3] @ OPTICAL_FROM_BODY_AXES.T
        return mount

    def _path(self, stamps_ns: IntArray, planar: Float64Array, attitude: Float64Array) -> Trajectory:
        poses = camera_poses(planar, attitude, self.robot)
        poses[:, :3, :3] = poses[:, :3, :3] @ OPTICAL_FROM_BODY_AXES.T
        return Trajectory(stamps_ns=stamps_ns, map_from_camera=poses)

    def sweeps(self) -> Iterator[SimulatedSweep]:
        """Yield the sweeps in order, the same ones on every call; a stamp is that of a sweep's beginning."""
        random = np.random.default_rng(self._noise_seed)
        ring_errors = self.lidar.ring_std * random.standard_normal(self.lidar.num_rings)
        for index in range(len(self)):
            yield self._sweep(index, ring_errors, random)

    def _sweep(self, index: int, ring_errors: Float64Array, random: np.random.Generator) -> SimulatedSweep:
        lidar, stamp_ns = self.lidar, int(self.true_path.stamps_ns[index])
        offsets, named, rings = lidar.beams(index)
        # Beams of one moment share a pose.
        moments, moment = np.unique(offsets, return_inverse=True)
        poses = interpolate_poses(
            self.true_path.stamps_ns, self.true_path.map_from_camera, stamp_ns + moments
        )[moment]
        # A beam goes a little beside where the LiDAR says, and is some milliradians wide.
        sent = named + lidar.angle_std * random.standard_normal(named.shape)
        sent /= np.linalg.norm(sent, axis=1, keepdims=True)
        directions = np.einsum("nij,nj->ni", poses[:, :3, :3], sent)
        hits = self.caster.cast(poses[:, :3, 3], directions)
        measured = hits.distance + ring_errors[rings] + lidar.range_std * random.standard_normal(len(rings))
        with np.errstate(invalid="ignore"):
            kept = (hits.distance > lidar.min_range) & (hits.distance < lidar.max_range)
            kept &= (hits.incidence < MAX_INCIDENCE) & (measured > 0)
        kept &= random.random(len(rings)) > DROPOUT
        true_points = poses[kept, :3, 3] + directions[kept] * hits.distance[kept, None]
        sweep = Sweep(
            stamp_ns=stamp_ns,
            points=(named[kept] * measured[kept, None]).astype(np.float32),
            offsets_ns=offsets[kept],
        )
        return SimulatedSweep(sweep, true_points, rings[kept])
