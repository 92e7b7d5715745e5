"""The explorer with the map's node, let loose in a simulated world that serves both of its actions."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ros_environment import ENVIRONMENT, RosEnvironment, wait_for

from stairmap.navigation.occupancy import FREE, load_map
from stairmap.simulation.storeys import make_shell
from stairmap.simulation.triangle_mesh import joined

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "exploration"))
from small_worlds import stairs

pytestmark = pytest.mark.usefixtures("wheels")

BIN = ENVIRONMENT / "bin"
CALL = """
import sys, rclpy
from std_srvs.srv import Trigger
rclpy.init()
node = rclpy.create_node("caller")
client = node.create_client(Trigger, f"explorer/{sys.argv[1]}")
client.wait_for_service(10)
answer = client.call_async(Trigger.Request())
rclpy.spin_until_future_complete(node, answer, timeout_sec=10)
assert answer.result().success
rclpy.shutdown()
"""
PLANT = Path(__file__).with_name("exploring_robot.py")
PILOT = Path(__file__).with_name("pilot_orders.py")


class Expedition:
    """A robot in a house of two floors, the map's node, and the explorer."""

    def __init__(
        self, ros: RosEnvironment, folder: Path, start: tuple[float, ...], *, stuck_after: int = 0
    ) -> None:
        self._ros, self._folder = ros, folder
        mesh, _ = stairs()
        house = joined([mesh, make_shell((0.0, 0.0, 6.6, 4.0), -0.1, 3.0)])
        world = folder / "world.npz"
        np.savez(
            world, vertices=house.vertices, triangles=house.triangles, start=start, stuck_after=stuck_after
        )
        self._outcome = folder / "outcome.json"
        self.robot = ros.start("robot", BIN / "python", PLANT, world, self._outcome)
        ros.start_node(robot="spot", reliability="reliable")

    def order(self) -> dict[str, Any]:
        """Let ``pilot_orders.py`` give its orders; return how they ended."""
        file = self._folder / "told.json"
        arguments = ("--ros-args", "-p", "robot:=spot", "-p", "reliability:=reliable")
        pilot = self._ros.start("pilot", BIN / "python", PILOT, file, *arguments)
        assert pilot.wait(timeout=120) == 0
        return dict(json.loads(file.read_text(encoding="utf-8")))

    def explore(self, **parameters: Any) -> subprocess.Popen[bytes]:
        """Start the explorer."""
        given = {"robot": "spot", "reliability": "reliable", "output": self._folder / "run", **parameters}
        arguments = [part for key, value in given.items() for part in ("-p", f"{key}:={value}")]
        return self._ros.start("explorer", BIN / "explorer", "--ros-args", *arguments)

    @property
    def log(self) -> str:
        """What the explorer has said."""
        file = self._ros.log_of("explorer")
        return file.read_text(encoding="utf-8") if file.exists() else ""

    def events(self, name: str) -> list[dict[str, Any]]:
        """Return the entries of ``decisions.jsonl`` of a kind."""
        file = self._folder / "run/decisions.jsonl"
        lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
        return [entry for entry in map(json.loads, lines) if entry["event"] == name]

    def call(self, service: str) -> None:
        """Call a service of the explorer."""
        assert self._ros.start("caller", BIN / "python", "-c", CALL, service).wait(timeout=60) == 0

    def outcome(self) -> dict[str, Any]:
        """End the robot and return what happened to it."""
        self.robot.terminate()
        self.robot.wait(timeout=20)
        return dict(json.loads(self._outcome.read_text(encoding="utf-8")))


