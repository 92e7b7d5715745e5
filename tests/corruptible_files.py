"""Every kind of file that stairmap reads, as small as it can be, and the command that reads it."""

from __future__ import annotations

import json
import shutil
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import cloud_files
from bag_files import DEPTH_TOPIC, Messages, Ros, robot_messages, write_bag
from cloud_bags import CLOUD_TOPIC, cloud_message, livox_message, ros_cloud
from command_line import stairmap
from e57_files import e57_content, paged, write_e57
from elevation_bags import GRID_TOPIC, grid_message
from realsense_messages import ros1_messages
from rvl_encoder import encode_rvl
from small_recordings import write_recording
from stairmap.batch.inputs import find_inputs
from stairmap.batch.job import RecordingResult
from stairmap.batch.journal import BatchJournal
from stairmap.camera import PinholeCamera
from stairmap.recordings.clouds.open import open_cloud
from stairmap.recordings.clouds.sampling import sample_points
from stairmap.recordings.image_folder import ImageFolderRecording

TINY = PinholeCamera(width=40, height=30, fx=33.0, fy=33.0, cx=19.5, cy=14.5)
"""A camera whose images are small enough that what is around them is hit as well."""

SMALL = PinholeCamera(width=160, height=120, fx=131.0, fy=131.0, cx=79.5, cy=59.5)
"""A camera that still sees the stairs."""

