"""The commonest mistakes of poses are told, with the option that mends them; right poses are not doubted."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from command_line import check_refused, stairmap
from stairmap.arrays import Float64Array
from stairmap.errors import RecordingError
from stairmap.pose_mistakes import PoseWatch
from stairmap.recordings.open import open_recording
from stairmap.recordings.pose_format import BODY_FROM_OPTICAL, check_pose_format, poses_from_format
from stairmap.recordings.tum_trajectory import dump_tum_trajectory, load_tum_trajectory
from stairmap.trajectory import Trajectory
from stairmap.transforms import (
    invert_transform,
    invert_transforms,
    quat_from_rotation,
    rotation_from_quat,
    transform_from_parts,
)

TRUE_RISE_MM = 170


def in_order_wxyz(poses: Float64Array) -> Float64Array:
    """Poses as they are read from a file whose quaternions are qw qx qy qz."""
    quats = np.array([quat_from_rotation(pose[:3, :3]) for pose in poses])
    spoilt = poses.copy()
    spoilt[:, :3, :3] = rotation_from_quat(quats[:, [3, 0, 1, 2]])
    return spoilt


def in_millimetres(poses: Float64Array) -> Float64Array:
    spoilt = poses.copy()
    spoilt[:, :3, 3] *= 1000.0
    return spoilt


def of_the_body(poses: Float64Array) -> Float64Array:
    return np.asarray(poses @ invert_transform(BODY_FROM_OPTICAL))


def with_y_up(poses: Float64Array) -> Float64Array:
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return np.asarray(transform_from_parts(turn, np.zeros(3)) @ poses)


MISTAKES: dict[str, tuple[Callable[[Float64Array], Float64Array], str]] = {
    "quaternions as w, x, y, z": (in_order_wxyz, "--pose-format wxyz"),
    "millimetres": (in_millimetres, "--pose-format mm"),
    "inverse poses": (invert_transforms, "--pose-format inverse"),
    "poses of the body": (of_the_body, "--pose-format body"),
    "z not up": (with_y_up, "--up=+y"),
}


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("embreex", reason="needs the extra sim")
    folder = tmp_path_factory.mktemp("drives") / "drive"
    outcome = stairmap(
        "simulate", "free_standing", "-o", folder, "--factor", "0.5", "--frames", "24", "--seed", "1"
    )
    assert outcome.code == 0, outcome.stderr
    return folder


def spoil(drive: Path, folder: Path, change: Callable[[Float64Array], Float64Array]) -> Path:
    shutil.copytree(drive, folder)
    poses = load_tum_trajectory(drive / "groundtruth.txt")
    spoilt = Trajectory(stamps_ns=poses.stamps_ns, map_from_camera=change(poses.map_from_camera))
    dump_tum_trajectory(folder / "groundtruth.txt", spoilt)
    return folder


def told(text: str) -> list[str]:
    """The options that a text tells to pass."""
    return re.findall(r"pass (--pose-format \w+|--up=\S+)", text)


@pytest.mark.parametrize("name", MISTAKES)
def test_mistake_is_told_and_the_option_mends_it(name: str, drive: Path, tmp_path: Path) -> None:
    change, option = MISTAKES[name]
    folder = spoil(drive, tmp_path / "drive", change)
    assert set(told(stairmap("inspect", folder).stdout)) == {option}
    run = stairmap("run", folder, "-o", tmp_path / "wrong", "--no-report")
    assert set(told(run.stderr)) == {option}
    assert option in (tmp_path / "wrong" / "summary.txt").read_text()
    mended = stairmap("run", folder, *option.split(), "-o", tmp_path / "right", "--no-report")
    assert told(mended.stderr) == []
    (row,) = [line for line in mended.stdout.splitlines() if "1/1" in line]
    assert abs(int(row.split()[2]) - TRUE_RISE_MM) <= 3
    assert told(stairmap("inspect", folder, *option.split()).stdout) == []


def test_right_poses_are_not_doubted(drive: Path, tmp_path: Path) -> None:
    assert "problems" not in stairmap("inspect", drive).stdout
    assert stairmap("run", drive, "-o", tmp_path / "run", "--no-report").stderr == ""


def mistake_of(
    recording_path: Path, change: Callable[[Float64Array], Float64Array] | None = None
) -> str | None:
    recording = open_recording(recording_path)
    assert recording.trajectory is not None
    watch = PoseWatch(recording.num_frames, map_from_recorded=np.eye(4), max_depth=6.0)
    for frame in recording:
        if recording.trajectory.has_pose(np.array([frame.stamp_ns]))[0]:
            pose = recording.trajectory.pose_at(frame.stamp_ns)
            watch.add(frame, pose if change is None else change(pose[None])[0])
    return watch.mistake()


def test_kitchen_whose_map_is_not_level_is_told_so_and_nothing_else(shared_data: Path) -> None:
    kitchen = shared_data / "real" / "no_stairs_kitchen_kinect_v1"
    sentence = mistake_of(kitchen)
    assert sentence is not None and told(sentence) == ["--up=auto"] and "--pose-format" not in sentence
    assert told(stairmap("inspect", kitchen, "--up", "auto").stdout) == []


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("scene", "robot", "sensor"),
    [
        ("free_standing", "turtlebot", "kinect_v1"),
        ("davis_rear", "spot", "d435"),
        ("half_turn", "packbot", "kinect_v2"),
        ("overhang", "spot", "kinect_v1"),
        ("bookshelf", "turtlebot", "d435"),
        ("corridor", "go2", "kinect_v1"),
        ("descending", "humanoid", "kinect_v1"),
        ("ramp", "turtlebot", "phone_lidar"),
        ("cluttered_room", "packbot", "kinect_v1"),
        ("up_and_down", "humanoid", "d435"),
    ],
)
def test_drives_with_odometry_error_are_not_doubted_and_each_mistake_is_told(
    scene: str, robot: str, sensor: str, tmp_path: Path
) -> None:
    folder = tmp_path / "drive"
    arguments = ("--factor", "0.5", "--seed", "3", "--robot", robot, "--sensor", sensor)
    assert stairmap("simulate", scene, "-o", folder, *arguments).code == 0
    assert mistake_of(folder) is None
    for name, (change, option) in MISTAKES.items():
        sentence = mistake_of(folder, change)
        assert sentence is not None, name
        assert told(sentence) == [option], name


@pytest.mark.nightly
@pytest.mark.parametrize("name", [name for name in MISTAKES if name != "z not up"])
def test_mistakes_in_the_poses_of_the_real_kitchen_are_told(name: str, shared_data: Path) -> None:
    change, option = MISTAKES[name]
    sentence = mistake_of(shared_data / "real" / "no_stairs_kitchen_kinect_v1", change)
    assert sentence is not None and told(sentence) == [option]


def test_each_format_undoes_its_mistake() -> None:
    rng = np.random.default_rng(1)
    quats = rng.normal(size=(20, 4))
    poses = np.tile(np.eye(4), (20, 1, 1))
    poses[:, :3, :3] = rotation_from_quat(quats / np.linalg.norm(quats, axis=1, keepdims=True))
    poses[:, :3, 3] = rng.normal(size=(20, 3))
    for change, option in MISTAKES.values():
        if option.startswith("--pose-format"):
            name = option.split()[1]
            np.testing.assert_allclose(poses_from_format(change(poses), name), poses, atol=1e-9)


def test_formats_are_undone_in_their_order_and_unknown_ones_refused(drive: Path) -> None:
    assert check_pose_format("body,wxyz") == ("wxyz", "body")
    with pytest.raises(RecordingError, match="expected --pose-format to be of wxyz, mm, inverse, body"):
        check_pose_format("wxyz,cm")
    check_refused(stairmap("run", drive, "--pose-format", "xyzw"), "expected --pose-format to be of")


def test_two_mistakes_at_once_are_mended_by_two_words(drive: Path, tmp_path: Path) -> None:
    folder = spoil(drive, tmp_path / "drive", lambda poses: in_millimetres(in_order_wxyz(poses)))
    assert told(stairmap("inspect", folder, "--pose-format", "wxyz,mm").stdout) == []
    assert set(told(stairmap("inspect", folder, "--pose-format", "wxyz").stdout)) == {"--pose-format mm"}


def test_camera_that_stands_still_is_not_doubted(drive: Path) -> None:
    recording = open_recording(drive)
    frame = next(iter(recording))
    assert recording.trajectory is not None
    pose = recording.trajectory.pose_at(frame.stamp_ns)
    watch = PoseWatch(20, map_from_recorded=np.eye(4), max_depth=6.0)
    for index in range(20):
        watch.add(
            type(frame)(stamp_ns=index * 200_000_000, depth=frame.depth, camera=frame.camera, up=None), pose
        )
    assert watch.mistake() is None
