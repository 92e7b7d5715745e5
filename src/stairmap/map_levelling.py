"""Turn a map that is not level: where is up, as the floor says in frames spread over a recording?

Visual SLAM starts its map in the first camera's coordinate frame, tilted as that camera was. Each
frame that shows the floor tells up in the camera frame, its pose turns that into the map, and
frames that see something else level, or a ramp, are outvoted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Transform
from stairmap.config import Config
from stairmap.detection.inverse_depth import fit_surface_normals, inverse_depth_from_frame
from stairmap.detection.orientation import estimate_up
from stairmap.errors import TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.geometry import normalized
from stairmap.recordings.base import Recording
from stairmap.recordings.map_up import UP_AUTO, turned_trajectory
from stairmap.trajectory import Trajectory
from stairmap.transforms import rotation_between, transform_from_parts

NUM_FRAMES_ASKED = 30
"""About so many frames are asked for the floor, spread evenly over the recording."""

MAX_DISAGREEMENT_DEG = 10.0
"""A frame whose up is farther from the others', deg, saw no floor."""

MIN_SHARE = 0.5
"""Share of the frames with a floor that must agree."""

MIN_AGREEING = 3
"""Fewest frames that must agree, or all that were asked if they are fewer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapLevelling:
    """How a map is to be turned so that z points up.

    Attributes
    ----------
    map_from_recorded
        (4, 4) smallest turn of the poses' coordinate frame into the level map.
    num_asked, num_with_floor, num_agreeing
        Frames looked at, those in which a floor was found, and those of them that agree.
    spread
        Median angle of the agreeing frames to their mean, rad.
    """

    map_from_recorded: Transform
    num_asked: int
    num_with_floor: int
    num_agreeing: int
    spread: float

    @property
    def angle(self) -> float:
        """Angle by which the map is turned, rad."""
        return float(np.arccos(np.clip(self.map_from_recorded[2, 2], -1.0, 1.0)))

    def __str__(self) -> str:
        return (
            f"the map was turned by {np.degrees(self.angle):.1f} deg so that z is up, as the floor in "
            f"{self.num_agreeing} of {self.num_asked} frames says (they agree within "
            f"{np.degrees(self.spread):.1f} deg, median); all results are in the turned map"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelMap:
    """Poses in a map with z up.

    Attributes
    ----------
    trajectory
        ``map_from_camera``.
    map_from_recorded
        (4, 4) turn of the coordinate frame of the poses as recorded.
    note
        A sentence about that turn; ``None`` without one.
    is_by_floor
        Whether the floor told which way is up.
    """

    trajectory: Trajectory
    map_from_recorded: Transform
    note: str | None
    is_by_floor: bool = False


def find_level_map(
    recording: Recording, up: str | None = None, *, max_depth: float | None = None
) -> LevelMap:
    """Return the poses of a recording in a map with z up.

    Parameters
    ----------
    recording
        Opened with the same ``up``.
    up
        Which axis of the poses' coordinate frame points up, as given to ``open_recording``; ``auto``: found
        from the floor.
    max_depth
        Farthest depth at which the floor is looked for, m; if not given, that of the default configuration.

    Raises
    ------
    TrajectoryError
        If there are no poses, or up must come from the floor and no floor is seen.
    """
    trajectory = recording.check_poses()
    turn = recording.map_from_recorded
    if up == UP_AUTO:
        depth = Config().detection.max_depth if max_depth is None else max_depth
        levelling = find_map_levelling(recording, trajectory, max_depth=depth)
        return LevelMap(
            trajectory=turned_trajectory(levelling.map_from_recorded, trajectory),
            map_from_recorded=levelling.map_from_recorded @ turn,
            note=str(levelling),
            is_by_floor=True,
        )
    is_turned = not np.array_equal(turn, np.eye(4))
    note = f"the map was turned so that its {up} axis is z; all results are in the turned map"
    return LevelMap(trajectory=trajectory, map_from_recorded=turn, note=note if is_turned else None)


def find_map_levelling(recording: Recording, trajectory: Trajectory, *, max_depth: float) -> MapLevelling:
    """Find how to turn a map so that z points up.

    Parameters
    ----------
    recording
        Its frames' own ``up`` is not used.
    trajectory
        ``map_from_camera`` in the map as recorded.
    max_depth
        Farthest depth that is used, m.

    Raises
    ------
    TrajectoryError
        If too few frames show a floor, or they do not agree; the message says how many.
    """
    stride = max(1, recording.num_frames // NUM_FRAMES_ASKED)
    ups: list[Float64Array] = []
    num_asked = 0
    for index, frame in enumerate(recording):
        if index % stride or not trajectory.has_pose(np.array([frame.stamp_ns]))[0]:
            continue
        num_asked += 1
        up = estimate_map_up(frame, trajectory, max_depth=max_depth)
        if up is not None:
            ups.append(up)
    return levelling_from_ups(np.array(ups).reshape(-1, 3), num_asked=num_asked)


def estimate_map_up(frame: DepthFrame, trajectory: Trajectory, *, max_depth: float) -> Float64Array | None:
    """Estimate the (3,) unit vector in the map that points up by the floor of a frame with a pose."""
    up = estimate_up(fit_surface_normals(inverse_depth_from_frame(frame, max_depth=max_depth)))
    return None if up is None else np.asarray(trajectory.pose_at(frame.stamp_ns)[:3, :3] @ up)


def levelling_from_ups(ups: Float64Array, *, num_asked: int) -> MapLevelling:
    """Average what single frames say is up, without those that disagree with most.

    Parameters
    ----------
    ups
        (N, 3) unit vectors, map as recorded.
    num_asked
        How many frames were asked.

    Raises
    ------
    TrajectoryError
        If fewer than three, or fewer than half, of them lie within 10 degrees of their middle.
    """
    needed = max(min(MIN_AGREEING, num_asked), int(np.ceil(MIN_SHARE * len(ups))), 1)
    is_near = np.zeros(len(ups), dtype=np.bool_)
    if len(ups):
        min_cosine = np.cos(np.radians(MAX_DISAGREEMENT_DEG))
        cosines = ups @ ups.T
        # The frame that most others support begins; the mean of these then stands in for it.
        middle = normalized(
            ups[cosines[int(np.argmax((cosines > min_cosine).sum(axis=1)))] > min_cosine].mean(0)
        )
        is_near = ups @ middle > min_cosine
    num_agreeing = int(np.count_nonzero(is_near))
    if num_agreeing < needed:
        raise TrajectoryError(
            f"--up auto: expected at least {needed} frames that agree which way is up within "
            f"{MAX_DISAGREEMENT_DEG:g} deg, but of {num_asked} frames {len(ups)} show a floor and "
            f"{num_agreeing} agree; name the axis of the map that points up, such as --up=-y"
        )
    up = normalized(ups[is_near].mean(axis=0))
    angles = np.arccos(np.clip(ups[is_near] @ up, -1.0, 1.0))
    return MapLevelling(
        map_from_recorded=transform_from_parts(rotation_between(up, np.array([0.0, 0.0, 1.0])), np.zeros(3)),
        num_asked=num_asked,
        num_with_floor=len(ups),
        num_agreeing=num_agreeing,
        spread=float(np.median(angles)),
    )
