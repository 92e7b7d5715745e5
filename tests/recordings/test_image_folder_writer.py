"""What is written is read back equal; what cannot be written is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stairmap.camera import PinholeCamera
from stairmap.errors import CalibrationError, OutputError
from stairmap.frame import DepthFrame
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.recordings.image_folder_writer import ImageFolderWriter
from stairmap.transforms import rotation_from_quat, transform_from_parts

CAMERA = PinholeCamera(width=8, height=6, fx=7.0, fy=7.5, cx=3.5, cy=2.5)


def _frame(stamp_ns: int, depth_m: float = 2.0, camera: PinholeCamera = CAMERA) -> DepthFrame:
    depth = np.full((camera.height, camera.width), depth_m, dtype=np.float32)
    return DepthFrame(stamp_ns=stamp_ns, depth=depth, camera=camera)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.sampled_from([1000.0, 5000.0]))
def test_a_recording_survives(
    tmp_path_factory: pytest.TempPathFactory, seed: int, num_frames: int, depth_scale: float
) -> None:
    random = np.random.default_rng(seed)
    folder = tmp_path_factory.mktemp("recording")
    stamps_ns = np.cumsum(random.integers(1, 10**10, num_frames)) + 1305031102160407000
    depths = random.uniform(0.3, 6, (num_frames, 6, 8)).astype(np.float32)
    depths[random.random(depths.shape) < 0.1] = np.nan
    poses = [
        transform_from_parts(rotation_from_quat(random.normal(size=4)), random.uniform(-5, 5, 3))
        for _ in range(num_frames)
    ]
    with ImageFolderWriter(folder, CAMERA, depth_scale=depth_scale) as writer:
        for stamp_ns, depth, pose in zip(stamps_ns, depths, poses, strict=True):
            writer.write(DepthFrame(stamp_ns=int(stamp_ns), depth=depth, camera=CAMERA), pose)
    recording = ImageFolderRecording(folder)
    frames = list(recording)
    trajectory = recording.check_poses()
    assert recording.camera == CAMERA
    assert recording.num_frames == writer.num_frames == num_frames
    assert recording.time_range_ns == (stamps_ns[0], stamps_ns[-1])
    assert [frame.stamp_ns for frame in frames] == stamps_ns.tolist()
    np.testing.assert_array_equal(trajectory.stamps_ns, stamps_ns)
    np.testing.assert_allclose(trajectory.map_from_camera, poses, atol=1e-8)
    for frame, depth, pose in zip(frames, depths, poses, strict=True):
        np.testing.assert_allclose(frame.depth, depth, atol=0.501 / depth_scale)
        assert frame.up is not None
        np.testing.assert_allclose(frame.up, pose[2, :3], atol=1e-9)


def test_the_same_frames_give_the_same_files(tmp_path: Path) -> None:
    for name in ("first", "second"):
        with ImageFolderWriter(tmp_path / name, CAMERA, up=np.array([0.0, -1.0, 0.0])) as writer:
            writer.write(_frame(5), np.eye(4))
    files = sorted(path.relative_to(tmp_path / "first") for path in (tmp_path / "first").rglob("*.*"))
    assert [str(file) for file in files] == [
        "camera.json",
        "depth/000000.png",
        "depth.txt",
        "groundtruth.txt",
    ]
    for file in files:
        assert (tmp_path / "first" / file).read_bytes() == (tmp_path / "second" / file).read_bytes()


def test_a_recording_that_was_not_closed_can_be_read(tmp_path: Path) -> None:
    writer = ImageFolderWriter(tmp_path / "walk", CAMERA)
    writer.write(_frame(5), np.eye(4))
    assert len(list(ImageFolderRecording(tmp_path / "walk"))) == 1


def test_a_recording_goes_on_behind_the_frames_that_are_kept(tmp_path: Path) -> None:
    for name, stamps in (("first", (5, 6, 8)), ("second", (5, 6, 7, 8, 9))):
        with ImageFolderWriter(tmp_path / name, CAMERA) as writer:
            for stamp in stamps:
                writer.write(_frame(stamp, stamp / 4), np.eye(4))
    with ImageFolderWriter(tmp_path / "second", CAMERA, num_kept=2) as writer:
        writer.write(_frame(8, 2.0), np.eye(4))
        assert writer.num_frames == 3
    files = sorted(path.relative_to(tmp_path / "first") for path in (tmp_path / "first").rglob("*.*"))
    assert files == sorted(
        path.relative_to(tmp_path / "second") for path in (tmp_path / "second").rglob("*.*")
    )
    for file in files:
        assert (tmp_path / "first" / file).read_bytes() == (tmp_path / "second" / file).read_bytes()


def test_without_poses_there_is_no_pose_file(tmp_path: Path) -> None:
    with ImageFolderWriter(tmp_path / "walk", CAMERA, up=np.array([0.0, -2.0, 0.0])) as writer:
        writer.write(_frame(5))
    assert not (tmp_path / "walk" / "groundtruth.txt").exists()
    (frame,) = ImageFolderRecording(tmp_path / "walk")
    assert frame.up is not None
    np.testing.assert_allclose(frame.up, [0, -1, 0])


def test_a_folder_that_holds_files_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(OutputError, match=r"expected an empty folder, but .* holds files"):
        ImageFolderWriter(tmp_path, CAMERA)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_file_in_the_way_is_told(tmp_path: Path) -> None:
    (tmp_path / "walk").write_text("mine")
    with pytest.raises(OutputError, match="cannot write the recording"):
        ImageFolderWriter(tmp_path / "walk", CAMERA)


@pytest.mark.parametrize("depth_scale", [0.0, -1.0, float("nan")])
def test_an_impossible_scale_is_refused_before_anything_is_written(
    tmp_path: Path, depth_scale: float
) -> None:
    with pytest.raises(CalibrationError, match="depth_scale must be positive"):
        ImageFolderWriter(tmp_path / "walk", CAMERA, depth_scale=depth_scale)
    assert not (tmp_path / "walk").exists()


def test_stamps_must_increase(tmp_path: Path) -> None:
    with ImageFolderWriter(tmp_path, CAMERA) as writer:
        writer.write(_frame(5))
        for stamp_ns in (5, 4):
            with pytest.raises(ValueError, match="stamps that increase"):
                writer.write(_frame(stamp_ns))


def test_another_camera_is_refused(tmp_path: Path) -> None:
    with (
        ImageFolderWriter(tmp_path, CAMERA) as writer,
        pytest.raises(ValueError, match="expected frames of"),
    ):
        writer.write(_frame(5, camera=CAMERA.scaled(2)))


def test_a_closed_writer_is_closed(tmp_path: Path) -> None:
    writer = ImageFolderWriter(tmp_path, CAMERA)
    writer.close()
    with pytest.raises(ValueError, match="is closed"):
        writer.write(_frame(5))
