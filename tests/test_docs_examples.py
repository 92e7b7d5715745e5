"""Every example of README and docs runs, in the order of its page, on what its reader has."""

from __future__ import annotations

import io
import re
import shlex
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analytic_stairs import pose_looking, render_depth
from command_line import stairmap
from documented_blocks import PAGES, ROOT, Block, all_blocks, blocks_of
from readers_files import write_named_files
from small_recordings import STAIRS, write_recording
from stairmap import load_robot, open_recording
from stairmap.camera import PinholeCamera
from stairmap.exploration.body import load_body
from stairmap.exploration.odometry import Planar
from stairmap.exploration.simulated_pilot import SimulatedPilot
from stairmap.exploration.simulated_robot import SimulatedRobot
from stairmap.exploration.world import World
from stairmap.navigation.floors import find_floors
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.simulation.odometry import PERFECT_ODOMETRY
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.storeys import make_shell, make_slab
from stairmap.simulation.triangle_mesh import joined
from walkable_stairways import make_flight, make_stairway

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SPOT = load_body("spot")

LANGUAGES = {"sh", "console", "python", "json", "yaml", "text"}

NOT_RUN = {
    "the building is no part of the project": 6,
    "the cloud is no part of the project": 1,
    "the recordings are no part of the project": 1,
    "it installs packages of the system": 2,
    "it needs Docker": 2,
    "it needs ROS": 5,
    "goes on with a mission that was stopped": 1,
    "it needs a camera": 1,
    "it needs a cluster": 5,
    "it needs a display": 1,
    "it needs pandas": 1,
    "it takes hours": 2,
}
"""How many blocks are not run here, by their reasons; one more is to be thought about."""

PLANNED = 3
"""Exit code of ``plan`` where there is no way: an answer."""

_INSTALLS = re.compile(r"(\S*/)?(pip|pipx) install |(\S*/)?python3? -m venv ")
_MAKES = re.compile(r"make [\w -]+$")


def test_each_block_says_what_it_is() -> None:
    assert [block for block in all_blocks() if block.language not in LANGUAGES] == []
    # An example is not hidden as mere text.
    for block in all_blocks():
        if block.language == "text":
            assert not re.match(r"(\$ |stairmap |make |pip |python3? |\.venv)", block.text), block


def test_what_is_not_run_is_counted_and_says_why() -> None:
    assert Counter(block.not_run for block in all_blocks() if block.not_run) == NOT_RUN


def is_run(block: Block, *languages: str) -> bool:
    return block.language in languages and not block.not_run


COMMAND_PAGES = [page for page in PAGES if any(is_run(b, "sh", "console") for b in blocks_of(page))]
PYTHON_PAGES = [page for page in PAGES if any(is_run(b, "python") for b in blocks_of(page))]


@pytest.mark.nightly
@pytest.mark.parametrize("page", COMMAND_PAGES, ids=lambda page: page.name)
def test_commands_of_a_page_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:/usr/bin:/bin")
    blocks = [block for block in blocks_of(page) if is_run(block, "sh", "console")]
    write_named_files(tmp_path, "\n".join(block.text for block in blocks))
    for block in blocks:
        printed = "".join(run_line(line, block) for line in block.commands())
        if block.language == "console":
            assert words(block.printed()) == words(printed), (block.page, block.line)


def words(text: str) -> list[str]:
    """The words of an output: numbers differ by what is rounded where, the rest must be as it is shown."""
    return re.findall(r"[a-z_]{2,}", text)


def run_line(line: str, block: Block) -> str:
    """Run one command and return what it printed; what installs or makes something is looked up instead."""
    place = f"{block.page}, line {block.line}: {line}"
    printed = ""
    for part in line.split(" && "):
        if _INSTALLS.match(part):
            check_extras(part)
        elif _MAKES.match(part):
            assert set(part.split()[1:]) <= make_targets(), place
        else:
            program, *arguments = shlex.split(part)
            assert program.removeprefix(".venv/bin/") == "stairmap", f"not known how to run: {place}"
            outcome = stairmap(*arguments)
            skip_without_extra(outcome.stderr, block)
            assert outcome.code in {0, PLANNED if arguments[0] == "plan" else 0}, (place, outcome.stderr)
            printed += outcome.stdout
    return printed


