"""``stairmap run`` on bags with the sweeps of a LiDAR."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bag_files import Ros, write_bag
from command_line import stairmap
from small_recordings import write_recording
from stairmap.recordings.open import has_only_sweeps
from stairmap.simulation.lidars import MID_360
from stairmap.simulation.odometry import PERFECT_ODOMETRY
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sweep_bag import write_lidar_drive
from stairmap.simulation.sweeps import LidarDrive


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bag of a robot with a Mid-360 that comes up to eight steps of 170 x 280 mm."""
    scene = make_scene("free_standing", 0)
    drive = LidarDrive(scene, MID_360, ROBOTS["spot"], seed=0, num_frames=42, odometry=PERFECT_ODOMETRY)
    return write_lidar_drive(tmp_path_factory.mktemp("bags") / "walk", drive, seed=0)


@pytest.fixture(scope="module")
def run(walk: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict, Path]:
    """What the command prints as JSON, and its folder."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    outcome = stairmap(
        "run", walk, "--cloud-topic", "/livox/lidar", "-o", folder, "--robot", "spot", "--json"
    )
    assert outcome.code == 0, outcome.stderr
    return json.loads(outcome.stdout), folder


def test_the_stairway_of_a_walk_is_found_with_its_measures(run: tuple[dict, Path]) -> None:
    values, _ = run
    (stairway,) = values["stairways"]
    (flight,) = stairway["flights"]
    assert flight["rise"] == pytest.approx(0.17, abs=0.005)
    assert flight["run"] == pytest.approx(0.28, abs=0.005)
    assert flight["width"] == pytest.approx(1.2, abs=0.05)
    assert flight["base"][2] == pytest.approx(0.0, abs=0.03)
    assert values["num_sweeps"] == 41
    # Spot walks twice as fast as usual here: a metre comes before a second.
    assert values["num_frames"] == pytest.approx(5, abs=2)
    assert values["assessments"][0]["verdict"] == "passable"


def test_the_run_folder_is_that_of_depth_images(run: tuple[dict, Path]) -> None:
    values, folder = run
    expected = {"config.yaml", "detections.jsonl", "log.txt", "report.html", "stairways.json",
    "stairways.ply", "summary.txt", "trajectory.tum"}  # fmt: skip
    assert expected <= {path.name for path in folder.iterdir()}
    lines = (folder / "detections.jsonl").read_text().splitlines()
    assert len(lines) == values["num_frames"]
    saved = json.loads((folder / "stairways.json").read_text())
    assert saved["frame_id"] == "odom"
    assert saved["num_frames"] == values["num_frames"]
    poses = np.loadtxt(folder / "trajectory.tum")
    assert len(poses) == values["num_frames"]
    checked = stairmap("check", folder, "--robot", "spot")
    assert checked.code == 0, checked.stderr
    exported = stairmap("export", folder, "-f", "ply", "-o", folder.parent / "out.ply")
    assert exported.code == 0, exported.stderr


def test_a_bag_with_clouds_alone_needs_no_option(walk: Path, tmp_path: Path, run: tuple[dict, Path]) -> None:
    outcome = stairmap("run", walk, "-o", tmp_path / "run", "--no-report")
    assert outcome.code == 0, outcome.stderr
    assert "41 sweeps of /livox/lidar in" in outcome.stdout
    saved = json.loads((tmp_path / "run" / "stairways.json").read_text())
    assert saved["stairways"] == json.loads((run[1] / "stairways.json").read_text())["stairways"]


def test_depth_images_go_before_clouds(walk: Path, tmp_path: Path) -> None:
    assert has_only_sweeps(walk)
    assert not has_only_sweeps(write_recording(tmp_path / "images"))
    assert not has_only_sweeps(tmp_path / "nowhere")
    ros = Ros("mcap")
    depth = ros.image(np.ones((8, 8)), 1)
    bag = write_bag(tmp_path, "mcap", ros, [(1, "/camera/depth/image_raw", depth)])
    assert not has_only_sweeps(bag)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--odometry",), "--odometry needs depth images"),
        (("--method", "delmerico2013"), "--method delmerico2013 needs depth images"),
        (("--camera", "camera.json"), "--camera needs depth images"),
        (("--cloud-topic", "/lidar"), "there is no such topic; did you mean /livox/lidar"),
        (("--cloud-topic", "/tf"), "expected a topic of type sensor_msgs/msg/PointCloud2"),
        (("--up", "auto"), "--up auto asks the floor in depth images"),
        (("--map-frame", "world"), "there is no such coordinate frame"),
    ],
)
def test_what_sweeps_cannot_do_is_said_in_a_line(
    walk: Path, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    outcome = stairmap("run", walk, "-o", tmp_path / "run", *options)
    assert outcome.code == 1
    assert message in outcome.stderr
    assert outcome.stderr.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_a_folder_of_images_has_no_sweeps(tmp_path: Path) -> None:
    outcome = stairmap("run", write_recording(tmp_path / "images"), "--cloud-topic", "/points")
    assert outcome.code == 1
    assert "expected a bag with sweeps of a LiDAR" in outcome.stderr


def test_a_batch_finds_the_same_stairways(walk: Path, run: tuple[dict, Path], tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    batch = stairmap("batch", walk, "-o", tmp_path / "fleet", "--workers", "0")
    assert batch.code == 0, batch.stderr
    for name in ("stairways.json", "detections.jsonl", "trajectory.tum", "config.yaml"):
        assert (tmp_path / "fleet" / "walk" / name).read_bytes() == (run[1] / name).read_bytes(), name
