"""What a robot knows of a building from its own frames: it takes them in, and finds its place by them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from stairmap.arrays import Transform
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.exploration.body import Body
from stairmap.exploration.known_building import SAME_PLACE, KnownBuilding, Sighting
from stairmap.exploration.layer_map import LayerMap
from stairmap.exploration.localizer import Localizer, Placed, ScanStore
from stairmap.exploration.odometry import Planar
from stairmap.exploration.scans import Scan, scan_from_view
from stairmap.exploration.simulated_robot import View
from stairmap.session import MapSession
from stairmap.stairway import Stairway
from stairmap.transforms import rotation_from_vector, transform_from_parts


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
        self._scans = ScanStore()
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
        self.pose = self.localizer.correct(scan, view.odometry, self._scans)
        self._scans.add(Placed(scan=scan, pose=self.pose))
        map_from_camera = map_from_body(self.pose) @ view.body_from_camera
        self.last_detection = self.session.add(view.frame, map_from_camera)
        self.num_detections += bool(self.last_detection)
        self._stairs_are_stale |= bool(self.last_detection)
        self.last_scan = scan
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
