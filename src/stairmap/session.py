"""Map stairways while frames and poses come in: the one place where detector, modeler and poses meet.

    session = MapSession()
    for frame, map_from_camera in ...:
        session.add(frame, map_from_camera)
    print(session.stairways())

A loop closure moves old poses: hand the corrected ones to ``correct`` and ask again. Frames also look at the
stairways that are known already: one that is not there any more is withdrawn.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Transform, readonly
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.detection.orientation import POSE_UP_STD
from stairmap.drop import Drop
from stairmap.errors import ConfigError, MapFullError
from stairmap.frame import DepthFrame
from stairmap.modeling.drop_map import DropMap
from stairmap.modeling.drop_stairways import assign_drops
from stairmap.modeling.ground_table import GroundTable
from stairmap.modeling.looks import Look, look_at_flights
from stairmap.modeling.mapper import MapperState
from stairmap.pipeline import (
    DEFAULT_METHOD,
    LookingModeler,
    RestorableModeler,
    make_detector,
    make_modeler,
)
from stairmap.pose_log import PoseLog
from stairmap.stairway import Flight, Stairway
from stairmap.trajectory import Trajectory
from stairmap.transforms import check_pose

GroundRecords: TypeAlias = np.ndarray[tuple[int], np.dtype[np.void]]
"""Records of ``stairmap.modeling.ground_table``."""

MAX_OBSERVATIONS = 1_000_000
"""Most observations that a session takes: so many need 3 GB and half a minute to give their stairways."""

MIN_NEW_OBSERVATIONS, NEW_SHARE = 10, 0.1
"""Frames look at the flights of the last answer. The session asks for them itself after 10 new observations,
or a tenth of those it had then if that is more: 50 times in 10,000 observations."""

FRAMES_UNTIL_ASKED = 10
"""After a correction of poses no frame looks at flights that were placed by the old ones, and a restored
session knows none yet. Unless somebody asks for the stairways before, the session asks for the flights this
many frames later: so a correction with every frame does not cost a query with every frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapSessionState:
    """All that a session knows, to go on from in another process or under another configuration.

    Attributes
    ----------
    modeler
        What its modeler knows.
    stamps_ns
        (N,) int64 stamps of its frames, in nanoseconds.
    map_from_camera
        (N, 4, 4) their poses as they were given, or corrected since; NaN for frames without one.
    ground_views, ground_edges
        What was seen of the ground, and the edges of drops: records of ``stairmap.modeling.ground_table``.
    """

    modeler: MapperState
    stamps_ns: IntArray
    map_from_camera: Float64Array
    ground_views: GroundRecords = field(default_factory=lambda: GroundTable().views)
    ground_edges: GroundRecords = field(default_factory=lambda: GroundTable().edges)

    def __post_init__(self) -> None:
        object.__setattr__(self, "stamps_ns", readonly(self.stamps_ns, np.int64))
        object.__setattr__(self, "map_from_camera", readonly(self.map_from_camera).reshape(-1, 4, 4))


