"""Recordings of a few small frames: a camera that comes up to a staircase, or looks at a bare floor."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, pose_looking, render_frame
from stairmap.camera import PinholeCamera
from stairmap.recordings.image_folder_writer import ImageFolderWriter
from stairmap.transforms import transform_from_parts

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
FRAME_PERIOD_NS = 100_000_000


def write_recording(
    folder: Path,
    *,
    num_frames: int = 8,
    has_stairs: bool = True,
    recorded_from_map: np.ndarray | None = None,
    has_poses: bool = True,
    camera: PinholeCamera = KINECT_CAMERA,
) -> Path:
    """Write a recording; ``recorded_from_map`` is a (3, 3) turn of the map that the poses are given in."""
    turn = transform_from_parts(np.eye(3) if recorded_from_map is None else recorded_from_map, np.zeros(3))
    with ImageFolderWriter(folder, camera) as writer:
        for index in range(num_frames):
            position = [-2.4 + 0.1 * index, 0.05, 0.9]
            map_from_camera = pose_looking(position, yaw=0.02 * index, down=0.3)
            frame = render_frame(
                STAIRS if has_stairs else None,
                map_from_camera,
                camera=camera,
                stamp_ns=index * FRAME_PERIOD_NS,
                wall_at=4.5,
            )
            writer.write(frame, turn @ map_from_camera if has_poses else None)
    return folder


def repeat_frames(folder: Path, num_frames: int) -> None:
    """Make a recording longer by listing its images over and over."""
    names = [line.split()[1] for line in (folder / "depth.txt").read_text().splitlines()[1:]]
    poses = (folder / "groundtruth.txt").read_text().splitlines()[1:]
    images, trajectory = [], []
    for index in range(num_frames):
        stamp = f"{index * 0.1:.1f}"
        images.append(f"{stamp} {names[index % len(names)]}\n")
        trajectory.append(f"{stamp} {poses[index % len(poses)].split(' ', 1)[1]}\n")
    (folder / "depth.txt").write_text("".join(images))
    (folder / "groundtruth.txt").write_text("".join(trajectory))


def damage_image(folder: Path, index: int) -> None:
    """Cut an image off in the middle, as a crash leaves it."""
    image = sorted((folder / "depth").iterdir())[index]
    image.write_bytes(image.read_bytes()[: image.stat().st_size // 2])