def test_a_robot_turns_drives_pauses_and_climbs_as_it_is_told(
    ros_world: RosEnvironment, tmp_path: Path
) -> None:
    expedition = Expedition(ros_world, tmp_path, (0.6, 2.0, 0.0, 0.0), stuck_after=3)
    told = expedition.order()
    outcome = expedition.outcome()
    assert told["turn"] == told["drive"] == told["drive_back"] == told["climb"] == ["done", "", False]
    assert told["heading"] == pytest.approx(0.0, abs=0.01)
    assert told["link"] == [0, "passable", 6]
    assert told["while_paused"] == "running"
    assert told["moved_in_pause"] < 1e-6
    assert told["after_drive"][:2] == pytest.approx([1.4, 2.0], abs=0.08)
    assert told["after_climb"][2] == pytest.approx(0.9, abs=0.02)
    assert told["num_frames_on_stairs"] > 3
    assert told["climb_down"] == ["failed", "a leg is stuck", True]
    assert told["after_climb_down"][2] == pytest.approx(0.45, abs=0.02)
    assert told["lost"][0] == "failed"
    assert told["lost"][1].endswith("no way to the goal")
    assert outcome["falls"] == outcome["collisions"] == 0
    cancelled = [goal["end"] for goal in outcome["goals"] if goal.get("is_cancelled")]
    assert cancelled == [[2.8, 0.7], [1.4, 2.0]], "by the pause, and by the pilot's end"
    navigated = [goal["end"] for goal in outcome["goals"] if goal["kind"] == "navigate"]
    assert navigated.count([2.8, 0.7]) == 2, "the goal that a pause cancelled is sent again"


@pytest.mark.nightly
def test_a_robot_behind_two_actions_explores_both_floors(ros_world: RosEnvironment, tmp_path: Path) -> None:
    expedition = Expedition(ros_world, tmp_path, (1.0, 2.0, 0.0, 0.0))
    explorer = expedition.explore()
    assert explorer.wait(timeout=400) == 0
    outcome = expedition.outcome()
    assert outcome["falls"] == outcome["collisions"] == 0
    assert [goal["is_up"] for goal in outcome["goals"] if goal["kind"] == "climb"] == [True]
    assert outcome["height"] == pytest.approx(0.9, abs=0.03)
    assert expedition.events("stopped")[-1]["reason"] == "nothing reachable is left"
    (arrived,) = expedition.events("arrived")
    assert arrived["is_new"]
    for number, least in ((0, 15.0), (1, 10.0)):
        grid = load_map(tmp_path / "run/maps" / f"level_{number}.yaml")
        assert np.count_nonzero(grid.cells == FREE) * grid.resolution**2 > least


@pytest.mark.nightly
def test_without_an_action_server_it_says_so_and_an_interrupt_ends_it(
    ros_world: RosEnvironment, tmp_path: Path
) -> None:
    expedition = Expedition(ros_world, tmp_path, (1.0, 2.0, 0.0, 0.0))
    explorer = expedition.explore(navigate_action="nobody")
    told = "waiting for the action nobody: nobody serves it; is Nav2 active?"
    assert wait_for(lambda: told in expedition.log, seconds=60.0)
    explorer.send_signal(signal.SIGINT)
    assert explorer.wait(timeout=20) == 0
    assert expedition.events("stopped")[-1]["reason"] == "interrupted"
    assert expedition.outcome()["goals"] == []


@pytest.mark.nightly
def test_it_pauses_goes_on_and_stops_when_it_is_told(ros_world: RosEnvironment, tmp_path: Path) -> None:
    expedition = Expedition(ros_world, tmp_path, (1.0, 2.0, 0.0, 0.0))
    explorer = expedition.explore()
    assert wait_for(lambda: bool(expedition.events("entered level")), seconds=60.0)
    expedition.call("pause")
    time.sleep(1.0)
    num = len(expedition.events("decision"))
    time.sleep(2.0)
    assert len(expedition.events("decision")) == num
    expedition.call("resume")
    assert wait_for(lambda: len(expedition.events("decision")) > num, seconds=60.0)
    expedition.call("stop")
    assert explorer.wait(timeout=20) == 0
    assert expedition.events("stopped")[-1]["reason"] == "stopped"


@pytest.mark.parametrize(
    ("parameters", "told"),
    [
        ({}, "expected the parameter robot"),
        ({"robot": "spot", "output": "."}, "not empty"),
        ({"robots": "spot"}, "there is no parameter robots; did you mean robot?"),
        ({"robot": "nobody"}, "nobody"),
    ],
)
@pytest.mark.nightly
def test_what_it_cannot_start_with_is_told_in_a_line(
    ros_world: RosEnvironment, parameters: dict[str, str], told: str
) -> None:
    arguments = [part for key, value in parameters.items() for part in ("-p", f"{key}:={value}")]
    explorer = ros_world.start("explorer", BIN / "explorer", "--ros-args", *arguments)
    assert explorer.wait(timeout=60) == 1
    (line,) = ros_world.log_of("explorer").read_text(encoding="utf-8").splitlines()
    assert line.startswith("explorer: ")
    assert told in line
