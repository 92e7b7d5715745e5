"""Poses of the depth camera from what a bag says: transforms, odometry or stamped poses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import IntArray, Transform
from stairmap.errors import TrajectoryError, TransformLookupError, TransformProblem
from stairmap.recordings.bags.scan import PoseTopic, ScannedStretch
from stairmap.recordings.bags.transform_intake import TransformIntake, guess_map_frame
from stairmap.recordings.transform_history import MAX_TRANSFORM_GAP_NS
from stairmap.trajectory import Trajectory

LookUp = Callable[[int], Transform]
"""Gives ``map_from_camera`` at a stamp, or raises TransformLookupError."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BagPoses:
    """Poses of a bag's depth images.

    Attributes
    ----------
    trajectory
        ``map_from_camera`` at the stamps of the images that have a pose; ``None`` if none has.
    frame_id
        Coordinate frame of the map.
    source
        Where the poses come from, for a person.
    problem
        Why images have no pose: the first refusal of a lookup, or what is missing altogether.
    notes
        What looks strange, one sentence each.
    """

    trajectory: Trajectory | None
    frame_id: str
    source: str
    problem: str | None
    notes: tuple[str, ...] = ()


def find_bag_poses(
    stretch: ScannedStretch,
    *,
    pose_topic: str | None,
    is_transform_topic: bool,
    map_frame: str | None,
    stamps_ns: IntArray | None = None,
) -> BagPoses:
    """Find poses in what a bag says.

    Parameters
    ----------
    stretch
        What was read.
    pose_topic
        What the user chose; if nothing, transforms are preferred to odometry, and that to stamped poses.
    is_transform_topic
        Whether the topic that the user chose is one of transforms.
    map_frame
        What the user says the map's coordinate frame is.
    stamps_ns
        (N,) increasing stamps at which poses are wanted; those of the images if not given.

    Raises
    ------
    TrajectoryError
        If the user's coordinate frame is not there; the message lists those that are.
    """
    intake = stretch.intake
    stamps_ns = stretch.stamps_ns if stamps_ns is None else stamps_ns
    notes = list(intake.buffer.notes)
    if intake.num_invalid:
        notes.append(f"{intake.num_invalid} transforms are not used: their quaternion is not of unit length")
    if pose_topic is not None and not is_transform_topic:
        return _from_pose_topic(stretch, stamps_ns, pose_topic, map_frame, notes)
    frame = map_frame or guess_map_frame(intake)
    if map_frame is not None and map_frame.lstrip("/") not in intake.coordinate_frames:
        raise TrajectoryError(
            f"--map-frame {map_frame}: there is no such coordinate frame; {_describe_frames(intake)}"
        )
    if frame is not None:
        frame = frame.lstrip("/")
        map_lookup = _guarded_lookup(stretch, frame)
        return _look_up_all(stamps_ns, map_lookup, frame, f"transforms, {frame} to {intake.source}", notes)
    candidates = [name for name, poses in stretch.pose_topics.items() if len(poses.history)]
    named = [name for name in candidates if stretch.pose_topics[name].child]
    best = named or candidates
    if len(best) == 1:
        return _from_pose_topic(stretch, stamps_ns, best[0], None, notes)
    return _without_poses(_describe_missing(stretch, best), notes)


def _without_poses(problem: str, notes: list[str]) -> BagPoses:
    return BagPoses(trajectory=None, frame_id="map", source="none", problem=problem, notes=tuple(notes))


def _describe_frames(intake: TransformIntake) -> str:
    names = intake.coordinate_frames
    if not names:
        return "the bag has no transforms"
    missing = "" if intake.has_static else ", and there is no /tf_static"
    return f"the coordinate frames are: {', '.join(names)}{missing}"


def _guarded_lookup(stretch: ScannedStretch, frame: str) -> LookUp:
    intake = stretch.intake

    def look_up(stamp_ns: int) -> Transform:
        return intake.buffer.lookup(frame, intake.source, stamp_ns)

    return look_up


def _from_pose_topic(
    stretch: ScannedStretch, stamps_ns: IntArray, topic: str, map_frame: str | None, notes: list[str]
) -> BagPoses:
    poses = stretch.pose_topics.get(topic, PoseTopic())
    intake = stretch.intake
    if map_frame is not None and map_frame.lstrip("/") != poses.parent:
        raise TrajectoryError(
            f"--map-frame {map_frame}: the poses of {topic} are in the coordinate frame '{poses.parent}'; "
            "leave one of --pose-topic and --map-frame out"
        )
    child = poses.child
    if not child:
        child = intake.static_root()
        notes.append(f"{topic} does not say whose poses it has; they are taken for those of {child}")
    if child != intake.source and not {child, intake.source} <= {*intake.coordinate_frames}:
        return _without_poses(
            f"{topic} has poses of {child}, but no transform tells where on it the camera "
            f"({intake.source or 'not named'}) is; {_describe_frames(intake)}",
            notes,
        )
    if poses.num_invalid:
        notes.append(
            f"{topic}: {poses.num_invalid} poses are not used: their quaternion is not of unit length"
        )

    def look_up(stamp_ns: int) -> Transform:
        found = poses.history.at(stamp_ns, max_gap_ns=MAX_TRANSFORM_GAP_NS) if len(poses.history) else None
        if found is None:
            raise TransformLookupError(f"{topic} has no poses", TransformProblem.NOT_CONNECTED)
        if isinstance(found, TransformProblem):
            raise TransformLookupError(
                f"{topic} has no pose at {stamp_ns * 1e-9:.3f} s ({found.value.replace('_', ' ')})", found
            )
        if child == intake.source:
            return found
        return np.asarray(found @ intake.buffer.lookup(child, intake.source, stamp_ns))

    source = f"{topic}, {poses.parent or 'map'} to {child}"
    return _look_up_all(stamps_ns, look_up, poses.parent or "map", source, notes)


def _look_up_all(
    wanted_ns: IntArray, look_up: LookUp, frame_id: str, source: str, notes: list[str]
) -> BagPoses:
    stamps_ns, found = [], []
    problem: str | None = None
    for stamp_ns in wanted_ns.tolist():
        try:
            pose = look_up(stamp_ns)
        except TransformLookupError as error:
            problem = problem or str(error)
            if error.problem in {TransformProblem.UNKNOWN_FRAME, TransformProblem.NOT_CONNECTED}:
                problem = str(error)
                break
            continue
        stamps_ns.append(stamp_ns)
        found.append(pose)
    trajectory = None
    if found:
        trajectory = Trajectory(stamps_ns=np.array(stamps_ns), map_from_camera=np.array(found))
    return BagPoses(
        trajectory=trajectory, frame_id=frame_id, source=source, problem=problem, notes=tuple(notes)
    )


def _describe_missing(stretch: ScannedStretch, candidates: list[str]) -> str:
    intake = stretch.intake
    if len(candidates) > 1:
        return f"several topics have poses: {', '.join(candidates)}; pass one of them with --pose-topic"
    if not intake.coordinate_frames:
        return "the bag has neither transforms nor odometry nor stamped poses"
    if not intake.source:
        return "the depth images name no coordinate frame, so transforms do not tell where the camera was"
    if intake.source not in intake.coordinate_frames:
        return (
            f"no transform names the depth images' coordinate frame {intake.source}; "
            f"{_describe_frames(intake)}"
        )
    return (
        f"{intake.source} is fixed to {intake.ancestors()[-1]}, and nothing tells where that moves; "
        f"{_describe_frames(intake)}"
    )
