"""What a robot knows of a building from its own frames: it takes them in, and finds its place by them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Transform
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.exploration.body import Body
from stairmap.exploration.known_building import SAME_PLACE, KnownBuilding, Sighting
from stairmap.exploration.layer_map import LayerMap
from stairmap.exploration.levels import Level
from stairmap.exploration.localizer import Localizer, ScanStore
from stairmap.exploration.odometry import Planar
from stairmap.exploration.scans import Scan, scan_from_view
from stairmap.exploration.sight import are_in_sight
from stairmap.exploration.simulated_robot import View
from stairmap.exploration.state_file import State
from stairmap.modeling.mapper import MapperState
from stairmap.session import MapSession, MapSessionState
from stairmap.stairway import Stairway
from stairmap.transforms import rotation_from_vector, transform_from_parts

FACED_DISTANCE, FACED_ANGLE, FACED_VIEW = (0.8, 3.0), math.radians(40), 0.8
"""Stairs are detected well from such distances, m, at most so far from straight ahead of them, rad, and in
this middle part of the image."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """When a frame was taken, where by odometry, and on which level (``None``: on stairs)."""

    stamp_ns: int
    odometry: Planar
    level: int | None


class ExplorationMap(KnownBuilding):
    """Takes in what the robot sees; knows levels, stairs and the robot's place.

    Parameters
    ----------
    body
        The robot.
    start
        Where it begins.
    config
        Of the stair detector and modeler.
    allow_unknown
        Whether stairs are also tried where nobody knows whether the robot can climb them.
    has_perfect_odometry
        Whether the poses of odometry need no correction.
    """

    def __init__(
        self,
        body: Body,
        start: Planar,
        config: Config | None = None,
        *,
        allow_unknown: bool = False,
        has_perfect_odometry: bool = True,
    ) -> None:
        super().__init__(body, start, LayerMap, allow_unknown=allow_unknown)
        self.session = MapSession(config)
        self.localizer = Localizer(start, is_perfect=has_perfect_odometry)
        self.scans = ScanStore()
        self.records: list[Record] = []
        self.poses: list[Planar] = []
        self.last_scan: Scan | None = None
        self.last_detection: Detection | None = None
        self.on_frame: Callable[[View, Transform, Detection], None] = lambda *_: None
        self.num_detections = 0
        self._sightings: list[Sighting] = []

    def believed(self, odometry: Planar) -> Planar:
        """Return where the robot is in the map when odometry says where it is."""
        return self.localizer.predict(odometry)

    def believe(self, odometry: Planar) -> None:
        """Move the robot to where odometry says that it is."""
        self.pose = self.believed(odometry)

    def take(self, view: View) -> None:
        """Take in a frame of the robot where it is now, on its level or, without one, on stairs."""
        scan = scan_from_view(view, top=self.body.top + 0.1)
        self.pose = self.localizer.correct(scan, view.odometry, self.scans)
        if self.localizer.is_sure:
            self.scans.add(scan, self.pose)
        map_from_camera = map_from_body(self.pose) @ view.body_from_camera
        self.last_detection = self.session.add(view.frame, map_from_camera)
        self.num_detections += bool(self.last_detection)
        self._stairs_are_stale |= bool(self.last_detection)
        self.last_scan = scan
        self.half_view = math.atan(view.frame.camera.width / 2 / view.frame.camera.fx)
        number = None if self.level is None else self.level.number
        self.records.append(Record(stamp_ns=scan.stamp_ns, odometry=view.odometry, level=number))
        self.poses.append(self.pose)
        self._note_sightings(map_from_camera)
        self.on_frame(view, map_from_camera, self.last_detection)
        if self.level is not None and isinstance(self.level.map, LayerMap):
            self.level.map.add(scan, self.pose, radius=self.body.radius)

    def find_stairways(self) -> tuple[Stairway, ...]:
        """Return the stairways that the frames so far show."""
        return self.session.stairways()

    def sightings(self, level: int) -> list[Sighting]:
        """Return the places of a level where single frames showed stairs, one for each place."""
        found: list[Sighting] = []
        for sighting in self._sightings:
            if sighting.level == level and not any(
                math.dist(sighting.place[:2], other.place[:2]) < SAME_PLACE for other in found
            ):
                found.append(sighting)
        return found

    def was_faced(self, level: Level, place: Float64Array, heading: float) -> bool:
        """As ``KnownBuilding.was_faced``, by the robot's own frames."""
        is_here = np.array([record.level == level.number for record in self.records], dtype=bool)
        poses = np.array([pose.to_row() for pose in self.poses]).reshape(-1, 4)[is_here]
        offsets = place - poses[:, :2]
        distance = np.hypot(*offsets.T)
        bearing = np.arctan2(offsets[:, 1], offsets[:, 0])
        near = (distance > FACED_DISTANCE[0]) & (distance < FACED_DISTANCE[1])
        near &= np.cos(bearing - poses[:, 3]) > math.cos(self.half_view * FACED_VIEW)
        near &= np.cos(bearing - heading) > math.cos(FACED_ANGLE)
        if not near.any():
            return False
        return bool(are_in_sight(level.map.grid(), level.map.opaque(), poses[near, :2], place).any())

    def state(self) -> State:
        """Return all that is known, to go on from where the robot stands on a level."""
        rows = [[r.stamp_ns, -1 if r.level is None else r.level] for r in self.records]
        sightings = [[s.level, *s.place, s.heading, s.view == "ascending"] for s in self._sightings]
        return {
            "pose": self.pose.to_row(),
            "level": None if self.level is None else self.level.number,
            "half_view": self.half_view,
            "levels": [
                {
                    "height": level.height,
                    "is_landing": level.is_landing,
                    "map": level.map.state() if isinstance(level.map, LayerMap) else None,
                }
                for level in self.levels.levels
            ],
            "stairs": self.stairs.state(),
            "looks": np.array([[level, *place] for level, place in self._looks]).reshape(-1, 3),
            "sightings": np.array(sightings, dtype=np.float64).reshape(-1, 6),
            "frames": np.array(rows, dtype=np.int64).reshape(-1, 2),
            "odometry": np.array([r.odometry.to_row() for r in self.records]).reshape(-1, 4),
            "poses": np.array([pose.to_row() for pose in self.poses]).reshape(-1, 4),
            "num_detections": self.num_detections,
            "localizer": self.localizer.state(),
            "scans": self.scans.state(),
            "session": _session_state(self.session.state()),
        }

    def restore(self, state: State) -> None:
        """Go on from a state of a robot with the same body.

        Raises
        ------
        KeyError, IndexError, ValueError, TypeError, TrajectoryError
            If it is none, or its parts do not belong together.
        """
        self.session.restore(_session_state_from(state["session"]))
        self.scans.restore(state["scans"])
        self.localizer.restore(state["localizer"])
        self.pose, self.half_view = Planar.from_row(state["pose"]), float(state["half_view"])
        self.levels.levels.clear()
        for number, saved in enumerate(state["levels"]):
            layer = LayerMap(float(saved["height"]))
            layer.restore(saved["map"])
            self.levels.levels.append(
                Level(number=number, height=layer.height, map=layer, is_landing=bool(saved["is_landing"]))
            )
        self.level = self.levels.levels[int(state["level"])]
        self.stairs.restore(state["stairs"], self.levels)
        self._looks = [(int(row[0]), np.array(row[1:])) for row in state["looks"]]
        self._sightings = [
            Sighting(
                level=int(row[0]), place=np.array(row[1:4]), heading=float(row[4]),
                view="ascending" if row[5] else "descending",
            )
            for row in state["sightings"]
        ]  # fmt: skip
        self.records = [
            Record(stamp_ns=int(stamp), odometry=Planar.from_row(odometry), level=None if n < 0 else int(n))
            for (stamp, n), odometry in zip(state["frames"], state["odometry"], strict=True)
        ]
        self.poses = [Planar.from_row(row) for row in state["poses"]]
        if len(self.poses) != len(self.records) or len(self.poses) != self.session.num_frames:
            numbers = (len(self.records), len(self.poses), self.session.num_frames)
            raise ValueError(f"numbers of frames, poses and frames of the map differ: {numbers}")
        self.num_detections = int(state["num_detections"])
        self.last_scan = self.last_detection = None
        self._searches, self.tasks_elsewhere = {}, {}
        self._stairs_are_stale = True

    def _note_sightings(self, map_from_camera: Transform) -> None:
        if self.level is None or self.last_detection is None:
            return
        for observation in self.last_detection.observations:
            edge = observation.edges[0 if observation.view == "ascending" else -1].nosing.mean(axis=0)
            forward = map_from_camera[:3, :3] @ observation.forward
            self._sightings.append(
                Sighting(
                    level=self.level.number,
                    place=map_from_camera[:3, :3] @ edge + map_from_camera[:3, 3],
                    heading=math.atan2(forward[1], forward[0]),
                    view=observation.view,
                )
            )


def map_from_body(pose: Planar) -> Transform:
    """Return (4, 4) the level body frame of a robot in the map."""
    return transform_from_parts(rotation_from_vector([0.0, 0.0, pose.heading]), pose.place)


def _session_state(state: MapSessionState) -> State:
    modeler = state.modeler
    return {
        "observations": modeler.observations,
        "edges": modeler.edges,
        "ids": modeler.ids,
        "next_id": modeler.next_id,
        "looks": modeler.looks,
        "stamps_ns": state.stamps_ns,
        "map_from_camera": state.map_from_camera,
        "ground_views": state.ground_views,
        "ground_edges": state.ground_edges,
    }


def _session_state_from(values: State) -> MapSessionState:
    modeler = MapperState(
        observations=values["observations"],
        edges=values["edges"],
        ids=values["ids"],
        next_id=int(values["next_id"]),
        looks=values["looks"],
    )
    names = ("stamps_ns", "map_from_camera", "ground_views", "ground_edges")
    return MapSessionState(modeler=modeler, **{name: values[name] for name in names})
