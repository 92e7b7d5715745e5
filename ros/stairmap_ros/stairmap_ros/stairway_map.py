"""The map that the node keeps: images with poses in, stairways out. No ROS in here."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from stairmap.arrays import DepthImage, Float64Array, IntArray, Transform
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.errors import StairmapError
from stairmap.frame import DepthFrame
from stairmap.session import MapSession, MapSessionState
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap_ros.viewpoints import Viewpoints

MAX_QUERY_SHARE = 0.25
"""Share of the time that may go into asking for stairways: in a large map it is done less often."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapSnapshot:
    """A map at one moment.

    Attributes
    ----------
    state
        What the session knows, by index stamps.
    stamps_ns
        (N,) real stamps of the images in it, in nanoseconds.
    stairways
        The stairways of the last query.
    """

    state: MapSessionState
    stamps_ns: IntArray
    stairways: tuple[Stairway, ...] = ()


class StairwayMap:
    """Holds a session, and lets into it what is of use.

    Every image is looked at; one enters the map when it shows stair edges, or misses stairs that are in the
    map, from a place that was not looked from often enough yet. So the map grows with the building and not
    with the time.

    Parameters
    ----------
    config
        Configuration of all stages.
    method
        A key of ``stairmap.pipeline.METHODS``.
    views_per_place
        See ``NodeConfig``.
    """

    def __init__(self, config: Config, *, method: str, views_per_place: int) -> None:
        self._session = MapSession(config, method=method)
        self.viewpoints = Viewpoints(per_place=views_per_place)
        self._stairways: tuple[Stairway, ...] = ()
        self._is_stale = False
        self._next_query = 0.0
        self.version = 0

    @property
    def poses(self) -> Float64Array:
        """(N, 4, 4) ``map_from_camera`` of the images in the map, as they were taken or corrected since."""
        if not self._session.num_frames:
            return np.zeros((0, 4, 4))
        return self._session.trajectory().map_from_camera

    def frame(self, depth: DepthImage, camera: PinholeCamera) -> DepthFrame:
        """Return an image, (height, width) float32 m, as the next one of the map."""
        return DepthFrame(stamp_ns=self.viewpoints.next_index_stamp_ns, depth=depth, camera=camera)

    def detect(self, frame: DepthFrame, map_from_camera: Transform) -> Detection:
        """Look at one image taken at a (4, 4) pose; the map stays as it is."""
        return self._session.detect(frame, map_from_camera)

    def add(self, frame: DepthFrame, detection: Detection, stamp_ns: int, map_from_camera: Transform) -> None:
        """Let what ``detect`` has just found enter the map, if it is of use."""
        looks = self._session.look(frame, map_from_camera)
        kinds = {True: bool(detection), False: any(look.is_absent for look in looks)}
        wanted = [
            shows_stairs
            for shows_stairs, is_it in kinds.items()
            if is_it and self.viewpoints.is_wanted(map_from_camera, shows_stairs=shows_stairs)
        ]
        if wanted:
            self._session.take(frame, detection, map_from_camera, looks)
            self.viewpoints.add(stamp_ns, map_from_camera, shows_stairs=wanted[0])
            self._mark_changed()

    def add_points(self, detection: Detection, map_from_sensor: Transform) -> None:
        """Let what was found in points, such as a window of sweeps, enter the map, if it is of use."""
        if not detection or not self.viewpoints.is_wanted(map_from_sensor, shows_stairs=True):
            return
        stamp_ns, index_ns = detection.stamp_ns, self.viewpoints.next_index_stamp_ns
        observations = tuple(replace(item, stamp_ns=index_ns) for item in detection.observations)
        self._session.take_points(
            replace(detection, stamp_ns=index_ns, observations=observations), map_from_sensor
        )
        self.viewpoints.add(stamp_ns, map_from_sensor, shows_stairs=True)
        self._mark_changed()

    def stairways(self) -> tuple[Stairway, ...]:
        """Return the stairways with real stamps; asked anew after a change, in a bounded share of time."""
        started = time.monotonic()
        if self._is_stale and started >= self._next_query:
            found = self._session.stairways()
            self._stairways = tuple(self._with_real_stamps(stairway) for stairway in found)
            self._is_stale = False
            ended = time.monotonic()
            self._next_query = ended + (ended - started) * (1.0 / MAX_QUERY_SHARE - 1.0)
        return self._stairways

    def correct(self, first: int, poses: Float64Array) -> None:
        """Take corrected (M, 4, 4) poses of the viewpoints from ``first`` on, as after a loop closure."""
        all_poses = np.concatenate([self.poses[:first], poses, self.poses[first + len(poses) :]])
        stamps_ns = self._session.trajectory().stamps_ns
        self._session.correct(Trajectory(stamps_ns=stamps_ns, map_from_camera=all_poses))
        self._next_query = 0.0
        self._mark_changed()

    def snapshot(self) -> MapSnapshot:
        """Return a copy of all that is known, for a file.

        Raises
        ------
        StairmapError
            If the method cannot be kept.
        """
        return MapSnapshot(
            state=self._restorable_session().state(),
            stamps_ns=self.viewpoints.stamps_ns.copy(),
            stairways=self._stairways,
        )

    def restore(self, snapshot: MapSnapshot) -> None:
        """Go on from a snapshot; its stairways are found anew.

        Raises
        ------
        ValueError
            If its parts do not belong together.
        StairmapError
            If the method cannot go on from it.
        """
        poses, modeler = snapshot.state.map_from_camera, snapshot.state.modeler
        shows_stairs = np.isin(snapshot.state.stamps_ns, modeler.observations["stamp_ns"])
        if not (shows_stairs | np.isin(snapshot.state.stamps_ns, modeler.looks["stamp_ns"])).all():
            raise ValueError("it has images that neither show nor miss stairs")
        if len(snapshot.stamps_ns) != len(poses):
            raise ValueError(f"{len(snapshot.stamps_ns)} images have {len(poses)} poses")
        self._restorable_session().restore(snapshot.state)
        for stamp_ns, pose, shows in zip(snapshot.stamps_ns, poses, shows_stairs, strict=True):
            self.viewpoints.add(int(stamp_ns), pose, shows_stairs=bool(shows))
        self._mark_changed()

    def _mark_changed(self) -> None:
        self._is_stale = True
        self.version += 1

    def _restorable_session(self) -> MapSession:
        if not self._session.is_restorable:
            raise StairmapError("map_file needs method: stairmap; the other method keeps no observations")
        return self._session

    def _with_real_stamps(self, stairway: Stairway) -> Stairway:
        return replace(
            stairway,
            first_seen_ns=self.viewpoints.real_stamp_ns(stairway.first_seen_ns),
            last_seen_ns=self.viewpoints.real_stamp_ns(stairway.last_seen_ns),
        )
