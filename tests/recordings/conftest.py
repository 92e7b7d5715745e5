"""A small recording to break in one place at a time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from small_recordings import write_recording
from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.recordings.image_folder_writer import ImageFolderWriter

CAMERA = PinholeCamera(width=32, height=24, fx=30.0, fy=31.0, cx=15.5, cy=11.25)


@pytest.fixture
def make_recording(tmp_path: Path) -> Callable[..., Path]:
    """Write a good recording of frames 50 ms apart from 100 s on, the camera looking along the map's x."""

    def make(*, num_frames: int = 4, with_poses: bool = True, up: list[float] | None = None) -> Path:
        folder = tmp_path / "walk"
        with ImageFolderWriter(folder, CAMERA, up=None if up is None else np.array(up)) as writer:
            for index in range(num_frames):
                depth = np.full((24, 32), 2.0 + 0.001 * index, dtype=np.float32)
                depth[0, 0] = np.nan
                pose = np.eye(4)
                pose[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
                pose[:3, 3] = [0.01 * index, 0.0, 1.0]
                frame = DepthFrame(stamp_ns=100_000_000_000 + index * 50_000_000, depth=depth, camera=CAMERA)
                writer.write(frame, pose if with_poses else None)
        return folder

    return make


@pytest.fixture(scope="session")
def walk(tmp_path_factory: pytest.TempPathFactory) -> ImageFolderRecording:
    """Four small frames on the way to a staircase, 0.1 s apart, to be put into bags."""
    return ImageFolderRecording(write_recording(tmp_path_factory.mktemp("images") / "walk", num_frames=4))
