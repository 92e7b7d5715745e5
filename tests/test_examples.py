"""The examples run, and are short."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from cloud_files import write_binary_pcd
from command_line import stairmap
from sampled_clouds import sampled_scene
from small_recordings import write_recording

FOLDER = Path(__file__).parents[1] / "examples"


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("recordings") / "stairs")


def run_example(name, *arguments):
    command = [sys.executable, str(FOLDER / name), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_one_image(recording):
    text = run_example("01_one_image.py", recording / "depth/000004.png", recording / "camera.json")
    assert "ascending" in text
    assert "step 0: from [" in text


def test_recording(recording):
    text = run_example("02_recording.py", recording)
    assert "stairway 1" in text
    assert "risers of 1" in text


def test_own_poses():
    text = run_example("03_own_poses.py")
    assert text.index("as the poses came") < text.index("after the loop closure") < text.index("the truth")


def test_can_my_robot_climb_it(recording, tmp_path):
    assert stairmap("run", recording, "-o", tmp_path / "run", "--no-report").code == 0
    text = run_example("04_can_my_robot_climb_it.py", tmp_path / "run", "spot")
    assert "stairway 1: passable for Boston Dynamics Spot" in text
    assert "joins floor 0 and floor 1 (unexplored)" in text


def test_scan_a_map(tmp_path):
    points, (flight,) = sampled_scene("free_standing")
    write_binary_pcd(tmp_path / "hall.pcd", points)
    text = run_example("05_scan_a_map.py", tmp_path / "hall.pcd", "spot")
    assert f"stairway 1: {flight.num_risers} risers" in text
    assert f"rise {flight.rise * 1e3:.0f}" in text
    assert "passable for Boston Dynamics Spot" in text


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.name)
def test_example_is_at_most_60_lines(path):
    assert len(path.read_text().splitlines()) <= 60
