"""The launch file starts the node and RViz with the topics and the clock that it was given."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from ros_environment import ENVIRONMENT, ROOT

pytestmark = pytest.mark.usefixtures("wheels")

NODE = ROOT / "ros/stairmap_ros"
PYTHON = ENVIRONMENT / "bin/python"


def variables(prefix: Path) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    kept["PYTHONPATH"] = os.environ.get("STAIRMAP_LAUNCH_PATH", "")
    return {
        **kept,
        "AMENT_PREFIX_PATH": f"{prefix}{os.pathsep}{ENVIRONMENT}",
        "ROS_DOMAIN_ID": str(os.getpid() % 100 + 1),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOG_DIR": str(prefix / "log"),
    }


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """An installed stairmap_ros, and an rviz2 that only says what it was given."""
    imports = [PYTHON, "-c", "import launch, launch_ros.actions"]
    if subprocess.run(imports, env=variables(tmp_path), capture_output=True, check=False).returncode:
        pytest.skip("the launch file was not run: launch and launch_ros are not in the wheels of ROS 2")
    for package in ("stairmap_ros", "rviz2"):
        index = tmp_path / "share/ament_index/resource_index/packages"
        index.mkdir(parents=True, exist_ok=True)
        (index / package).touch()
        (tmp_path / "lib" / package).mkdir(parents=True)
    for folder in ("config", "launch", "rviz"):
        shutil.copytree(NODE / folder, tmp_path / "share/stairmap_ros" / folder)
    (tmp_path / "lib/stairmap_ros/stairmap_node").symlink_to(ENVIRONMENT / "bin/stairmap_node")
    viewer = tmp_path / "lib/rviz2/rviz2"
    viewer.write_text('#!/bin/sh\necho "rviz2 was started with $@"\nexec sleep 60\n')
    viewer.chmod(0o755)
    return tmp_path


def test_the_launch_file_hands_topics_and_clock_to_node_and_rviz(prefix: Path) -> None:
    arguments = ["image:=/front/depth", "info:=/front/info", "use_sim_time:=true", "rviz:=true"]
    ended = subprocess.run(
        [
            PYTHON,
            Path(__file__).with_name("run_launch_file.py"),
            prefix / "share/stairmap_ros/launch/stairmap.launch.py",
            *arguments,
        ],
        env=variables(prefix),
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    said = ended.stdout + ended.stderr
    assert ended.returncode == 0, said
    assert "no depth image ever came on /front/depth; no camera_info ever came on /front/info" in said
    assert "use_sim_time is true, but nothing comes on /clock" in said
    (viewer,) = [line for line in said.splitlines() if "rviz2 was started" in line]
    assert "/depth/image_rect_raw:=/front/depth" in viewer
    assert "/depth/camera_info:=/front/info" in viewer
    (file,) = [word for word in viewer.split() if word.startswith("/tmp/launch_params")]
    assert "use_sim_time: true" in Path(file).read_text()
