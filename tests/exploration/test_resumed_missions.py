"""Missions that were stopped go on where they were, and none that belongs to something else."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import pytest
from small_worlds import stairs
from test_missions import events, explore, write_mesh

from command_line import check_refused
from stairmap.exploration.mission_state import STATE_FILE
from stairmap.exploration.simulated_robot import SimulatedRobot
from stairmap.recordings.open import open_recording
from stairmap.simulation.storeys import make_shell
from stairmap.simulation.triangle_mesh import joined

LOOKS = 25
"""The mission of the small house is stopped after so many frames, on the lower floor."""


@pytest.fixture(scope="module")
def buildings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("buildings")
    mesh, _ = stairs()
    write_mesh(folder / "house", joined([mesh, make_shell((0.0, 0.0, 6.6, 4.0), -0.1, 3.0)]))
    write_mesh(folder / "lower", joined([mesh, make_shell((0.0, 0.0, 6.6, 4.0), -0.1, 2.8)]))
    return folder


@pytest.fixture(scope="module")
def stopped(buildings, tmp_path_factory):
    """Run folder of a mission that SIGTERM stopped in the middle."""
    folder = tmp_path_factory.mktemp("missions") / "run"
    look, num = SimulatedRobot.look, 0

    def counted_look(robot, **options):
        nonlocal num
        num += 1
        if num == LOOKS:
            signal.raise_signal(signal.SIGTERM)
        return look(robot, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SimulatedRobot, "look", counted_look)
        outcome = explore(buildings, "house", "--start", "1,2,0", "-o", folder)
    assert outcome.code == 128 + signal.SIGTERM, outcome.stderr
    return folder


@pytest.fixture
def run(stopped, tmp_path):
    """Return a copy of that run folder."""
    return shutil.copytree(stopped, tmp_path / "run")


def check_is_whole(folder):
    """Check a mission that came to its end: both floors, and logs without gaps or repetitions."""
    result = json.loads((folder / "exploration.json").read_text(encoding="utf-8"))
    assert result["stopped"] == "nothing reachable is left"
    assert result["floors_reached"] == 2
    assert result["falls"] == result["collisions"] == 0
    assert [level["height"] for level in result["levels"]] == pytest.approx([0.0, 0.9], abs=0.03)
    assert len(events(folder, "climb")) == result["stairs_climbed"] == 1
    times = [entry["time_s"] for entry in events(folder, "decision")]
    assert times == sorted(set(times))
    assert len(result["coverage"]) == len(times)
    stamps = [
        json.loads(line)["stamp_ns"]
        for line in (folder / "detections.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    assert stamps == sorted(set(stamps))
    assert len((folder / "trajectory.tum").read_text(encoding="utf-8").splitlines()) == len(stamps) + 1
    recorded = [frame.stamp_ns for frame in open_recording(folder / "recording")]
    assert set(recorded) <= set(stamps)
    assert len(list((folder / "recording" / "depth").glob("*.png"))) == len(recorded)
    assert not (folder / STATE_FILE).exists()


def test_a_mission_that_was_stopped_is_saved_and_goes_on_to_its_end(buildings, run):
    before = json.loads((run / "exploration.json").read_text(encoding="utf-8"))
    assert before["stopped"] == "interrupted"
    assert before["floors_reached"] == 1
    outcome = explore(buildings, "house", "--resume", run)
    assert outcome.code == 0, outcome.stderr
    assert [entry["time_s"] for entry in events(run, "resumed")] == [
        pytest.approx(before["time_s"], abs=0.06)
    ]
    check_is_whole(run)


def test_a_mission_is_resumed_in_its_own_world_with_its_own_options_only(buildings, run):
    check_refused(explore(buildings, "lower", "--resume", run), "another world")
    check_refused(explore(buildings, "house", "--robot", "go2", "--resume", run), "another robot")
    check_refused(explore(buildings, "house", "--seed", "3", "--resume", run), "--seed 0", "now it is 3")
    assert json.loads((run / "exploration.json").read_text(encoding="utf-8"))["stopped"] == "interrupted"
    for option, value in (("--start", "1,2,0"), ("-o", run)):
        outcome = explore(buildings, "house", option, value, "--resume", run)
        assert outcome.code == 2
        assert "exclude each other" in outcome.stderr


def test_a_folder_without_a_saved_mission_or_with_a_damaged_one_is_refused_and_kept(buildings, run):
    state = run / STATE_FILE
    content = state.read_bytes()
    state.write_bytes(content[: len(content) // 2])
    check_refused(explore(buildings, "house", "--resume", run), "state.npz", "cut off")
    state.write_bytes(content)
    log = run / "decisions.jsonl"
    log.write_text(log.read_text(encoding="utf-8").partition("\n")[0] + "\n", encoding="utf-8")
    check_refused(explore(buildings, "house", "--resume", run), "decisions.jsonl", "entries")
    assert (run / "exploration.json").is_file()
    state.unlink()
    check_refused(explore(buildings, "house", "--resume", run), "nothing to resume")


@pytest.mark.nightly
def test_a_mission_that_was_killed_with_odometry_error_goes_on_to_its_end(buildings, tmp_path):
    run = tmp_path / "run"
    command = [
        sys.executable, "-m", "stairmap", "explore", "building:house", "--buildings", str(buildings),
        "--no-report",
    ]  # fmt: skip
    with subprocess.Popen([*command, "--start", "1,2,0", "-o", str(run)], env=os.environ) as process:
        try:
            while process.poll() is None:
                time.sleep(0.05)
                if (run / STATE_FILE).exists() and len(events(run, "decision")) >= 3:
                    break
            assert process.poll() is None
        finally:
            process.kill()
    assert not (run / "exploration.json").exists()
    outcome = subprocess.run([*command, "--resume", str(run)], check=False, capture_output=True, text=True)
    assert outcome.returncode == 0, outcome.stderr
    check_is_whole(run)
