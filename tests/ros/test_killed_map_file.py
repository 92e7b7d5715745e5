"""A node that is killed while it saves its map: the file that is there is whole, old or new."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from ros_environment import RosEnvironment
from test_stairway_map import new_map

import stairmap
from stairmap.export.loading import load_stairways
from stairmap_ros.map_file import load_map

SAVER = """
import sys
from pathlib import Path
from stairmap_ros.map_file import save_map
from test_stairway_map import shown_map

stairway_map = shown_map()
stairway_map.stairways()
snapshot = stairway_map.snapshot()
while True:
    save_map(Path(sys.argv[1]), snapshot, map_frame="map")
"""


def kill_while_saving(path: Path, seconds: float) -> None:
    folders = [
        Path(__file__).parent,
        Path(__file__).parents[1],
        Path(__file__).parents[2] / "ros/stairmap_ros",
    ]
    folders.append(Path(stairmap.__file__).parents[1])
    process = subprocess.Popen(
        [sys.executable, "-c", SAVER, str(path)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, folders))},
    )
    deadline = time.monotonic() + 60
    while not path.with_suffix(".json").exists() and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.01)
    time.sleep(seconds)
    process.send_signal(signal.SIGKILL)
    assert process.wait(timeout=30) == -signal.SIGKILL


def check_map(path: Path) -> None:
    restored = new_map()
    assert load_map(path, restored, map_frame="map") == 12
    assert len(restored.stairways()) == 1
    assert len(load_stairways(path.with_suffix(".json")).stairways) == 1


def test_map_of_a_node_that_was_killed_is_whole(tmp_path: Path) -> None:
    kill_while_saving(tmp_path / "map.npz", 0.05)
    check_map(tmp_path / "map.npz")


@pytest.mark.nightly
def test_map_of_a_node_killed_at_twenty_moments_is_whole(tmp_path: Path) -> None:
    moments = random.Random(2)
    for number in range(20):
        path = tmp_path / f"map{number}.npz"
        kill_while_saving(path, moments.uniform(0.0, 0.5))
        check_map(path)


@pytest.mark.nightly
@pytest.mark.usefixtures("wheels")
def test_node_killed_at_twenty_moments_of_a_drive_goes_on_from_its_map(
    ros: RosEnvironment, tmp_path: Path
) -> None:
    moments = random.Random(3)
    path = tmp_path / "hall.npz"
    num_images = []
    for _ in range(20):
        node, robot = ros.start_node(map_file=path, map_save_period=0.5), ros.start_robot()
        time.sleep(moments.uniform(2.0, 8.0))
        for process in (node, robot):
            process.kill()
        assert node.wait(timeout=30) == -signal.SIGKILL
        robot.wait(timeout=30)
        if path.exists():
            num_images.append(load_map(path, new_map(), map_frame="map"))
            load_stairways(path.with_suffix(".json"))
    # The node was killed while it had something to lose, and each went on from the one before.
    assert len(num_images) >= 10 and num_images[-1] > 0
    assert num_images == sorted(num_images)
