"""``stairmap demo`` and ``stairmap simulate``, shortened."""

from __future__ import annotations

import json
import re
import sys

import pytest

from command_line import check_refused, stairmap
from stairmap.cli import demo as demo_module
from stairmap.export.loading import load_stairways


def test_demo_compares_both_methods_and_the_report_with_the_truth(tmp_path, monkeypatch):
    monkeypatch.setattr(demo_module, "NUM_FRAMES", 15)
    outcome = stairmap("demo", "-o", tmp_path / "demo")
    assert outcome.code == 0
    assert outcome.last_line == str(tmp_path / "demo")
    for row in ("true ", "stairmap ", "delmerico2013 ", "the report's robot, 2013 "):
        assert any(line.startswith(row) for line in outcome.stdout.splitlines())
    flight = load_stairways(tmp_path / "demo").stairways[0].flights[0]
    assert flight.rise == pytest.approx(0.165, abs=0.01)
    assert flight.run == pytest.approx(0.292, abs=0.01)
    page = (tmp_path / "demo" / "report.html").read_text()
    assert "<h3>Estimated against true" in page
    assert re.search(r'<td class="text">rise, mm</td><td>\d+</td><td>\d+ ± \d+(\.\d)?</td><td>[+-]', page)
    assert "<br>date: 2" in page and "<br>command: stairmap" in page and "/demo/recording" in page
    assert stairmap("inspect", tmp_path / "demo" / "recording").code == 0


def test_missing_ray_caster_is_named_before_a_folder_is_made(tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.partition(".")[0] == "embreex"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, "embreex", None)
    check_refused(stairmap("demo", "-o", tmp_path / "demo"), "embreex", "stairmap[sim]")
    check_refused(stairmap("simulate", "davis_rear", "-o", tmp_path / "out"), "stairmap[sim]")
    assert list(tmp_path.iterdir()) == []


def test_simulated_recording_runs_and_knows_its_truth(tmp_path):
    arguments = ("davis_rear", "--frames", "6", "--factor", "0.5", "--seed", "3", "--perfect-odometry")
    outcome = stairmap("simulate", *arguments, "-o", tmp_path / "hall")
    assert outcome.code == 0
    assert outcome.last_line == str(tmp_path / "hall")
    truth = json.loads((tmp_path / "hall" / "truth.json").read_text())
    assert truth["stairways"][0]["flights"][0]["run"] == pytest.approx(0.292, abs=0.003)
    assert stairmap("run", tmp_path / "hall", "-o", tmp_path / "out", "--no-report").code == 0


def test_simulate_never_overwrites(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    check_refused(stairmap("simulate", "ramp", "--frames", "2", "-o", tmp_path), "empty folder")


def test_all_scenes_are_listed():
    text = stairmap("simulate", "--list").stdout
    for name in ("davis_rear", "bookshelf", "kinect_v1", "turtlebot"):
        assert name in text