START_NS = 10**9
FINGERPRINT = "0123456789abcdef"


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of file: where it is, and what reads it.

    Attributes
    ----------
    path
        The file.
    arguments
        A command that reads it, and that accepts it as long as it is whole.
    reads
        Instead of a command, which would start processes: the function that it calls.
    made
        What the command writes, to be removed before it is called again.
    """

    path: str
    arguments: tuple[str, ...] = ()
    reads: Callable[[Path], object] | None = None
    made: str = "out"


def _inspect(path: str, name: str | None = None) -> Kind:
    return Kind(path=path if name is None else f"{path}/{name}", arguments=("inspect", path))


def _sweeps(path: str, topic: str) -> Kind:
    return Kind(path=path, arguments=("run", path, "--cloud-topic", topic, "--no-report", "-o", "out"))


def _view(run: str, name: str) -> Kind:
    return Kind(path=f"{run}/{name}", arguments=("view", run, "--page", "out.html"), made="out.html")


def _house(name: str) -> Kind:
    options = ("--buildings", "buildings", "--frames", "2", "--factor", "0.1", "-o", "out")
    return Kind(path=f"buildings/house/{name}", arguments=("simulate", "building:house", *options))


def _read_list(path: Path) -> object:
    return find_inputs([f"@{path}"])


def _read_journal(path: Path) -> object:
    journal = BatchJournal(path, FINGERPRINT)
    try:
        return [journal.result_of(name) for name in ("/near", "/lost")]
    finally:
        journal.close()


def _read_e57_content(path: Path) -> object:
    """Read an E57 file whose checksums are right whatever became of what they are of."""
    whole = path.with_name("checksums.e57")
    whole.write_bytes(paged(path.read_bytes()))
    return sample_points(open_cloud(whole))


_MERGE = ("merge", "site", "third", "--alignment", "places.yaml", "-o", "out")
_PLAN = ("plan", "run", "--map", "0=0.yaml")

KINDS = {
    "stairways.json": Kind(path="run/stairways.json", arguments=("check", "run", "--robot", "spot")),
    "detections.jsonl": _view("run", "detections.jsonl"),
    "history.jsonl": Kind(path="killed/history.jsonl", arguments=("check", "killed", "--robot", "spot")),
    "trajectory.tum": _view("run", "trajectory.tum"),
    "recording.json": _view("run", "recording.json"),
    "scan.json": _view("scanned", "scan.json"),
    "merge.json": Kind(path="site/merge.json", arguments=_MERGE),
    "alignment": Kind(path="places.yaml", arguments=_MERGE),
    "camera.json": _inspect("stairs", "camera.json"),
    "depth.txt": _inspect("stairs", "depth.txt"),
    "groundtruth.txt": _inspect("stairs", "groundtruth.txt"),
    "depth image": _inspect("stairs", "depth/000001.png"),
    "bag of ROS 1": _inspect("walk.bag"),
    "bag of ROS 1, compressed": _inspect("walk_lz4.bag"),
    "bag of RealSense": _inspect("realsense.bag"),
    "MCAP": _inspect("walk.mcap"),
    "MCAP, compressed": _inspect("zstd/walk", "walk.mcap"),
    "SQLite": _inspect("walk.db3"),
    "SQLite, compressed messages": _inspect("zstd_messages/walk", "walk.db3"),
    "metadata.yaml": _inspect("folder/walk", "metadata.yaml"),
    "compressed depth": _inspect("compressed.mcap"),
    "PointCloud2": _sweeps("sweeps.mcap", CLOUD_TOPIC),
    "Livox CustomMsg": _sweeps("livox.bag", CLOUD_TOPIC),
    "GridMap": _sweeps("grids.mcap", GRID_TOPIC),
    **{
        f"map {name}": Kind(path=name, arguments=("scan", name, "--no-report", "-o", "out"))
        for name in (
            "ascii.pcd", "binary.pcd", "compressed.pcd", "ascii.ply", "little.ply", "map.las", "map.laz",
            "map.xyz", "map.npz", "map.e57",
        )
    },
    "map.e57 with right checksums": Kind(path="content.e57", reads=_read_e57_content, made="checksums.e57"),
    "building's mesh": _house("mesh.ply"),
    "building's stairs": _house("stairs.json"),
    "robot profile": Kind(path="bot.yaml", arguments=("check", "run", "--robot", "bot.yaml")),
    "config": Kind(path="config.yaml", arguments=("config", "--config", "config.yaml")),
    "map of a floor": Kind(path="0.yaml", arguments=_PLAN),
    "image of a floor": Kind(path="0.pgm", arguments=_PLAN),
    "list of recordings": Kind(path="list.txt", reads=_read_list),
    "batch.jsonl": Kind(path="fleet/batch.jsonl", reads=_read_journal),
}  # fmt: skip


def write_corruptible_files(folder: Path) -> None:
    """Write one file of each kind."""
    recording = write_recording(folder / "stairs", num_frames=3, camera=TINY)
    _write_bags(folder, ImageFolderRecording(recording))
    _write_maps(folder)
    _write_building(folder / "buildings" / "house")
    _write_runs(folder)
    (folder / "bot.yaml").write_text(yaml.safe_dump(ROBOT))
    (folder / "config.yaml").write_text(stairmap("config").stdout)
    (folder / "0.yaml").write_text(yaml.safe_dump(MAP))
    (folder / "0.pgm").write_bytes(b"P5\n60 60\n255\n" + bytes([254] * 3600))
    (folder / "list.txt").write_text("# of a fleet\nnowhere\nlost.bag\n")


ROBOT = {
    "name": "bot", "max_continuous_rise": 0.2, "max_single_rise": 0.3,
    "min_run": {"value": 0.2, "source": "x"}, "max_pitch_deg": 40, "max_slope_deg": 30, "body_width": 0.5,
    "side_clearance": 0.05, "min_landing_length": 1.0,
}  # fmt: skip
MAP = {
    "image": "0.pgm", "resolution": 0.1, "origin": [-3, -3, 0], "negate": 0, "occupied_thresh": 0.65,
    "free_thresh": 0.2,
}  # fmt: skip


def _write_runs(folder: Path) -> None:
    """A run with a stairway, one that was killed, a scan, two merged maps and a batch."""
    near = write_recording(folder / "near", num_frames=4, camera=SMALL)
    _succeed("run", near, "-o", folder / "run", "--no-report", "--set", "modeling.min_observations=2")
    shutil.copytree(folder / "run", folder / "killed")
    (folder / "killed" / "stairways.json").unlink()
    _succeed("scan", folder / "map.xyz", "-o", folder / "scanned", "--no-report")
    places = {
        "runs": {
            name: {"x": 0.0, "y": 0.0, "z": 0.0, "yaw_deg": 0.0} for name in ("run", "site", "other", "third")
        }
    }
    (folder / "places.yaml").write_text(yaml.safe_dump(places))
    shutil.copytree(folder / "run", folder / "other")
    alignment = ("--alignment", folder / "places.yaml")
    _succeed("merge", folder / "run", folder / "other", *alignment, "-o", folder / "site")
    shutil.copytree(folder / "run", folder / "third")
    (folder / "fleet").mkdir()
    (folder / "fleet/batch.jsonl").write_text(_journal(folder / "run"))


def _journal(run: Path) -> str:
    """The lines of a batch of which one recording was done and one could not be read."""
    stairways = json.loads((run / "stairways.json").read_text())["stairways"]
    taken = {"recording": "/near", "fingerprint": FINGERPRINT, "folder": "near"}
    done = RecordingResult(
        recording="/near", folder="near", fingerprint=FINGERPRINT, num_frames=4, stairways=tuple(stairways)
    )
    failed = RecordingResult(recording="/lost", folder="", fingerprint=FINGERPRINT, error="there is no lost")
    return "".join(json.dumps(line) + "\n" for line in (taken, done.to_dict(), failed.to_dict()))


def _succeed(*arguments: str | Path) -> None:
    outcome = stairmap(*arguments)
    assert outcome.code == 0, outcome.stderr


def _write_bags(folder: Path, recording: ImageFolderRecording) -> None:
    for kind, name in (
        ("ros1", "walk.bag"), ("ros1_lz4", "walk_lz4.bag"), ("bare_mcap", "walk.mcap"),
        ("bare_db3", "walk.db3"),
        ("mcap_zstd", "zstd"), ("sqlite_zstd_messages", "zstd_messages"), ("sqlite", "folder"),
    ):  # fmt: skip
        ros = Ros(kind)
        _write_bag(folder / name, kind, ros, robot_messages(ros, recording))
    ros = Ros("bare_mcap")
    _write_bag(folder / "compressed.mcap", "bare_mcap", ros, _compressed_messages(ros, recording))
    ros = Ros("ros1")
    _write_bag(folder / "realsense.bag", "ros1", ros, ros1_messages(ros, recording, depth_unit=0.001))
    ros = Ros("bare_mcap")
    _write_bag(folder / "sweeps.mcap", "bare_mcap", ros, _sweep_messages(ros, is_livox=False))
    ros = Ros("ros1")
    _write_bag(folder / "livox.bag", "ros1", ros, _sweep_messages(ros, is_livox=True))
    ros = Ros("bare_mcap")
    _write_bag(folder / "grids.mcap", "bare_mcap", ros, _grid_messages(ros))


def _write_bag(target: Path, kind: str, ros: Ros, messages: Messages) -> None:
    """Write a bag; a single file is moved to its name, a folder is left in one of that name."""
    scratch = target.with_name(f"{target.name}.folder")
    scratch.mkdir()
    written = write_bag(scratch, kind, ros, messages)
    if written.is_file():
        shutil.move(written, target)
        shutil.rmtree(scratch)
    else:
        scratch.rename(target)


def _compressed_messages(ros: Ros, recording: ImageFolderRecording) -> Messages:
    """Depth as PNG and as RVL."""
    messages: Messages = []
    for recorded_ns, topic, message in robot_messages(ros, recording):
        if topic != DEPTH_TOPIC:
            messages.append((recorded_ns, topic, message))
    for index, frame in enumerate(recording):
        message = ros.compressed(frame.depth, frame.stamp_ns)
        if index % 2:
            values = np.nan_to_num(np.rint(frame.depth * 1000)).astype(np.uint16)
            message.data = np.frombuffer(bytes(12) + encode_rvl(values), dtype=np.uint8)
            message.format = "16UC1; compressedDepth rvl"
        messages.append((frame.stamp_ns + 5_000_000, f"{DEPTH_TOPIC}/compressedDepth", message))
    return messages


def _sweep_messages(ros: Ros, *, is_livox: bool) -> Messages:
    """Two sweeps of a wall by a robot that stands."""
    points = np.random.default_rng(0).uniform([3, -1, 0], [3, 1, 2], (60, 3)).astype(np.float32)
    offsets_ns = np.linspace(0, 99_000_000, len(points)).astype(np.int64)
    messages: Messages = []
    for index in range(2):
        stamp_ns = START_NS + index * 10**8
        if is_livox:
            message = livox_message(ros, points, offsets_ns, stamp_ns)
        else:
            columns: dict[str, Any] = {axis: points[:, column] for column, axis in enumerate("xyz")}
            cloud = cloud_message({**columns, "t": offsets_ns}, kinds={"t": "u4"})
            message = ros_cloud(ros, cloud, stamp_ns, "livox_frame")
        messages.append((stamp_ns + 10**8, CLOUD_TOPIC, message))
    for step in range(21):
        stamp_ns = START_NS + step * 10**7
        messages.append((stamp_ns, "/tf", ros.tf(stamp_ns, ("odom", "livox_frame", np.eye(4)))))
    return messages


def _grid_messages(ros: Ros) -> Messages:
    heights = np.zeros((20, 20))
    return [
        (START_NS * number, GRID_TOPIC, grid_message(ros, heights, 0.2, START_NS * number))
        for number in (1, 2)
    ]


def _write_maps(folder: Path) -> None:
    """A floor and a wall of a few points in every format."""
    random = np.random.default_rng(3)
    floor, wall = random.uniform(0, 3, (2, 80, 3)).round(3)
    floor[:, 2], wall[:, 0] = 0.0, 3.0
    points = np.concatenate([floor, wall])
    cloud_files.write_ascii_pcd(folder / "ascii.pcd", points)
    cloud_files.write_binary_pcd(folder / "binary.pcd", points)
    cloud_files.write_compressed_pcd(folder / "compressed.pcd", points)
    cloud_files.write_ascii_ply(folder / "ascii.ply", points)
    cloud_files.write_binary_ply(folder / "little.ply", points, order="<")
    cloud_files.write_las(folder / "map.las", points)
    cloud_files.write_las(folder / "map.laz", points)
    cloud_files.write_xyz(folder / "map.xyz", points)
    write_e57(folder / "map.e57", points)
    (folder / "content.e57").write_bytes(e57_content(points))
    heights = np.zeros((12, 12), dtype=np.float32)
    np.savez(folder / "map.npz", heights=heights, resolution=0.2, origin=[0.0, 0.0])


def _write_building(folder: Path) -> None:
    """A floor of two triangles and a flight that somebody measured on it."""
    folder.mkdir(parents=True)
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    )
    corners = struct.pack("<12f", -5, -3, 0, 5, -3, 0, 5, 3, 0, -5, 3, 0)
    faces = struct.pack("<B3iB3i", 3, 0, 1, 2, 3, 0, 2, 3)
    (folder / "mesh.ply").write_bytes(header.encode() + corners + faces)
    flight = {
        "usable": True, "approach_free_m": 3.0, "ascend_dir": [1.0, 0.0], "first_edge_mid": [1.0, 0.0, 0.17],
        "going": {"mean": 0.28}, "width": {"median": 1.2}, "riser_between_treads": {"mean": 0.17},
        "tread_z": [0.17, 0.34, 0.51], "n_risers": 4, "n_treads": 3, "z_bottom": 0.0, "z_top": 0.68,
    }  # fmt: skip
    stairs = {"stairs": [{"flights": [flight], "other_parts": []}]}
    (folder / "stairs.json").write_text(json.dumps(stairs))
