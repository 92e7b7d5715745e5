"""Organised clouds of a depth camera are read as its depth images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analytic_stairs import KINECT_CAMERA, pose_looking, render_frame
from cloud_files import POINTS, write_binary_pcd, write_organised_pcd
from command_line import stairmap
from small_recordings import STAIRS, write_recording
from stairmap.errors import StairmapError
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.camera_file import CameraFile, dump_camera_file
from stairmap.recordings.clouds.pinhole_fit import (
    MAX_RAY_ERROR,
    MIN_PIXELS,
    OPTICAL_FROM_AXES,
    find_ray_error,
    fit_pinhole_camera,
)
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.recordings.open import open_recording

BODY = OPTICAL_FROM_AXES["body (x forward, y left, z up)"]


@pytest.fixture(scope="module")
def frame():
    pose = pose_looking([-2.2, 0.05, 0.9], yaw=0.05, down=0.3)
    return render_frame(STAIRS, pose, wall_at=4.5, noise_seed=3)


def _write(path: Path, frame, *, turn=None, scale: float = 1.0) -> Path:
    points = frame.points() * scale
    write_organised_pcd(path, points if turn is None else points @ turn)
    return path


@pytest.mark.parametrize("turn", [None, BODY])
@pytest.mark.parametrize("scale", [1.0, 1000.0])
def test_a_cloud_is_a_recording_of_one_frame_with_the_cameras_own_intrinsics(tmp_path, frame, turn, scale):
    recording = open_recording(_write(tmp_path / "view.pcd", frame, turn=turn, scale=scale))

    (read,) = list(recording)
    assert recording.name == "view"
    assert read.depth == pytest.approx(frame.depth, abs=1e-4, nan_ok=True)
    for name in ("fx", "fy", "cx", "cy"):
        assert getattr(read.camera, name) == pytest.approx(getattr(KINECT_CAMERA, name), abs=0.02)
    notes = " ".join(recording.problems.notes)
    assert "intrinsics are those that the points tell" in notes
    assert ("body" in notes) == (turn is not None)
    assert ("millimetres" in notes) == (scale > 1)


def test_a_cloud_of_a_folder_has_the_folders_stamps_and_poses(tmp_path, frame):
    folder = write_recording(tmp_path / "walk", num_frames=3)
    images = ImageFolderRecording(folder)
    expected = list(images)
    lines = []
    for number, image in enumerate(expected):
        _write(folder / f"{number}.pcd", image)
        lines.append(f"{image.stamp_ns * 1e-9:.1f} {number}.pcd")
    (folder / "depth.txt").write_text("\n".join(lines))
    (folder / "camera.json").unlink()

    recording = open_recording(folder)
    read = list(recording)
    assert [image.stamp_ns for image in read] == [image.stamp_ns for image in expected]
    assert recording.trajectory is not None
    for one, other in zip(read, expected, strict=True):
        assert one.depth == pytest.approx(other.depth, abs=1e-4, nan_ok=True)
        assert one.up == pytest.approx(other.up)


def test_a_camera_file_is_used_where_it_is_given_and_must_be_that_of_the_points(tmp_path, frame):
    path = _write(tmp_path / "view.pcd", frame, turn=BODY)
    camera_file = tmp_path / "mine.json"
    dump_camera_file(camera_file, CameraFile(camera=KINECT_CAMERA, depth_scale=1.0))
    recording = open_recording(path, bag=BagOptions(camera_file=camera_file))
    assert recording.camera == KINECT_CAMERA
    assert next(iter(recording)).depth == pytest.approx(frame.depth, abs=1e-4, nan_ok=True)

    other = KINECT_CAMERA.scaled(1.0)
    object.__setattr__(other, "fx", KINECT_CAMERA.fx * 1.05)
    dump_camera_file(camera_file, CameraFile(camera=other, depth_scale=1.0))
    with pytest.raises(StairmapError, match="on the rays of the camera file's camera"):
        open_recording(path, bag=BagOptions(camera_file=camera_file))


def test_what_is_no_image_of_one_camera_is_refused(tmp_path, frame):
    write_binary_pcd(tmp_path / "list.pcd", POINTS)
    angles = np.linspace(-np.pi, np.pi, 200)
    sweep = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)[None] * np.ones((16, 1, 1))
    sweep[..., 2] = np.linspace(-0.3, 0.3, 16)[:, None]
    write_organised_pcd(tmp_path / "sweep.pcd", 3 * sweep)
    write_organised_pcd(tmp_path / "empty.pcd", np.full((12, 16, 3), np.nan))
    write_organised_pcd(tmp_path / "long.pcd", np.ones((2, 9000, 3)))
    for name, reason in (
        (
            "list.pcd",
            "organised as an image .HEIGHT above 1., but its points are a plain list",
        ),
        ("sweep.pcd", "points on the rays of one pinhole camera"),
        ("empty.pcd", "points on the rays of one pinhole camera"),
        ("long.pcd", "at most 8192 pixels a side, got 9000x2"),
    ):
        with pytest.raises(StairmapError, match=reason):
            open_recording(tmp_path / name)
    with pytest.raises(StairmapError, match="topics and coordinate frames are those of bags"):
        open_recording(_write(tmp_path / "view.pcd", frame), bag=BagOptions(depth_topic="/depth"))


def test_images_and_clouds_are_not_mixed(tmp_path, frame):
    folder = write_recording(tmp_path / "walk", num_frames=2)
    _write(folder / "view.pcd", frame)
    with (folder / "depth.txt").open("a") as file:
        file.write("9 view.pcd\n")
    with pytest.raises(StairmapError, match="list images or clouds, not both"):
        open_recording(folder)


def test_a_cloud_of_another_size_or_camera_is_skipped_and_named(tmp_path, frame):
    _write(tmp_path / "0.pcd", frame)
    write_organised_pcd(tmp_path / "1.pcd", frame.points()[::2, ::2])
    write_organised_pcd(tmp_path / "2.pcd", frame.points() * [1.02, 1, 1])
    (tmp_path / "depth.txt").write_text("0 0.pcd\n1 1.pcd\n2 2.pcd\n")
    recording = open_recording(tmp_path)
    assert len(list(recording)) == 1
    reasons = [skipped.reason for skipped in recording.problems.skipped]
    assert "not the camera's size" in reasons[0]
    assert "off the rays of the camera's pixels" in reasons[1]


def test_zeros_are_nothing_that_was_measured(tmp_path, frame):
    points = np.nan_to_num(frame.points(), nan=0.0)
    points[:20] = 0.0
    write_organised_pcd(tmp_path / "view.pcd", points)
    (read,) = list(open_recording(tmp_path / "view.pcd"))
    assert np.isnan(read.depth[:20]).all()
    assert np.isfinite(read.depth[20:]).any()


def test_a_fit_needs_pixels_in_rows_and_columns(frame):
    points = frame.points()
    points[np.isnan(points).any(axis=2)] = np.nan
    few = np.full_like(points, np.nan)
    rows, columns = np.nonzero(np.isfinite(points).all(axis=2))
    for count, is_enough in ((MIN_PIXELS - 1, False), (MIN_PIXELS, True)):
        few[:] = np.nan
        chosen = np.linspace(0, len(rows) - 1, count).astype(int)
        few[rows[chosen], columns[chosen]] = points[rows[chosen], columns[chosen]]
        assert (fit_pinhole_camera(few) is not None) == is_enough
    row = np.full_like(points, np.nan)
    row[rows[-1]] = points[rows[-1]]
    assert fit_pinhole_camera(row) is None


def test_points_off_their_rays_by_more_than_half_a_pixel_are_no_image(frame):
    points = frame.points()
    rng = np.random.default_rng(0)
    for error, is_image in ((0.8 * MAX_RAY_ERROR, True), (1.2 * MAX_RAY_ERROR, False)):
        shift = rng.normal(size=points.shape[:2]) * error / KINECT_CAMERA.fx
        moved = points.copy()
        moved[..., 0] += shift * points[..., 2]
        assert (fit_pinhole_camera(moved) is not None) == is_image
        assert find_ray_error(moved, KINECT_CAMERA) == pytest.approx(error, rel=0.02)


def test_detect_measures_the_stairs_of_a_cloud(tmp_path, frame):
    outcome = stairmap("detect", _write(tmp_path / "view.pcd", frame), "-o", tmp_path / "out")
    assert outcome.code == 0
    row = next(line.split() for line in outcome.stdout.splitlines() if "ascending" in line)
    assert abs(int(row[3]) - 170) <= 4
    assert abs(int(row[4]) - 280) <= 6
    assert "intrinsics are those that the points tell" in outcome.stderr


def test_scan_says_that_an_image_is_measured_better_as_one(tmp_path, frame):
    outcome = stairmap("scan", _write(tmp_path / "view.pcd", frame), "-o", tmp_path / "out", "--no-report")
    assert "stairmap detect view.pcd measures it more exactly" in outcome.stderr
    write_binary_pcd(tmp_path / "list.pcd", frame.points().reshape(-1, 3))
    outcome = stairmap("scan", tmp_path / "list.pcd", "-o", tmp_path / "other", "--no-report")
    assert "measures it more exactly" not in outcome.stderr
