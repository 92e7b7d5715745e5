"""A clone in a workspace is built and tested by colcon, on the wheels of ROS 2."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from ros_environment import ENVIRONMENT, ROOT

pytestmark = [pytest.mark.nightly, pytest.mark.usefixtures("wheels")]

PACKAGES = {"stairmap", "stairmap_msgs", "stairmap_ros"}


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace with a clone of this repository."""
    install = ["-m", "pip", "install", "--quiet", "colcon-common-extensions", "pytest"]
    subprocess.run([ENVIRONMENT / "bin/python", *install], check=True, env=variables())
    folder = tmp_path_factory.mktemp("workspace")
    (folder / "src").mkdir()
    (folder / "src/clone").symlink_to(ROOT)
    return folder


def variables() -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    kept.pop("PYTHONPATH", None)
    return {
        **kept,
        "PATH": f"{ENVIRONMENT / 'bin'}{os.pathsep}{os.environ['PATH']}",
        "AMENT_PREFIX_PATH": str(ENVIRONMENT),
        "CMAKE_PREFIX_PATH": str(ENVIRONMENT),
    }


def colcon(workspace: Path, *arguments: str) -> str:
    ended = subprocess.run(
        [ENVIRONMENT / "bin/colcon", *arguments],
        cwd=workspace,
        env=variables(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def test_colcon_finds_builds_and_tests_our_three_packages(workspace: Path) -> None:
    listed = colcon(workspace, "list", "--names-only").split()
    assert set(listed) == PACKAGES
    colcon(workspace, "build", "--cmake-args", f"-DPython3_EXECUTABLE={ENVIRONMENT / 'bin/python'}")
    installed = workspace / "install/stairmap_ros/lib/stairmap_ros"
    assert {file.name for file in installed.iterdir()} == {
        "explorer",
        "play_recording",
        "print_stairways",
        "stairmap_node",
    }
    core = next((workspace / "install/stairmap").rglob("stairmap/navigation/robots"))
    assert list(core.glob("*.yaml"))
    colcon(workspace, "test", "--packages-select", "stairmap_ros", "--return-code-on-test-failure")
    assert "0 errors, 0 failures, 0 skipped" in colcon(workspace, "test-result")
