"""The report's stairway modeler: ARL-TR-6381 section 3.2, Algorithm 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points
from stairmap.config import Config
from stairmap.delmerico2013.edge_cloud import downsample, remove_statistical_outliers
from stairmap.delmerico2013.stairway_model import FlightModel, fit_flight
from stairmap.detection.observation import Rejection, StairObservation
from stairmap.geometry import fit_plane_ransac
from stairmap.stairway import Stairway, Step
from stairmap.trajectory import Trajectory
from stairmap.transforms import transform_points

PLANE_TOLERANCE = 0.05
"""Largest distance of an inlier from the plane, m.

The report does not say. The corners between tread and riser lie rise * cos(pitch), about 0.14 m, under
the plane of the nosings; a depth error at 4 m is about 0.03 m.
"""

PLANE_SEED = 6381
"""Seed of RANSAC: equal observations give equal models."""

POSE_TOLERANCE = 1e-9
"""Poses that differ by less (m, and entries of the rotation) are the same; covers rounding."""


class Delmerico2013Modeler:
    """Aggregates stair edge points over observations and fits one stairway (ARL-TR-6381, Algorithm 1).

    As in the report there is one stairway in the map, every k-th detection starts a fit, and the fit
    leaves the cloud downsampled and cleaned for the next one, so that the cloud is bounded by its voxels.

    Poses are known only when the stairways are asked for. So observations are kept in the camera frame,
    and the question runs all fits that are due, one after the other. The answer does not depend on how
    often one asks; asking during a run gives the evolution of the model (the report's figure 8); and
    asking without k new observations fits nothing. A trajectory that moved a pose already used, as after a
    loop closure, makes all fits run anew.

    Parameters
    ----------
    config
        ``config.delmerico2013.detections_per_fit`` and ``.min_cluster_points`` are used.

    Attributes
    ----------
    rejection
        Why the last fit gave no stairway; ``None`` before the first fit and when it gave one.
    """

    def __init__(self, config: Config) -> None:
        self._detections_per_fit = config.delmerico2013.detections_per_fit
        self._min_cluster_points = config.delmerico2013.min_cluster_points
        self._observations: list[StairObservation] = []
        self._clear()

    def _clear(self) -> None:
        self._cloud: Points = np.empty((0, 3))
        self._poses: Float64Array = np.empty((0, 4, 4))
        self._edge_middles: Points = np.empty((0, 3))
        self._edge_observations: IntArray = np.empty(0, dtype=np.int64)
        self._stairway: Stairway | None = None
        self.rejection: Rejection | None = None

    def add(self, observation: StairObservation) -> None:
        """Take in one observation (Algorithm 1, lines 2 and 3)."""
        self._observations.append(observation)

    def stairways(self, trajectory: Trajectory) -> tuple[Stairway, ...]:
        """Return the stairway as of the last multiple of k observations, or nothing.

        Parameters
        ----------
        trajectory
            Must give a pose for each observation up to there.

        Raises
        ------
        TrajectoryError
            If a pose is missing.
        """
        num_due = len(self._observations) // self._detections_per_fit * self._detections_per_fit
        if num_due == 0:
            return ()
        stamps = np.array([observation.stamp_ns for observation in self._observations[:num_due]])
        poses = trajectory.poses_at(stamps)
        if not np.allclose(poses[: len(self._poses)], self._poses, rtol=0, atol=POSE_TOLERANCE):
            self._clear()
        while len(self._poses) < num_due:
            self._fit(poses[len(self._poses) : len(self._poses) + self._detections_per_fit])
        return () if self._stairway is None else (self._stairway,)

    def _fit(self, map_from_camera: Float64Array) -> None:
        """Add the next k observations to the cloud and fit the model (Algorithm 1, lines 3 to 13)."""
        start = len(self._poses)
        observations = self._observations[start : start + len(map_from_camera)]
        points, middles, indices = [self._cloud], [self._edge_middles], [self._edge_observations]
        for index, (pose, observation) in enumerate(zip(map_from_camera, observations, strict=True), start):
            nosings = np.array([edge.nosing for edge in observation.edges]).reshape(-1, 2, 3)
            points.append(transform_points(pose, observation.points))
            middles.append(transform_points(pose, nosings.mean(axis=1)))
            indices.append(np.full(len(nosings), index))
        self._poses = np.concatenate([self._poses, map_from_camera])
        self._edge_middles, self._edge_observations = np.concatenate(middles), np.concatenate(indices)
        cloud = remove_statistical_outliers(downsample(np.concatenate(points)))
        self._cloud, self._stairway, self.rejection = cloud, None, None
        found = fit_plane_ransac(cloud, tolerance=PLANE_TOLERANCE, seed=PLANE_SEED)
        if found is None:
            self.rejection = Rejection(rule="no_plane", measured=len(cloud), limit=3, unit="1")
            return
        plane, inliers = found
        self._cloud = cloud[inliers]
        model = fit_flight(self._cloud, plane, min_points=self._min_cluster_points)
        if isinstance(model, Rejection):
            self.rejection = model
        else:
            self._stairway = self._stairway_from_model(model)

    def _stairway_from_model(self, model: FlightModel) -> Stairway:
        observations = self._observations[: len(self._poses)]
        counts = self._num_observations_of_steps(model)
        steps = tuple(
            Step(nosing=nosing, num_observations=int(count))
            for nosing, count in zip(model.nosings, counts, strict=True)
        )
        stamps = [observation.stamp_ns for observation in observations]
        return Stairway(
            id=1,
            flights=(replace(model.flight, steps=steps),),
            num_observations=len(observations),
            first_seen_ns=min(stamps),
            last_seen_ns=max(stamps),
        )

    def _num_observations_of_steps(self, model: FlightModel) -> IntArray:
        """(N,) number of observations with an edge within half a step of each stair edge of the model."""
        flight = model.flight
        offsets = self._edge_middles[:, None] - model.nosings.mean(axis=1)
        near = (np.abs(offsets @ flight.forward) < flight.run / 2) & (
            np.abs(offsets[..., 2]) < flight.rise / 2
        )
        seen = np.zeros((len(self._poses), len(model.nosings)), dtype=np.bool_)
        edge, step = np.nonzero(near)
        seen[self._edge_observations[edge], step] = True
        return np.asarray(seen.sum(axis=0))
