"""The node's map while it runs: one thread adds images, others correct, save, load and clear it. No ROS in
here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

from stairmap.arrays import DepthImage, Transform
from stairmap.camera import PinholeCamera
from stairmap.detection.observation import Detection
from stairmap.trajectory import Trajectory
from stairmap_ros.path_corrections import PathCorrections
from stairmap_ros.stairway_map import MapAnswer, MapSnapshot, StairwayMap


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedDepth:
    """A depth image with all that is known of it.

    Attributes
    ----------
    depth
        (height, width) float32, m, NaN where nothing was measured.
    camera
        Its intrinsics.
    stamp_ns
        When it was taken, nanoseconds.
    map_from_camera
        (4, 4) pose of the camera's optical coordinate frame.
    map_from_body
        (4, 4) pose of the robot; ``None`` where it is not known.
    """

    depth: DepthImage
    camera: PinholeCamera
    stamp_ns: int
    map_from_camera: Transform
    map_from_body: Transform | None


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveState:
    """What is known at one moment.

    Attributes
    ----------
    answer
        What is confirmed.
    way
        Poses of the images in the map; ``None`` before the first.
    detection, map_from_camera, stamp_ns
        What the newest image shows, or without a camera the newest window of sweeps, the (4, 4) pose it was
        taken from, and when, nanoseconds; ``None`` and 0 before the first.
    """

    answer: MapAnswer
    way: Trajectory | None
    detection: Detection | None
    map_from_camera: Transform | None
    stamp_ns: int


class LiveMap:
    """A map that several threads use, and that says whenever it was asked anew.

    Parameters
    ----------
    make_map
        Gives an empty map.
    publish
        Called with what is known, and the stamp of the newest image looked at in nanoseconds (0 before the
        first): after each image, correction, load and clear.
    """

    def __init__(
        self, make_map: Callable[[], StairwayMap], publish: Callable[[MapAnswer, int], None]
    ) -> None:
        self._make_map, self._publish = make_map, publish
        self._lock = Lock()
        self._map = make_map()
        self._num_replaced = 0
        self._newest_ns = 0
        self._newest_pose: Transform | None = None
        self._newest_detection: Detection | None = None
        self._has_image = False
        self._begin_way()

    @property
    def version(self) -> tuple[int, int]:
        """Something else whenever the map has changed."""
        return self._num_replaced, self._map.version

    def publish(self) -> None:
        """Publish what is known."""
        with self._lock:
            self._publish(self._map.answer(), self._newest_ns)

    def state(self) -> LiveState:
        """Return what is known at this moment."""
        with self._lock:
            return LiveState(
                answer=self._map.answer(),
                way=self._map.trajectory,
                detection=self._newest_detection,
                map_from_camera=self._newest_pose,
                stamp_ns=self._newest_ns,
            )

    def look(self, image: PlacedDepth) -> Detection:
        """Look at an image, let it enter the map if it is of use, and publish what is known then."""
        stairway_map, way = self._map, self._corrections
        frame = stairway_map.frame(image.depth, image.camera)
        detection = stairway_map.detect(frame, image.map_from_camera)
        with self._lock:
            if stairway_map is not self._map:  # cleared or loaded meanwhile
                return detection
            self._map.add(frame, detection, image.stamp_ns, image.map_from_camera)
            # An image of before a jump in time, looked at meanwhile, is not the newest for ever.
            is_of_this_way = way is self._corrections
            if image.map_from_body is not None and is_of_this_way:
                self._corrections.add(image.stamp_ns, image.map_from_body)
            self._has_image = self._has_image or is_of_this_way
            if image.stamp_ns >= self._newest_ns and is_of_this_way:
                self._newest_ns, self._newest_pose = image.stamp_ns, image.map_from_camera
                self._newest_detection = detection
            self._publish(self._map.answer(), self._newest_ns)
        return detection

    def take_points(
        self, detection: Detection, map_from_sensor: Transform, map_from_body: Transform | None
    ) -> None:
        """Let what was found in points enter the map if it is of use, and publish what is known then.

        Parameters
        ----------
        detection
            In the frame of the sensor.
        map_from_sensor, map_from_body
            (4, 4) poses of that frame and of the robot at its stamp; see ``PlacedDepth``.
        """
        with self._lock:
            self._map.add_points(detection, map_from_sensor)
            if map_from_body is not None:
                self._corrections.add(detection.stamp_ns, map_from_body)
            self._newest_ns = max(self._newest_ns, detection.stamp_ns)
            if not self._has_image:  # a robot without a camera
                self._newest_pose, self._newest_detection = map_from_sensor, detection
            self._publish(self._map.answer(), self._newest_ns)

    def correct(self, path: Trajectory) -> None:
        """Move the map by what SLAM says now about where the robot has been.

        Raises
        ------
        TrajectoryError
            If the path has no stamp of the time since the node started.
        """
        with self._lock:
            first, poses = self._corrections.corrected(path, self._map.viewpoints.stamps_ns, self._map.poses)
            self._map.correct(first, poses)
            self._publish(self._map.answer(), self._newest_ns)

    def forget_way(self) -> None:
        """Begin to note the robot's way and stamps anew, as after a jump in time; the map is kept."""
        with self._lock:
            self._begin_way()

    def new_map(self) -> StairwayMap:
        """Return an empty map of the same kind, to be filled and then handed to ``replace``."""
        return self._make_map()

    def clear(self) -> None:
        """Forget everything."""
        self.replace(self._make_map())

    def replace(self, stairway_map: StairwayMap) -> None:
        """Go on with another map."""
        with self._lock:
            self._map = stairway_map
            self._num_replaced += 1
            self._begin_way()
            self._publish(self._map.answer(), self._newest_ns)

    def snapshot(self) -> MapSnapshot:
        """Return a copy of all that is known, for a file.

        Raises
        ------
        StairmapError
            If the method cannot be kept.
        """
        with self._lock:
            return self._map.snapshot()

    def _begin_way(self) -> None:
        self._corrections = PathCorrections(first=len(self._map.viewpoints))
        self._newest_ns, self._newest_pose, self._newest_detection = 0, None, None
        self._has_image = False
