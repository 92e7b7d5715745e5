"""The map that the node keeps: images with poses in, stairways out. No ROS in here."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from stairmap.arrays import DepthImage, Float64Array, IntArray, Transform
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.drop import Drop
from stairmap.errors import StairmapError
from stairmap.frame import DepthFrame
from stairmap.session import MapSession, MapSessionState
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap_ros.viewpoints import ViewKind, Viewpoints

T = TypeVar("T", Stairway, Drop)

MAX_QUERY_SHARE = 0.25
"""Share of the time that may go into asking for stairways: in a large map it is done less often."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapAnswer:
    """What the map says at one moment, with real stamps.

    Attributes
    ----------
    stairways, drops
        What is confirmed.
    camera_height
        Height of the camera above the ground, m; ``None`` where not known.
    """

    stairways: tuple[Stairway, ...] = ()
    drops: tuple[Drop, ...] = ()
    camera_height: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MapSnapshot:
    """A map at one moment.

    Attributes
    ----------
    state
        What the session knows, by index stamps.
    stamps_ns
        (N,) real stamps of the images in it, in nanoseconds.
    answer
        What the last query told.
    """

    state: MapSessionState
    stamps_ns: IntArray
    answer: MapAnswer = field(default_factory=MapAnswer)


class StairwayMap:
    """Holds a session, and lets into it what is of use.

    Every image is looked at; one enters the map when it shows stair edges, misses stairs that are in the
    map, or
    shows an edge of the ground or ground, from a place that was not looked from often enough yet. So the map
    grows with the building and not with the time.

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
        self._answer = MapAnswer()
        self._point_stamps: set[int] = set()
        self._is_stale = False
        self._next_query = 0.0
        self.version = 0

    @property
    def trajectory(self) -> Trajectory | None:
        """Poses of the images in the map by their index stamps, else those of the LiDAR; ``None`` if none.

        One way is of one sensor: a LiDAR is mounted higher or lower than the camera.
        """
        if not self._session.num_frames:
            return None
        way = self._session.trajectory()
        is_image = ~np.isin(way.stamps_ns, list(self._point_stamps))
        if not is_image.any():
            return way
        return Trajectory(stamps_ns=way.stamps_ns[is_image], map_from_camera=way.map_from_camera[is_image])

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
        kinds = {
            ViewKind.STAIRS: bool(detection),
            ViewKind.MISSED_STAIRS: any(look.is_absent for look in looks),
            ViewKind.DROP: bool(detection.drops or detection.voids),
            ViewKind.GROUND: detection.ground is not None and not (detection.drops or detection.voids),
        }
        wanted = [
            kind
            for kind, is_it in kinds.items()
            if is_it and self.viewpoints.is_wanted(map_from_camera, kind)
        ]
        if ViewKind.STAIRS in wanted and ViewKind.MISSED_STAIRS in wanted:
            wanted.remove(ViewKind.MISSED_STAIRS)
        if wanted:
            self._session.take(frame, detection, map_from_camera, looks)
            self.viewpoints.add(stamp_ns, map_from_camera, wanted)
            self._mark_changed()

    def add_points(self, detection: Detection, map_from_sensor: Transform) -> None:
        """Let what was found in points, such as a window of sweeps, enter the map, if it is of use."""
        if not detection or not self.viewpoints.is_wanted(map_from_sensor, ViewKind.STAIRS):
            return
        stamp_ns, index_ns = detection.stamp_ns, self.viewpoints.next_index_stamp_ns
        observations = tuple(replace(item, stamp_ns=index_ns) for item in detection.observations)
        self._session.take_points(
            replace(detection, stamp_ns=index_ns, observations=observations), map_from_sensor
        )
        self.viewpoints.add(stamp_ns, map_from_sensor, [ViewKind.STAIRS])
        self._point_stamps.add(index_ns)
        self._mark_changed()

    def answer(self) -> MapAnswer:
        """Return what is known with real stamps; asked anew after a change, in a bounded share of time."""
        started = time.monotonic()
        if self._is_stale and started >= self._next_query:
            self._answer = MapAnswer(
                stairways=tuple(self._with_real_stamps(stairway) for stairway in self._session.stairways()),
                drops=tuple(self._with_real_stamps(drop) for drop in self._session.drops()),
                camera_height=self._session.camera_height,
            )
            self._is_stale = False
            ended = time.monotonic()
            self._next_query = ended + (ended - started) * (1.0 / MAX_QUERY_SHARE - 1.0)
        return self._answer

    def stairways(self) -> tuple[Stairway, ...]:
        """Return the stairways of ``answer``."""
        return self.answer().stairways

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
            answer=self._answer,
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
        state, poses = snapshot.state, snapshot.state.map_from_camera
        stamps = {
            ViewKind.STAIRS: state.modeler.observations["stamp_ns"],
            ViewKind.MISSED_STAIRS: state.modeler.looks["stamp_ns"],
            ViewKind.DROP: state.ground_edges["stamp_ns"],
            ViewKind.GROUND: state.ground_views["stamp_ns"],
        }
        shown = {kind: np.isin(state.stamps_ns, of_kind) for kind, of_kind in stamps.items()}
        if not np.any(list(shown.values()), axis=0).all():
            raise ValueError("it has images that show nothing of the map")
        if snapshot.stamps_ns.shape != (len(poses),):
            raise ValueError(f"{len(snapshot.stamps_ns)} images have {len(poses)} poses")
        if np.isnan(poses).any():
            raise ValueError("it has images without a pose")
        self._restorable_session().restore(state)
        if shown[ViewKind.GROUND].any():
            # Sweeps show no ground, and images of stairs nearly always some.
            self._point_stamps = set(state.stamps_ns[~shown[ViewKind.GROUND]].tolist())
        shown[ViewKind.MISSED_STAIRS] &= ~shown[ViewKind.STAIRS]
        shown[ViewKind.GROUND] &= ~shown[ViewKind.DROP]
        for index, (stamp_ns, pose) in enumerate(zip(snapshot.stamps_ns, poses, strict=True)):
            kinds = [kind for kind in ViewKind if shown[kind][index]]
            self.viewpoints.add(int(stamp_ns), pose, kinds)
        self._mark_changed()

    def _mark_changed(self) -> None:
        self._is_stale = True
        self.version += 1

    def _restorable_session(self) -> MapSession:
        if not self._session.is_restorable:
            raise StairmapError("map_file needs method: stairmap; the other method keeps no observations")
        return self._session

    def _with_real_stamps(self, seen: T) -> T:
        return replace(
            seen,
            first_seen_ns=self.viewpoints.real_stamp_ns(seen.first_seen_ns),
            last_seen_ns=self.viewpoints.real_stamp_ns(seen.last_seen_ns),
        )
