"""The node's map: it grows with places and not with time, moves with corrections, and outlives the node."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ideal_observations import assert_is_flight, make_flight, observe, poses_before
from stairmap.arrays import Float64Array, Transform
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.errors import StairmapError, TrajectoryError
from stairmap.export.loading import load_stairways
from stairmap.frame import DepthFrame
from stairmap.modeling.look_table import MAX_SUPPORT, NUM_VIEWS
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap.transforms import rotation_from_vector, transform_from_parts
from stairmap_ros.map_file import check_map_file, load_map, save_map
from stairmap_ros.map_file_lock import MapFileError
from stairmap_ros.path_corrections import PathCorrections, trajectory_from_path
from stairmap_ros.stairway_map import StairwayMap

FLIGHT = make_flight()
POSES = poses_before(FLIGHT, 12)
PERIOD_NS = 33_000_000
WIDE_CAMERA = PinholeCamera(width=80, height=60, fx=60.0, fy=60.0, cx=39.5, cy=29.5)
CAMERA = PinholeCamera(width=8, height=8, fx=8.0, fy=8.0, cx=3.5, cy=3.5)


def new_map(*, views_per_place: int = 10) -> StairwayMap:
    return StairwayMap(Config(), method="stairmap", views_per_place=views_per_place)


def show(stairway_map: StairwayMap, map_from_camera: Transform, stamp_ns: int) -> None:
    """Add what an ideal detector sees of the flight from a pose."""
    observation = observe(FLIGHT, map_from_camera, stairway_map.viewpoints.next_index_stamp_ns)
    detection = Detection(stamp_ns=observation.stamp_ns, observations=(observation,), rejections=())
    stairway_map.add(blank_frame(stairway_map), detection, stamp_ns, map_from_camera)


def blank_frame(stairway_map: StairwayMap) -> DepthFrame:
    """The next image of the map, with nothing measured in it."""
    return stairway_map.frame(np.full((8, 8), np.nan, dtype=np.float32), CAMERA)


def show_nothing(stairway_map: StairwayMap, map_from_camera: Transform) -> None:
    """Add an image that sees through where the flight was, to a wall 10 m away."""
    frame = stairway_map.frame(np.full((60, 80), 10.0, dtype=np.float32), WIDE_CAMERA)
    nothing = Detection(stamp_ns=frame.stamp_ns, observations=(), rejections=())
    stairway_map.add(frame, nothing, frame.stamp_ns, map_from_camera)


def shown_map(poses: Float64Array = POSES, first_ns: int = 0) -> StairwayMap:
    stairway_map = new_map(views_per_place=100)
    for index, pose in enumerate(poses):
        show(stairway_map, pose, first_ns + index * PERIOD_NS)
    return stairway_map


def test_stairways_carry_the_stamps_of_the_images() -> None:
    (stairway,) = shown_map(first_ns=5_000).stairways()
    assert_is_flight(stairway.flights[0], FLIGHT)
    assert (stairway.first_seen_ns, stairway.last_seen_ns) == (5_000, 5_000 + 11 * PERIOD_NS)


def test_a_clock_that_starts_again_does_no_harm() -> None:
    stairway_map = shown_map(first_ns=10**18)
    for index, pose in enumerate(POSES):
        show(stairway_map, pose, index * PERIOD_NS)
    (stairway,) = stairway_map.stairways()
    assert stairway.num_observations == 24
    assert_is_flight(stairway.flights[0], FLIGHT)


def test_a_robot_that_waits_does_not_fill_the_memory() -> None:
    stairway_map = new_map(views_per_place=4)
    for index in range(100):
        show(stairway_map, POSES[0], index * PERIOD_NS)
    assert len(stairway_map.viewpoints) == 4
    show(stairway_map, POSES[-1], 101 * PERIOD_NS)
    assert len(stairway_map.viewpoints) == 5


def test_images_without_stair_edges_do_not_enter_the_map() -> None:
    stairway_map = new_map()
    nothing = Detection(stamp_ns=0, observations=(), rejections=())
    stairway_map.add(blank_frame(stairway_map), nothing, 0, POSES[0])
    assert len(stairway_map.viewpoints) == 0
    assert stairway_map.stairways() == ()


def test_stairs_that_images_miss_are_withdrawn_and_come_back_at_the_same_place() -> None:
    stairway_map = new_map(views_per_place=NUM_VIEWS)
    for _ in range(NUM_VIEWS + 5):
        show(stairway_map, POSES[0], 0)
    assert len(stairway_map.viewpoints) == NUM_VIEWS
    assert len(asked(stairway_map)) == 1
    for _ in range(NUM_VIEWS + 5):
        show_nothing(stairway_map, POSES[0])
        asked(stairway_map)
    # Those that were withdrawn are not looked at any more.
    assert asked(stairway_map) == ()
    assert len(stairway_map.viewpoints) == 2 * NUM_VIEWS - MAX_SUPPORT
    for _ in range(MAX_SUPPORT + 1):
        show(stairway_map, POSES[0], 0)
    assert len(asked(stairway_map)) == 1


def test_images_that_miss_stairs_from_one_place_do_not_fill_the_memory() -> None:
    stairway_map = new_map(views_per_place=4)
    for pose in POSES:
        show(stairway_map, pose, 0)
    num_shown = len(stairway_map.viewpoints)
    for _ in range(50):
        asked(stairway_map)
        show_nothing(stairway_map, POSES[3])
    assert len(stairway_map.viewpoints) == num_shown + 4


def test_a_restored_map_knows_what_was_missed(tmp_path: Path) -> None:
    first = shown_map()
    asked(first)
    for pose in POSES:
        show_nothing(first, pose)
    assert len(first.viewpoints) == 24
    save_map(tmp_path / "map.npz", first.snapshot(), map_frame="map")
    second = new_map()
    assert load_map(tmp_path / "map.npz", second, map_frame="map") == 24
    assert len(asked(second)) == 1
    for pose in POSES[: NUM_VIEWS - MAX_SUPPORT - 12]:
        show_nothing(second, pose)
    assert asked(second) == ()


def test_a_restored_map_knows_the_places_from_which_stairs_were_missed(tmp_path: Path) -> None:
    first = shown_map()
    asked(first)
    for _ in range(4):
        show_nothing(first, POSES[3])
    save_map(tmp_path / "map.npz", first.snapshot(), map_frame="map")
    second = new_map(views_per_place=4)
    load_map(tmp_path / "map.npz", second, map_frame="map")
    asked(second)
    show_nothing(second, POSES[3])
    assert len(second.viewpoints) == 16
    show_nothing(second, POSES[8])
    assert len(second.viewpoints) == 17


def test_a_map_with_an_image_that_shows_nothing_is_refused(tmp_path: Path) -> None:
    save_map(tmp_path / "map.npz", shown_map().snapshot(), map_frame="map")
    arrays = dict(np.load(tmp_path / "map.npz"))
    arrays["map_from_camera"] = np.concatenate([arrays["map_from_camera"], POSES[:1]])
    np.savez(tmp_path / "map.npz", **arrays)
    with pytest.raises(MapFileError, match="images that show nothing of the map"):
        load_map(tmp_path / "map.npz", new_map(), map_frame="map")


def asked(stairway_map: StairwayMap) -> tuple[Stairway, ...]:
    """The stairways, without waiting for the share of time that may go into asking."""
    stairway_map._next_query = 0.0
    return stairway_map.stairways()


def test_a_map_goes_on_from_its_file(tmp_path: Path) -> None:
    first = shown_map()
    before = first.stairways()
    save_map(tmp_path / "map.npz", first.snapshot(), map_frame="map")
    second = new_map()
    assert load_map(tmp_path / "map.npz", second, map_frame="map") == 12
    assert [s.to_dict() for s in second.stairways()] == [s.to_dict() for s in before]
    loaded = load_stairways(tmp_path / "map.json")
    assert (loaded.frame_id, loaded.num_frames) == ("map", 12)
    assert [s.to_dict() for s in loaded.stairways] == [s.to_dict() for s in before]
    assert sorted(file.name for file in tmp_path.iterdir()) == ["map.json", "map.npz"]


def test_a_restored_map_knows_the_places_it_was_seen_from(tmp_path: Path) -> None:
    first = new_map(views_per_place=4)
    for index in range(4):
        show(first, POSES[0], index)
    save_map(tmp_path / "map.npz", first.snapshot(), map_frame="map")
    second = new_map(views_per_place=4)
    load_map(tmp_path / "map.npz", second, map_frame="map")
    show(second, POSES[0], 10)
    assert len(second.viewpoints) == 4


def test_no_file_yet_is_an_empty_map(tmp_path: Path) -> None:
    assert load_map(tmp_path / "map.npz", new_map(), map_frame="map") == 0


def test_a_file_of_another_coordinate_frame_is_refused(tmp_path: Path) -> None:
    save_map(tmp_path / "map.npz", shown_map().snapshot(), map_frame="map")
    with pytest.raises(MapFileError, match="made in the coordinate frame 'map', map_frame is now 'odom'"):
        load_map(tmp_path / "map.npz", new_map(), map_frame="odom")


@pytest.mark.parametrize("size", [0, 10, 3000])
def test_a_damaged_file_is_refused(tmp_path: Path, size: int) -> None:
    save_map(tmp_path / "map.npz", shown_map().snapshot(), map_frame="map")
    whole = (tmp_path / "map.npz").read_bytes()
    (tmp_path / "map.npz").write_bytes(whole[:size])
    with pytest.raises(MapFileError, match="move it away to start anew"):
        load_map(tmp_path / "map.npz", new_map(), map_frame="map")


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "map.npz").open("wb") as file:
        np.save(file, np.zeros(3))
    with pytest.raises(MapFileError, match="move it away to start anew"):
        load_map(tmp_path / "map.npz", new_map(), map_frame="map")


def test_a_file_with_a_pose_that_is_none_is_refused(tmp_path: Path) -> None:
    save_map(tmp_path / "map.npz", shown_map().snapshot(), map_frame="map")
    arrays = dict(np.load(tmp_path / "map.npz"))
    arrays["map_from_camera"][3] = np.inf
    np.savez(tmp_path / "map.npz", **arrays)
    with pytest.raises(MapFileError, match=r"pose 4 of 12.*not finite.*move it away to start anew"):
        load_map(tmp_path / "map.npz", new_map(), map_frame="map")


def test_a_path_with_a_pose_that_is_none_is_refused() -> None:
    pose = SimpleNamespace(
        position=SimpleNamespace(x=float("nan"), y=0.0, z=0.0),
        orientation=SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0),
    )
    header = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=0))
    path = SimpleNamespace(poses=[SimpleNamespace(header=header, pose=pose)])
    with pytest.raises(TrajectoryError, match="pose 1 of the path has a value that is not finite"):
        trajectory_from_path(path)


def test_a_map_file_needs_the_default_method(tmp_path: Path) -> None:
    other = StairwayMap(Config(), method="delmerico2013", views_per_place=10)
    with pytest.raises(StairmapError, match="map_file needs method: stairmap"):
        other.snapshot()


def test_the_name_of_a_map_file_is_checked(tmp_path: Path) -> None:
    assert check_map_file("") is None
    assert check_map_file(str(tmp_path / "map.npz")) == tmp_path / "map.npz"
    with pytest.raises(MapFileError, match=r"must end in \.npz"):
        check_map_file("map.json")


def test_a_corrected_path_moves_what_was_seen_on_it() -> None:
    """TF drifts along the way; SLAM then says where the robot really was."""
    drifts = [drift(index) for index in range(len(POSES))]
    seen = np.array([d @ pose for d, pose in zip(drifts, POSES, strict=True)])
    stairway_map = new_map(views_per_place=100)
    corrections = PathCorrections(first=0)
    for index, pose in enumerate(seen):
        observation_pose = POSES[index]
        observation = observe(FLIGHT, observation_pose, stairway_map.viewpoints.next_index_stamp_ns)
        detection = Detection(stamp_ns=observation.stamp_ns, observations=(observation,), rejections=())
        stairway_map.add(blank_frame(stairway_map), detection, index * PERIOD_NS, pose)
        corrections.add(index * PERIOD_NS, pose)
    path = Trajectory(stamps_ns=np.arange(len(POSES)) * PERIOD_NS, map_from_camera=np.array(POSES))
    for _ in range(2):
        stairway_map.correct(
            *corrections.corrected(path, stairway_map.viewpoints.stamps_ns, stairway_map.poses)
        )
        np.testing.assert_allclose(stairway_map.poses, POSES, atol=2e-3)
    (stairway,) = stairway_map.stairways()
    np.testing.assert_allclose(stairway.flights[0].base, FLIGHT.base, atol=5e-3)


def drift(index: int) -> Transform:
    return transform_from_parts(rotation_from_vector([0, 0, 0.004 * index]), [0.02 * index, -0.01 * index, 0])


def test_viewpoints_of_an_earlier_session_stay_where_they_are() -> None:
    stairway_map = shown_map()
    corrections = PathCorrections(first=len(stairway_map.viewpoints))
    lifted = transform_from_parts(np.eye(3), [0, 0, 1.0])
    for index, pose in enumerate(POSES):
        show(stairway_map, pose, index * PERIOD_NS)
        corrections.add(index * PERIOD_NS, pose)
    path = Trajectory(stamps_ns=np.arange(12) * PERIOD_NS, map_from_camera=lifted @ np.array(POSES))
    stairway_map.correct(*corrections.corrected(path, stairway_map.viewpoints.stamps_ns, stairway_map.poses))
    np.testing.assert_allclose(stairway_map.poses[:12], POSES)
    np.testing.assert_allclose(stairway_map.poses[12:], lifted @ np.array(POSES), atol=1e-9)


def test_a_path_of_another_time_is_refused() -> None:
    stairway_map = shown_map()
    corrections = PathCorrections(first=0)
    for index, pose in enumerate(POSES):
        corrections.add(index * PERIOD_NS, pose)
    path = Trajectory(stamps_ns=np.array([10**15, 10**15 + 1]), map_from_camera=np.array(POSES[:2]))
    with pytest.raises(TrajectoryError, match="no stamp of the path lies in the time"):
        corrections.corrected(path, stairway_map.viewpoints.stamps_ns, stairway_map.poses)
