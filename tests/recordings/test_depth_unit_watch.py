"""Depth in another unit is noticed by the camera's way, and depth in the right one never is."""

from __future__ import annotations

import numpy as np
import pytest

from small_recordings import write_recording
from stairmap.recordings.depth_unit_watch import FACTORS, DepthUnitMistake, DepthUnitWatch
from stairmap.recordings.image_folder import ImageFolderRecording


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> ImageFolderRecording:
    """A walk of 1.5 m towards stairs, over a floor, before a wall."""
    return ImageFolderRecording(write_recording(tmp_path_factory.mktemp("images") / "walk", num_frames=16))


def watched(walk: ImageFolderRecording, too_large: float, *, step: float = 1.0) -> DepthUnitMistake | None:
    """What is told of depth that was read so many times too large, on a way so many times as long."""
    watch = DepthUnitWatch()
    for frame in walk:
        pose = walk.check_poses().pose_at(frame.stamp_ns).copy()
        pose[:3, 3] *= step
        watch.add(frame.depth * np.float32(too_large), frame.camera, frame.stamp_ns, pose)
    return watch.mistake()


@pytest.mark.parametrize("factor", FACTORS[1:])
def test_the_unit_is_told(walk: ImageFolderRecording, factor: float) -> None:
    mistake = watched(walk, 1.0 / factor)
    assert mistake is not None
    assert mistake.factor == factor
    assert f"only if it is {factor:g} times what was read" in str(mistake)


def test_depth_in_the_right_unit_is_not_doubted(walk: ImageFolderRecording) -> None:
    assert watched(walk, 1.0) is None


def test_a_camera_that_stands_still_tells_nothing(walk: ImageFolderRecording) -> None:
    assert watched(walk, 4.0, step=0.0) is None


def test_wrong_poses_are_not_taken_for_a_unit(walk: ImageFolderRecording) -> None:
    assert watched(walk, 1.0, step=3.0) is None


def test_depth_with_holes_is_judged_by_the_rest(walk: ImageFolderRecording) -> None:
    watch, holes = DepthUnitWatch(), np.random.default_rng(1)
    for frame in walk:
        depth = frame.depth * np.float32(4.0)
        depth[holes.random(depth.shape) < 0.4] = np.nan
        watch.add(depth, frame.camera, frame.stamp_ns, walk.check_poses().pose_at(frame.stamp_ns))
    mistake = watch.mistake()
    assert mistake is not None
    assert mistake.factor == 0.25
