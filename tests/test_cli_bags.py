"""A bag through the command line gives what the image folder with the same frames gives."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from bag_files import DEPTH_TOPIC, Ros, depth_messages, robot_messages, write_bag
from command_line import check_refused, stairmap
from small_recordings import write_recording
from stairmap.recordings.image_folder import ImageFolderRecording

QUIET = ("--no-report", "--json")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_recording(tmp_path_factory.mktemp("images") / "walk")


@pytest.fixture(scope="module")
def expected(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    outcome = stairmap("run", folder, "-o", tmp_path_factory.mktemp("runs") / "run", *QUIET)
    assert outcome.code == 0, outcome.stderr
    values: dict[str, Any] = json.loads(outcome.stdout)
    assert len(values["stairways"]) == 1
    return values


def bag_of(folder: Path, target: Path, kind: str) -> Path:
    ros = Ros(kind)
    return write_bag(target, kind, ros, robot_messages(ros, ImageFolderRecording(folder)))


def check_close(mine: Any, true: Any) -> None:
    """Equal but for rounding of the poses, all through the JSON."""
    if isinstance(true, dict):
        assert mine.keys() == true.keys()
        for key, value in true.items():
            check_close(mine[key], value)
    elif isinstance(true, list):
        assert len(mine) == len(true)
        for one, other in zip(mine, true, strict=True):
            check_close(one, other)
    elif isinstance(true, float):
        assert mine == pytest.approx(true, abs=1e-4)
    else:
        assert mine == true


@pytest.mark.parametrize("kind", ["ros1_lz4", "sqlite_humble", "mcap_zstd", "bare_db3", "bare_mcap"])
def test_run_on_a_bag_finds_the_same_stairway(
    kind: str, folder: Path, expected: dict[str, Any], tmp_path: Path
) -> None:
    outcome = stairmap("run", bag_of(folder, tmp_path, kind), "-o", tmp_path / "run", *QUIET)
    assert outcome.code == 0, outcome.stderr
    values = json.loads(outcome.stdout)
    check_close(values["stairways"], expected["stairways"])
    for key in ("num_frames", "num_detections", "num_frames_without_pose", "problems", "reasons"):
        assert values[key] == expected[key]
    written = json.loads((tmp_path / "run" / "stairways.json").read_text())
    assert written["frame_id"] == "map"


def test_map_frame_of_the_results_is_named(folder: Path, tmp_path: Path) -> None:
    bag = bag_of(folder, tmp_path, "bare_mcap")
    outcome = stairmap("run", bag, "-o", tmp_path / "run", "--map-frame", "odom", *QUIET)
    assert outcome.code == 0, outcome.stderr
    assert json.loads((tmp_path / "run" / "stairways.json").read_text())["frame_id"] == "odom"


def test_detect_and_frames_of_inspect_work_on_a_bag(folder: Path, tmp_path: Path) -> None:
    bag = bag_of(folder, tmp_path, "bare_mcap")
    outcome = stairmap("detect", bag, "-o", tmp_path / "run", "--json")
    assert json.loads(outcome.stdout)["num_detections"] == 8
    assert len(list((tmp_path / "run" / "overlays").iterdir())) == 8
    outcome = stairmap("inspect", bag, "--frame", "5", "-o", tmp_path / "frame.png")
    assert outcome.code == 0
    assert "frame 5 of walk, stamp 500000000 ns" in outcome.stdout


def test_floor_tells_up_in_a_bag_too(folder: Path, tmp_path: Path) -> None:
    bag = bag_of(folder, tmp_path, "bare_mcap")
    outcome = stairmap("run", bag, "-o", tmp_path / "run", "--up=auto", *QUIET)
    assert outcome.code == 0, outcome.stderr
    assert "the map was turned by 0." in outcome.stderr


def test_inspect_tells_what_a_strange_bag_holds(folder: Path, tmp_path: Path) -> None:
    bag = bag_of(folder, tmp_path, "bare_mcap")
    outcome = stairmap("inspect", bag)
    assert outcome.code == 0
    for words in (
        f"depth topic   {DEPTH_TOPIC}",
        "camera info   /camera/depth/camera_info",
        "camera frame  camera_depth_optical_frame",
        "poses from    transforms, map to camera_depth_optical_frame",
        "coord. frames base_link, camera_depth_optical_frame, camera_link, map, odom",
        "poses         8; 8 of 8 frames have one",
    ):
        assert words in outcome.stdout
    assert ["/chatter", "std_msgs/msg/String", "1"] in [line.split() for line in outcome.stdout.splitlines()]
    values = json.loads(stairmap("inspect", bag, "--json").stdout)["bag"]
    assert values["map_frame"] == "map"
    assert {"name": "/tf", "type": "tf2_msgs/msg/TFMessage", "num_messages": 16} in values["topics"]


def test_inspect_lists_the_topics_of_a_bag_that_cannot_be_used(folder: Path, tmp_path: Path) -> None:
    ros = Ros("mcap")
    messages = robot_messages(ros, ImageFolderRecording(folder))
    path = write_bag(tmp_path, "bare_mcap", ros, [one for one in messages if one[1] != DEPTH_TOPIC])
    outcome = stairmap("inspect", path)
    assert outcome.code == 1
    assert "/camera/depth/camera_info  sensor_msgs/msg/CameraInfo         8" in outcome.stdout
    assert outcome.stderr.startswith("error: no topic has depth images")
    topics = json.loads(stairmap("inspect", path, "--json").stdout)["bag"]["topics"]
    assert [topic["name"] for topic in topics] == sorted(topic["name"] for topic in topics)


def test_inspect_says_why_a_bag_gives_no_poses(folder: Path, tmp_path: Path) -> None:
    ros = Ros("mcap")
    path = write_bag(tmp_path, "bare_mcap", ros, depth_messages(ros, ImageFolderRecording(folder)))
    assert (
        "poses from    none: the bag has neither transforms nor odometry" in stairmap("inspect", path).stdout
    )


def test_run_without_poses_is_refused_before_anything_is_written(folder: Path, tmp_path: Path) -> None:
    ros = Ros("mcap")
    path = write_bag(tmp_path, "bare_mcap", ros, depth_messages(ros, ImageFolderRecording(folder)))
    outcome = stairmap("run", path, "-o", tmp_path / "run")
    check_refused(outcome, "neither transforms nor odometry", "--trajectory FILE", "stairmap detect")
    assert not (tmp_path / "run").exists()


def test_cut_off_bag_is_run_and_the_loss_is_told(folder: Path, tmp_path: Path) -> None:
    path = bag_of(folder, tmp_path, "ros1")
    path.write_bytes(path.read_bytes()[:-2000])
    outcome = stairmap("run", path, "-o", tmp_path / "run", *QUIET)
    assert outcome.code == 0, outcome.stderr
    problems = json.loads(outcome.stdout)["problems"]
    assert any("walk.bag is cut off at its end; all that can be read is used" in line for line in problems)
    assert json.loads(outcome.stdout)["stairways"]


def test_plan_opens_the_bag_as_the_run_did(folder: Path, tmp_path: Path) -> None:
    ros = Ros("mcap")
    messages = robot_messages(ros, ImageFolderRecording(folder))
    other = [(at, f"/rear{topic}", one) for at, topic, one in messages if topic == DEPTH_TOPIC]
    bag = write_bag(tmp_path, "bare_mcap", ros, [*messages, *other])
    check_refused(stairmap("run", bag, "-o", tmp_path / "run"), "2 topics with depth images", "--depth-topic")
    outcome = stairmap("run", bag, "-o", tmp_path / "run", "--depth-topic", DEPTH_TOPIC, *QUIET)
    assert outcome.code == 0, outcome.stderr
    outcome = stairmap("plan", tmp_path / "run", "--recording", bag, "-o", tmp_path / "plan")
    assert outcome.code == 0, outcome.stderr


def test_raw_units_of_a_quarter_millimetre_are_told(tmp_path: Path) -> None:
    ros, walk = Ros("mcap"), ImageFolderRecording(write_recording(tmp_path / "images", num_frames=16))
    bag = write_bag(tmp_path, "mcap", ros, robot_messages(ros, walk, values_per_metre=4000.0))
    told = "depth fits the camera's way only if it is 0.25 times what was read"
    outcome = stairmap("run", bag, "-o", tmp_path / "run", *QUIET)
    assert told in outcome.stderr
    assert "depth_scale 4 times as large (4000 instead of 1000)" in outcome.stderr
    assert any(
        told in problem for problem in json.loads(stairmap("inspect", bag, "--json").stdout)["problems"]
    )
