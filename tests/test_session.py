"""A session runs every method through one protocol, and refuses what would spoil its map."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from analytic_stairs import AnalyticStairs, pose_looking
from solid_scenes import frame_of, room, stairs_solid
from stairmap.arrays import Float64Array, Transform
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.errors import ConfigError, MapFullError, TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.pipeline import METHODS
from stairmap.session import MAX_OBSERVATIONS, MapSession, MapSessionState
from stairmap.simulation.triangle_mesh import joined
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory

MS = 1_000_000
STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
SCENE = joined([stairs_solid(STAIRS), room()])
# Below the nosings, so that the report's method sees them too.
POSES = [pose_looking((-1.9 + 0.04 * index, 0.1, 0.35), yaw=-0.02, down=-0.05) for index in range(12)]


@pytest.fixture(scope="module")
def frames() -> list[DepthFrame]:
    return [
        frame_of([SCENE], pose, stamp_ns=index * 100 * MS, has_up=False) for index, pose in enumerate(POSES)
    ]


def run(frames: list[DepthFrame], method: str = "stairmap") -> MapSession:
    session = MapSession(Config(), method=method)
    for frame, pose in zip(frames, POSES, strict=False):
        session.add(frame, pose)
    return session


@pytest.mark.parametrize("method", sorted(METHODS))
def test_every_method_models_the_stairway_through_the_same_protocol(
    method: str, frames: list[DepthFrame]
) -> None:
    session = run(frames, method)
    stairways = session.stairways()
    assert len(stairways) == 1
    assert isinstance(stairways[0], Stairway)
    flight = stairways[0].flights[0]
    assert flight.rise == pytest.approx(0.17, abs=0.03)
    assert flight.run == pytest.approx(0.28, abs=0.03)
    assert abs(flight.heading) < 0.1
    again = Stairway.from_dict(json.loads(json.dumps(stairways[0].to_dict(), allow_nan=False)))
    assert again.flights[0].rise == pytest.approx(flight.rise, abs=1e-6)
    assert again.num_observations == stairways[0].num_observations


def test_the_default_method_models_it_to_millimetres(frames: list[DepthFrame]) -> None:
    (stairway,) = run(frames).stairways()
    flight = stairway.flights[0]
    assert (flight.rise, flight.run) == pytest.approx((0.17, 0.28), abs=0.003)
    assert flight.width == pytest.approx(1.2, abs=0.02)
    np.testing.assert_allclose(flight.base, 0.0, atol=0.02)
    assert flight.heading == pytest.approx(0.0, abs=0.01)
    assert flight.num_risers == 8


def test_an_unknown_method_is_a_config_error_that_names_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"nonsense.*delmerico2013.*stairmap"):
        MapSession(method="nonsense")


@pytest.mark.parametrize("method", sorted(METHODS))
def test_frames_without_up_take_it_from_the_pose(method: str, frames: list[DepthFrame]) -> None:
    session = MapSession(method=method)
    with_up = MapSession(method=method)
    for frame, pose in zip(frames[:6], POSES, strict=False):
        assert frame.up is None
        # SLAM with an IMU holds roll and pitch to 0.4 degrees.
        own = replace(frame, up=pose[2, :3], up_std=np.radians(0.4))
        taken, given = session.add(frame, pose), with_up.add(own, pose)
        assert taken.to_dict() == given.to_dict()


def test_up_of_a_frame_is_kept_where_the_pose_says_otherwise(frames: list[DepthFrame]) -> None:
    # A map that is not level: +z of the map is the camera's right.
    frame = frames[-1]
    own = DepthFrame(stamp_ns=0, depth=frame.depth, camera=frame.camera, up=POSES[-1][2, :3])
    lying = np.eye(4)
    lying[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    (observation,) = MapSession().add(own, lying @ POSES[-1]).observations
    assert np.degrees(np.arccos(observation.up @ POSES[-1][2, :3])) < 1.0


def test_a_corrected_trajectory_moves_the_stairway(frames: list[DepthFrame]) -> None:
    session = run(frames)
    shift = np.eye(4)
    shift[:3, 3] = [5.0, -3.0, 0.5]
    moved = Trajectory(
        stamps_ns=session.trajectory().stamps_ns, map_from_camera=[shift @ pose for pose in POSES]
    )
    (here,), (there,) = session.stairways(), session.stairways(moved)
    np.testing.assert_allclose(there.flights[0].base, here.flights[0].base + shift[:3, 3], atol=1e-9)
    assert there.id == here.id


@pytest.mark.parametrize("method", sorted(METHODS))
def test_the_same_frames_twice_give_the_same_json_bit_for_bit(method: str, frames: list[DepthFrame]) -> None:
    def text() -> str:
        return json.dumps([stairway.to_dict() for stairway in run(frames, method).stairways()])

    assert text() == text()


def test_detections_are_returned_frame_by_frame(frames: list[DepthFrame]) -> None:
    session = MapSession()
    for frame, pose in zip(frames, POSES, strict=True):
        detection = session.add(frame, pose, trace=True)
        assert detection.stamp_ns == frame.stamp_ns
        assert detection.trace is not None
    assert len(session.trajectory()) == len(frames)


def test_before_the_first_frame_there_are_no_stairways_and_no_trajectory() -> None:
    session = MapSession()
    assert session.stairways() == ()
    with pytest.raises(TrajectoryError, match="at least one"):
        session.trajectory()


def test_rotating_the_map_moves_the_stairways_likewise(frames: list[DepthFrame]) -> None:
    (here,) = run(frames).stairways()
    yaw = 2.0
    other_from_map = np.eye(4)
    other_from_map[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    other_from_map[:3, 3] = [12.0, 7.0, -2.0]
    session = MapSession()
    for frame, pose in zip(frames, POSES, strict=True):
        session.add(frame, other_from_map @ pose)
    (there,) = session.stairways()
    expected = other_from_map[:3, :3] @ here.flights[0].base + other_from_map[:3, 3]
    np.testing.assert_allclose(there.flights[0].base, expected, atol=1e-4)
    assert there.flights[0].heading == pytest.approx(here.flights[0].heading + yaw, abs=1e-5)
    assert there.flights[0].rise == pytest.approx(here.flights[0].rise, abs=1e-6)


def shifted(pose: Transform, shift: tuple[float, float, float]) -> Transform:
    """A pose in a map whose origin lies elsewhere."""
    moved = np.array(pose)
    moved[:3, 3] += shift
    return moved


def spoiled(change: str) -> Transform:
    """A pose that is none."""
    pose = np.array(POSES[0])
    if change == "nan":
        pose[0, 3] = np.nan
    elif change == "infinite":
        pose[1, 3] = np.inf
    elif change == "scaled":
        pose[:3, :3] *= 1.01
    elif change == "mirrored":
        pose[:3, 0] *= -1.0
    elif change == "transposed":
        pose = pose.T
    elif change == "far":
        pose[2, 3] = 2e7
    else:
        pose = pose[:3]
    return pose


NO_POSES = {
    "nan": "a value that is not finite",
    "infinite": "a value that is not finite",
    "scaled": "columns are not perpendicular and of length 1",
    "mirrored": "a reflection",
    "transposed": "a last row that is not 0 0 0 1",
    "far": "more than 1e.07 m from the map's origin",
    "3x4": r"shape \(4, 4\), map_from_camera, got \(3, 4\)",
}


@pytest.mark.parametrize("change", NO_POSES)
@pytest.mark.parametrize("method", sorted(METHODS))
def test_a_pose_that_is_none_is_refused_and_does_no_harm(
    method: str, change: str, frames: list[DepthFrame]
) -> None:
    session = MapSession(method=method)
    with pytest.raises(TrajectoryError, match=NO_POSES[change]):
        session.add(frames[0], spoiled(change))
    assert session.num_frames == 0
    assert session.stairways() == ()
    session.add(frames[0], POSES[0])
    assert session.num_frames == 1


@pytest.mark.parametrize("change", [change for change in NO_POSES if change != "3x4"])
def test_a_trajectory_with_a_pose_that_is_none_is_refused(change: str) -> None:
    poses = [POSES[0], POSES[1], spoiled(change)]
    with pytest.raises(TrajectoryError, match=rf"pose 3 of 3, at 0\.200000 s, has .*{NO_POSES[change]}"):
        Trajectory(stamps_ns=np.arange(3) * 100 * MS, map_from_camera=np.array(poses))


@pytest.mark.parametrize("deviation", [4e-4, -4e-4])
def test_a_rotation_rounded_to_four_decimals_is_taken(deviation: float, frames: list[DepthFrame]) -> None:
    pose = np.array(POSES[0])
    pose[:3, :3] *= 1.0 + deviation
    session = MapSession()
    session.add(frames[0], pose)
    assert session.num_frames == 1


class NoDetector:
    """Must not be asked."""

    def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
        raise AssertionError(f"the frame at {frame.stamp_ns} ns was looked at")


@pytest.mark.parametrize("second", [0, 1, 2])
def test_a_frame_that_is_not_newer_is_refused_before_it_is_looked_at(
    second: int, frames: list[DepthFrame]
) -> None:
    session = MapSession()
    session.add(frames[2], POSES[2])
    session.detector = NoDetector()
    with pytest.raises(TrajectoryError, match=r"after that at 0\.200000 s .* each once"):
        session.add(frames[second], POSES[second])
    assert session.num_frames == 1
    assert len(session.state().modeler.observations) == 1


def test_detect_leaves_the_map_as_it_is(frames: list[DepthFrame]) -> None:
    session = MapSession()
    detection = session.detect(frames[-1], POSES[-1])
    assert detection
    assert session.num_frames == 0
    session.take(frames[-1], detection, POSES[-1])
    assert session.num_frames == 1
    assert len(session.state().modeler.observations) == 1


def test_frames_without_a_pose_are_placed_by_a_later_trajectory(frames: list[DepthFrame]) -> None:
    session = MapSession()
    for frame in frames:
        session.add(frame, None)
    assert session.stairways() == ()
    with pytest.raises(TrajectoryError, match="at least one"):
        session.trajectory()
    path = run(frames).trajectory()
    (once,) = session.stairways(path)
    assert session.stairways() == ()
    session.correct(path)
    (kept,) = session.stairways()
    np.testing.assert_allclose(kept.flights[0].base, 0.0, atol=0.02)
    assert kept.to_dict() == once.to_dict()


def test_without_a_pose_the_floor_tells_up(frames: list[DepthFrame]) -> None:
    (observation,) = MapSession().add(frames[-1], None).observations
    assert np.degrees(np.arccos(observation.up @ POSES[-1][2, :3])) < 1.5


def test_a_loop_closure_moves_every_frame(frames: list[DepthFrame]) -> None:
    session = run(frames)
    (before,) = session.stairways()
    shift = (5.0, -3.0, 0.5)
    session.correct(
        Trajectory(
            stamps_ns=session.trajectory().stamps_ns,
            map_from_camera=np.array([shifted(pose, shift) for pose in POSES]),
        )
    )
    (after,) = session.stairways()
    np.testing.assert_allclose(after.flights[0].base, before.flights[0].base + shift, atol=1e-9)
    np.testing.assert_allclose(
        session.trajectory().map_from_camera[:, :3, 3], np.array(POSES)[:, :3, 3] + shift
    )


def test_sparse_keyframes_move_the_frames_between_and_after_them(frames: list[DepthFrame]) -> None:
    session = run(frames)
    keys = [2, 8]
    shifts = [(0.0, 0.0, 0.0), (0.6, 0.0, 0.0)]
    path = Trajectory(
        stamps_ns=np.array([frames[key].stamp_ns for key in keys]),
        map_from_camera=np.array([shifted(POSES[key], s) for key, s in zip(keys, shifts, strict=True)]),
    )
    for _ in range(2):
        session.correct(path)
        moved = session.trajectory().map_from_camera[:, 0, 3] - np.array(POSES)[:, 0, 3]
        np.testing.assert_allclose(moved, [0, 0, 0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.6, 0.6, 0.6], atol=1e-12)


def test_a_frame_without_a_pose_moves_no_other(frames: list[DepthFrame]) -> None:
    session = MapSession()
    nothing = Detection(stamp_ns=0, observations=(), rejections=())
    for index, pose in enumerate((None, POSES[1], POSES[2], None)):
        session.take(frames[index], nothing, pose)
    session.correct(
        Trajectory(
            stamps_ns=np.array([frames[index].stamp_ns for index in (0, 1)]),
            map_from_camera=np.array([shifted(POSES[index], (0.0, 0.0, 1.0)) for index in (0, 1)]),
        )
    )
    corrected = session.trajectory()
    assert corrected.stamps_ns.tolist() == [frame.stamp_ns for frame in frames[:3]]
    np.testing.assert_allclose(corrected.map_from_camera[:, 2, 3], np.array(POSES)[:3, 2, 3] + 1.0)


def test_a_path_of_another_time_is_refused(frames: list[DepthFrame]) -> None:
    session = run(frames)
    late = Trajectory(stamps_ns=session.trajectory().stamps_ns + 10**12, map_from_camera=np.array(POSES))
    with pytest.raises(TrajectoryError, match="have the stamp of none of the 12 frames"):
        session.correct(late)
    np.testing.assert_array_equal(session.trajectory().map_from_camera, np.array(POSES))


def test_a_path_before_the_first_frame_is_refused() -> None:
    with pytest.raises(TrajectoryError, match="none of the 0 frames"):
        MapSession().correct(Trajectory(stamps_ns=np.array([1]), map_from_camera=np.eye(4)[None]))


def test_a_restored_session_goes_on_where_the_other_stopped(frames: list[DepthFrame]) -> None:
    first, second, whole = MapSession(), MapSession(), run(frames)
    for frame, pose in zip(frames[:7], POSES, strict=False):
        first.add(frame, pose)
    first.stairways()
    second.restore(pickle.loads(pickle.dumps(first.state())))
    for frame, pose in zip(frames[7:], POSES[7:], strict=True):
        second.add(frame, pose)
    assert [s.to_dict() for s in second.stairways()] == [s.to_dict() for s in whole.stairways()]
    assert second.num_frames == 12
    with pytest.raises(TrajectoryError, match="after that at"):
        second.add(frames[0], POSES[0])


def test_a_state_keeps_which_frames_have_no_pose(frames: list[DepthFrame]) -> None:
    first, second = MapSession(), MapSession()
    first.add(frames[0], None)
    first.add(frames[1], POSES[1])
    second.restore(first.state())
    assert second.num_frames == 2
    assert second.trajectory().stamps_ns.tolist() == [frames[1].stamp_ns]


def test_a_state_is_a_copy(frames: list[DepthFrame]) -> None:
    session = MapSession()
    session.add(frames[0], POSES[0])
    state = session.state()
    session.add(frames[1], POSES[1])
    assert len(state.stamps_ns) == len(state.map_from_camera) == 1


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"map_from_camera": np.eye(4)[None]}, ValueError, "2 stamps have 1 poses"),
        ({"stamps_ns": np.array([5, 5])}, TrajectoryError, "stamps that increase"),
        ({"map_from_camera": 2 * np.array(POSES[:2])}, TrajectoryError, "pose 1 of 2"),
    ],
)
def test_a_damaged_state_is_refused_and_does_no_harm(
    change: dict[str, Float64Array], error: type[Exception], message: str, frames: list[DepthFrame]
) -> None:
    session = MapSession()
    for frame, pose in zip(frames[:2], POSES, strict=False):
        session.add(frame, pose)
    with pytest.raises(error, match=message):
        session.restore(replace(session.state(), **change))
    assert session.num_frames == 2


def test_the_reports_method_keeps_no_state() -> None:
    session = MapSession(method="delmerico2013")
    assert not session.is_restorable
    assert MapSession().is_restorable
    with pytest.raises(ConfigError, match=r"delmerico2013 keeps no state.*use the method stairmap"):
        session.state()


def test_the_trajectory_grows_with_the_frames(frames: list[DepthFrame]) -> None:
    session = MapSession()
    nothing = Detection(stamp_ns=0, observations=(), rejections=())
    for index in range(200):
        frame = replace(frames[0], stamp_ns=index * 100 * MS)
        session.take(frame, nothing, shifted(POSES[0], (0.01 * index, 0.0, 0.0)))
        assert len(session.trajectory()) == index + 1
    np.testing.assert_allclose(np.diff(session.trajectory().map_from_camera[:, 0, 3]), 0.01)


def repeated(state: MapSessionState, num_observations: int) -> MapSessionState:
    """A state whose observations come again and again, in frames of their own."""
    once, edges = state.modeler.observations, state.modeler.edges
    rounds = -(-num_observations // len(once))
    observations, all_edges = np.tile(once, rounds), np.tile(edges, rounds)
    observations["stamp_ns"] = np.arange(len(observations)) * 100 * MS
    all_edges["observation"] += np.repeat(np.arange(rounds) * len(once), len(edges))
    modeler = replace(
        state.modeler,
        observations=observations,
        edges=all_edges,
        ids=np.zeros(len(observations), dtype=np.int64),
    )
    return MapSessionState(
        modeler=modeler,
        stamps_ns=observations["stamp_ns"],
        map_from_camera=np.tile(state.map_from_camera, (rounds, 1, 1)),
    )


def test_a_map_of_many_observations_gives_what_a_small_one_gives(frames: list[DepthFrame]) -> None:
    small, large = run(frames), MapSession()
    state = small.state()
    assert len(state.modeler.observations) == len(frames)
    large.restore(repeated(state, 24_000))
    (one,), (many,) = small.stairways(), large.stairways()
    assert many.num_observations == 24_000
    assert many.flights[0].num_risers == one.flights[0].num_risers
    assert many.flights[0].rise == pytest.approx(one.flights[0].rise, abs=1e-3)
    np.testing.assert_allclose(many.flights[0].base, one.flights[0].base, atol=2e-3)


def test_a_full_map_refuses_what_it_cannot_take_and_says_what_to_do(frames: list[DepthFrame]) -> None:
    session = run(frames[:1])
    state = session.state()
    observations = np.repeat(state.modeler.observations[:1], MAX_OBSERVATIONS - 1)
    edges = np.repeat(state.modeler.edges[:1], len(observations))
    edges["observation"] = np.arange(len(observations))
    ids = np.zeros(len(observations), dtype=np.int64)
    full = replace(state.modeler, observations=observations, edges=edges, ids=ids)
    session.restore(replace(state, modeler=full))
    session.add(frames[1], POSES[1])
    with pytest.raises(MapFullError, match=r"holds 1,000,000 observations.*begin a new session"):
        session.add(frames[2], POSES[2])
    assert session.num_frames == 2
    nothing = Detection(stamp_ns=frames[2].stamp_ns, observations=(), rejections=())
    session.take(frames[2], nothing, POSES[2])
    assert session.num_frames == 3