class MapSession:
    """Finds stairways in frames as they come and models them in one map.

    Parameters
    ----------
    config
        Configuration of all stages; the default one if not given.
    method
        A key of ``stairmap.pipeline.METHODS``.

    Attributes
    ----------
    config, method
        As given.
    detector, modeler
        The two stages of the method.

    Raises
    ------
    ConfigError
        If there is no such method.
    """

    def __init__(self, config: Config | None = None, *, method: str = DEFAULT_METHOD) -> None:
        self.config = Config() if config is None else config
        self.method = method
        self.detector = make_detector(self.config, method=method)
        self.modeler = make_modeler(self.config, method=method)
        self._poses = PoseLog()
        self._num_observations = 0
        self._known = _KnownFlights()
        self._drop_map = self._make_drop_map(GroundTable())
        self._stairways: tuple[Stairway, ...] = ()

    def _make_drop_map(self, table: GroundTable) -> DropMap:
        return DropMap(
            min_observations=self.config.modeling.min_observations,
            camera_height=self.config.detection.camera_height or None,
            table=table,
        )

    @property
    def camera_height(self) -> float | None:
        """Height of the camera above the ground that it moves on, m: configured, or as most frames saw it.

        ``None`` where too few frames agree, and for methods that do not look for the ground.
        """
        return self._drop_map.camera_height

    @property
    def num_frames(self) -> int:
        """Number of frames in the session, those without a pose included."""
        return len(self._poses)

    @property
    def is_restorable(self) -> bool:
        """Whether the method supports ``state`` and ``restore``."""
        return isinstance(self.modeler, RestorableModeler)

    def add(self, frame: DepthFrame, map_from_camera: Transform | None, *, trace: bool = False) -> Detection:
        """Look for stairs in one frame and add what it shows to the map.

        Parameters
        ----------
        frame
            Depth image, newer than those before it. Its own ``up`` is used where it has one, otherwise the
            pose tells up, and without a pose the floor.
        map_from_camera
            (4, 4) pose of the camera's optical coordinate frame in a map with z up. ``None`` where it is not
            known yet: the frame then counts once ``correct`` or ``stairways`` is given a trajectory that has
            its stamp.
        trace
            Whether the detection also holds intermediate results for pictures.

        Raises
        ------
        TrajectoryError
            If the pose is no rigid transform or the stamp is not after the one before it. The session stays
            as it was.
        MapFullError
            If it shows stair edges and the map holds ``MAX_OBSERVATIONS`` already; likewise.
        """
        self._poses.check_stamp(frame.stamp_ns)
        detection = self.detect(frame, map_from_camera, trace=trace)
        self.take(frame, detection, map_from_camera)
        return detection

    def detect(
        self, frame: DepthFrame, map_from_camera: Transform | None = None, *, trace: bool = False
    ) -> Detection:
        """Look for stairs in one frame without changing the map; for parameters and errors see ``add``.

        It may run in one thread while another asks for the stairways.
        """
        if map_from_camera is not None:
            frame = frame_with_up(frame, check_pose(map_from_camera))
        return self.detector.detect(frame, trace=trace)

    def look(self, frame: DepthFrame, map_from_camera: Transform) -> tuple[Look, ...]:
        """Compare a frame with the flights known so far, without changing the map: what it sees and misses.

        It takes half a millisecond for each flight in view. The result is empty if nothing is known yet, or
        if the method does not use looks.

        Raises
        ------
        TrajectoryError
            If the pose is no rigid transform.
        """
        pose = check_pose(map_from_camera)
        if not isinstance(self.modeler, LookingModeler):
            return ()
        if self._known.is_due(self._num_observations):
            flights = self.modeler.flights(self._poses.trajectory()) if self._poses.num_placed else ()
            self._known = _KnownFlights(flights, self._num_observations)
        return look_at_flights(self._known.flights, frame, pose)

    def take(
        self,
        frame: DepthFrame,
        detection: Detection,
        map_from_camera: Transform | None,
        looks: tuple[Look, ...] | None = None,
    ) -> None:
        """Add what ``detect`` found in a frame to the map; ``add`` does both.

        If the frame has a pose, what it sees and misses of the flights known so far is added too: ``looks``,
        or the result of ``look`` if they are not given.
        """
        self._check_room(detection)
        if looks is None:
            looks = () if map_from_camera is None else self.look(frame, map_from_camera)
        self._take(frame.stamp_ns, detection, map_from_camera, looks)

    def take_points(self, detection: Detection, map_from_sensor: Transform | None) -> None:
        """Add what was found in points without an image to the map, such as a window of LiDAR sweeps.

        Parameters
        ----------
        detection
            Its stamp is newer than those before it, its observations are in the frame of the sensor.
        map_from_sensor
            (4, 4) pose of that frame; ``None`` as for ``add``.

        Raises
        ------
        TrajectoryError, MapFullError
            See ``add``.
        """
        self._poses.check_stamp(detection.stamp_ns)
        self._check_room(detection)
        self._take(detection.stamp_ns, detection, map_from_sensor, ())

    def _check_room(self, detection: Detection) -> None:
        if self._num_observations + len(detection.observations) > MAX_OBSERVATIONS:
            raise MapFullError(
                f"the map holds {self._num_observations:,} observations, of {MAX_OBSERVATIONS:,} at most; "
                "leave out frames from places that were looked from often, or begin a new session"
            )

    def _take(
        self,
        stamp_ns: int,
        detection: Detection,
        map_from_sensor: Transform | None,
        looks: tuple[Look, ...],
    ) -> None:
        self._poses.add(stamp_ns, map_from_sensor)
        self._num_observations += len(detection.observations)
        if isinstance(self.modeler, LookingModeler):
            for look in looks:
                self.modeler.add_look(look)
        self._drop_map.add(detection)
        for observation in detection.observations:
            self.modeler.add(observation)

    def trajectory(self) -> Trajectory:
        """Return the poses so far, as they were given or corrected since.

        Raises
        ------
        TrajectoryError
            If no frame has a pose yet.
        """
        return self._poses.trajectory()

    def correct(self, path: Trajectory) -> None:
        """Take better poses for the frames so far, as SLAM has them after a loop closure.

        A frame whose stamp the path has takes its pose from there. The others move along with it: their
        correction is interpolated between such frames, and is that of the nearest before the first and after
        the last. Sparse poses of keyframes are therefore enough.

        Parameters
        ----------
        path
            ``map_from_camera``, corrected.

        Raises
        ------
        TrajectoryError
            If it has the stamp of no frame. The session stays as it was.
        """
        self._poses.correct(path)
        self._known = _KnownFlights((), self._num_observations, frames_left=FRAMES_UNTIL_ASKED)

    def stairways(self, trajectory: Trajectory | None = None) -> tuple[Stairway, ...]:
        """Return the stairways found so far, in the order of their ids.

        Parameters
        ----------
        trajectory
            Other poses to place all frames by, this once; frames that it has no pose for are left out.
            Without it, the session's own.
        """
        if trajectory is not None:
            return self.modeler.stairways(trajectory)
        if not self._poses.num_placed:
            return ()
        self._stairways = stairways = self.modeler.stairways(self._poses.trajectory())
        flights = tuple(flight for stairway in stairways for flight in stairway.flights)
        self._known = _KnownFlights(flights, self._num_observations)
        return stairways

    def drops(self, trajectory: Trajectory | None = None) -> tuple[Drop, ...]:
        """Return the edges where the ground ends and goes on lower, in the order of their ids.

        A drop that is the edge of a stairway has its id, as far as ``stairways`` was asked for. Where the
        height of the camera is not known, because it is carried by hand, there are none: its ground may be a
        table.

        Parameters
        ----------
        trajectory
            Other poses to place all frames by, this once. Without it, the session's own.
        """
        if trajectory is not None:
            stairways = self.modeler.stairways(trajectory)
            return assign_drops(self._drop_map.drops(trajectory), stairways)
        if not self._poses.num_placed:
            return ()
        return assign_drops(self._drop_map.drops(self._poses.trajectory()), self._stairways)

    def state(self) -> MapSessionState:
        """Return a copy of everything the session knows, for ``restore`` in this or another process.

        Raises
        ------
        ConfigError
            If the method keeps no state.
        """
        return MapSessionState(
            modeler=self._restorable_modeler().state(),
            stamps_ns=self._poses.stamps_ns,
            map_from_camera=self._poses.map_from_camera,
            ground_views=self._drop_map.table.views.copy(),
            ground_edges=self._drop_map.table.edges.copy(),
        )

    def restore(self, state: MapSessionState) -> None:
        """Replace everything the session knows by a state.

        Raises
        ------
        ValueError
            If its parts do not belong together.
        TrajectoryError
            If its poses are none, or its stamps do not increase.
        ConfigError
            If the method keeps no state.
        """
        modeler = self._restorable_modeler()
        poses = PoseLog.from_arrays(state.stamps_ns, state.map_from_camera)
        ground = GroundTable.from_records(state.ground_views, state.ground_edges)
        modeler.restore(state.modeler)
        self._poses = poses
        self._drop_map = self._make_drop_map(ground)
        self._stairways = ()
        self._num_observations = len(state.modeler.observations)
        self._known = _KnownFlights((), self._num_observations, frames_left=FRAMES_UNTIL_ASKED)

    def _restorable_modeler(self) -> RestorableModeler:
        if not isinstance(self.modeler, RestorableModeler):
            raise ConfigError(
                f"the method {self.method} keeps no state to go on from; use the method {DEFAULT_METHOD}"
            )
        return self.modeler