def skip_without_extra(told: str, block: Block) -> None:
    """Skip what needs a package that is not here, if the example installs its extra."""
    missing = re.search(r"needs the package (\S+), which is not installed.*stairmap\[(\w+)\]", told)
    if missing and re.search(rf"stairmap\[[\w,]*\b{missing[2]}\b", block.text):
        pytest.skip(f"{block.page}, line {block.line}: {missing[1]} is not installed here")


def check_extras(line: str) -> None:
    """Check that the extras which a line installs are there, or that it installs no stairmap."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        known = tomllib.load(file)["project"]["optional-dependencies"]
    for extras in re.findall(r"(?:stairmap|\.)\[([\w,]+)\]", line):
        assert set(extras.split(",")) <= set(known), line


def make_targets() -> set[str]:
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    return {name for line in re.findall(r"^\.PHONY: (.+)$", text, re.MULTILINE) for name in line.split()}


@pytest.mark.parametrize("page", PYTHON_PAGES, ids=lambda page: page.name)
def test_python_of_a_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO('{"task": "frame"}\n{"task": "cloud"}\n'))
    blocks = [block for block in blocks_of(page) if is_run(block, "python")]
    write_named_files(tmp_path, "\n".join(block.text for block in blocks))
    names = given_names(page.name, tmp_path)
    for block in blocks:
        code = compile("\n" * block.line + block.text, f"{block.page}", "exec")
        exec(code, names)


def given_names(page: str, folder: Path) -> dict[str, Any]:
    """What the text around the examples of a page presupposes."""
    if page == "quickstart.md":
        recording = open_recording(write_recording(folder / "mine"))
        camera = PinholeCamera(width=640, height=480, fx=585.0, fy=585.0, cx=319.5, cy=239.5)
        poses = [pose_looking((-2.2 + 0.1 * index, 0.0, 0.9), down=0.3) for index in range(2)]
        depths = [render_depth(STAIRS, camera, pose) for pose in poses]
        frames = [
            (index * 10**8, depth, pose)
            for index, (depth, pose) in enumerate(zip(depths, poses, strict=True))
        ]
        return {"depth": depths[0], "frames": frames, "trajectory": recording.check_poses()}
    if page == "clouds.md":
        write_named_files(folder, "slam_map.pcd")
        return {"path": folder / "slam_map.pcd"}
    if page == "navigation.md":
        stairways = [
            make_stairway(make_flight(base=(4.0, 2.0 + 3 * level, 3.0 * level)), stairway_id=level + 1)
            for level in range(3)
        ]
        grid = OccupancyGrid(cells=np.zeros((100, 100), dtype=np.int8), resolution=0.2, origin=(0, 0))
        return {
            "stairways": stairways,
            "floors": find_floors(stairways),
            "grids": dict.fromkeys(range(4), grid),
            "robot": load_robot("spot"),
        }
    if page == "exploration.md":
        start, robot = robot_in_a_room()
        return {
            "body": SPOT,
            "start": start,
            "MyPilot": lambda known: SimulatedPilot(robot, known, make_sensor("kinect_v2", factor=0.25)),
            "seconds": lambda: robot.counters.time_s,
        }
    return {}


def robot_in_a_room() -> tuple[Planar, SimulatedRobot]:
    """A robot in a bare room of 3 by 3 m, and where it starts."""
    room = (0.0, 0.0, 3.0, 3.0)
    world = World(joined([make_slab(room, 0.0), make_shell(room, 0.0, 2.6)]))
    start = Planar(x=1.5, y=1.5, z=0.0, heading=0.0)
    sensor = make_sensor("kinect_v2", factor=0.25)
    return start, SimulatedRobot(world, SPOT, sensor, start, seed=0, model=PERFECT_ODOMETRY)
