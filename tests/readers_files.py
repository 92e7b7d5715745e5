"""What a reader of README and docs has at hand: the files that their examples name, small."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bag_files import Ros, robot_messages, write_bag
from cloud_bags import cloud_message, ros_cloud
from cloud_files import write_binary_pcd, write_binary_ply, write_las
from command_line import stairmap
from elevation_bags import grid_message, stair_heights
from sampled_clouds import sample_mesh, sampled_scene
from small_recordings import repeat_frames, write_recording
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.simulation.storeys import STOREY_SCENES

DENSITY = 700.0
"""Points per square metre of maps."""

DETECTOR = """
import json, sys
for line in sys.stdin:
    print(json.dumps({"skip": True}), flush=True)
"""


def _recording(path: Path) -> None:
    write_recording(path)


def _long_recording(path: Path) -> None:
    repeat_frames(write_recording(path), 24)


def _ros1_bag(path: Path) -> None:
    _depth_bag(path, "ros1")


def _rosbag2(path: Path) -> None:
    _depth_bag(path, "sqlite")


def _depth_bag(path: Path, kind: str) -> None:
    scratch = path.with_name(f".{path.name}")
    ros = Ros(kind)
    recording = ImageFolderRecording(write_recording(scratch / "recording"))
    written = write_bag(scratch, kind, ros, robot_messages(ros, recording))
    shutil.move(written, path)
    shutil.rmtree(scratch)


def _mcap(path: Path) -> None:
    _depth_bag(path, "bare_mcap")


def _sweeps(path: Path) -> None:
    """Sweeps and elevation maps of one robot that stands before stairs; two layers of heights."""
    ros = Ros("bare_mcap")
    points = sampled_scene("free_standing", density=DENSITY)[0] - np.array([0.0, 0.0, 0.5])
    messages = []
    for index in range(3):
        stamp_ns = 10**9 + index * 10**8
        columns = {axis: points[index::3, column].astype(np.float32) for column, axis in enumerate("xyz")}
        cloud = ros_cloud(ros, cloud_message(columns), stamp_ns, "base_link")
        messages.append((stamp_ns, "/livox/lidar", cloud))
        grid = grid_message(ros, stair_heights(0.05), 0.05, stamp_ns, layers=("smooth", "elevation"))
        messages.append((stamp_ns, "/elevation_mapping/elevation_map", grid))
        for step in range(11):
            late_ns = stamp_ns + step * 10**7
            messages.append((late_ns, "/tf", ros.tf(late_ns, ("odom", "base_link", np.eye(4)))))
    scratch = path.with_name(f".{path.name}")
    scratch.mkdir()
    shutil.move(write_bag(scratch, "bare_mcap", ros, messages), path)
    shutil.rmtree(scratch)


def _las(path: Path) -> None:
    """Two houses of two floors beside each other."""
    scene = STOREY_SCENES["two_floors"]("two_floors", np.random.default_rng(1))
    points = sample_mesh(scene.mesh, density=DENSITY, noise=0.003)
    points = points[points[:, 2] > -0.1]  # nobody scans the ground from below
    write_las(path, np.concatenate([points, points + np.array([0.0, 25.0, 0.0])]))


def _pcd(path: Path) -> None:
    write_binary_pcd(path, sampled_scene("free_standing", density=DENSITY)[0])


def _ply(path: Path) -> None:
    write_binary_ply(path, sampled_scene("free_standing", density=DENSITY)[0], order="<")


def _heights(path: Path) -> None:
    np.savez(path, heights=stair_heights(0.05), resolution=0.05, origin=[0.0, 0.0])


def _recordings(path: Path) -> None:
    for number in (1, 2, 3):
        write_recording(path / f"hall_{number}", num_frames=5)


def _monday(path: Path) -> None:
    path.mkdir()
    _mcap(path / "morning.mcap")


def _tuesday(path: Path) -> None:
    path.write_text("recordings/hall_1\n")


def _run(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    recording = write_recording(path.with_name(f"{path.name}_recording"))
    assert stairmap("run", recording, "-o", path, "--no-report").code == 0


def _detector(path: Path) -> None:
    path.write_text(DETECTOR)


FILES: dict[str, Callable[[Path], None]] = {
    "hall": _recording,
    "my_recording": _long_recording,
    "walk.bag": _ros1_bag,
    "walk_0.mcap": _mcap,
    "walk": _rosbag2,
    "walk.mcap": _sweeps,
    "building.laz": _las,
    "slam_map.pcd": _pcd,
    "slam_map.ply": _ply,
    "stairwell.ply": _ply,
    "heights.npz": _heights,
    "recordings/": _recordings,
    "monday/": _monday,
    "tuesday.txt": _tuesday,
    "my_run": _run,
    "results/hall_1": _run,
    "my_detector.py": _detector,
}
"""Files and folders by their names in the examples."""


def write_named_files(folder: Path, text: str) -> None:
    """Write what an example names and does not make itself (as ``-o NAME``)."""
    for name, write in FILES.items():
        is_named = re.search(rf"(?<![\w/.-]){re.escape(name)}(?![\w.-])", text)
        is_made = re.search(rf"""(-o |Writer\(Path\("){re.escape(name)}(?![\w.-])""", text)
        if is_named and not is_made and not (folder / name).exists():
            write(folder / name)
