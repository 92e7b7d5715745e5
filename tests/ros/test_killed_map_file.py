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