class _KnownFlights:
    """The flights that frames look at, and when they are to be asked for anew.

    Parameters
    ----------
    flights
        As they were answered.
    num_observations
        How many the session had then.
    frames_left
        Frames until they are asked for anew, whatever they show; ``None`` where only observations count.
    """

    def __init__(
        self, flights: tuple[Flight, ...] = (), num_observations: int = 0, *, frames_left: int | None = None
    ) -> None:
        self.flights = flights
        self._due_at = num_observations + max(MIN_NEW_OBSERVATIONS, NEW_SHARE * num_observations)
        self._frames_left = frames_left

    def is_due(self, num_observations: int) -> bool:
        """Tell with each frame, which is counted, whether to ask for the flights anew."""
        if self._frames_left is not None:
            self._frames_left -= 1
        return num_observations >= self._due_at or self._frames_left == 0


def frame_with_up(frame: DepthFrame, map_from_camera: Transform) -> DepthFrame:
    """Return a frame that knows up: its own, or else the map's z as its (4, 4) pose sees it."""
    if frame.up is not None:
        return frame
    up = map_from_camera[2, :3]
    return DepthFrame(
        stamp_ns=frame.stamp_ns, depth=frame.depth, camera=frame.camera, up=up, up_std=POSE_UP_STD
    )
