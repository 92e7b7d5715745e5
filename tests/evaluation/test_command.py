"""``stairmap evaluate`` from end to end."""

from __future__ import annotations

import json
from pathlib import Path

from command_line import check_refused, stairmap


def test_a_suite_prints_tables_and_writes_them_with_pictures(tmp_path: Path) -> None:
    outcome = stairmap(
        "evaluate", "table1", "--only", "b3", "--quick", "--width", "96", "--jobs", "1",
        "-o", tmp_path / "out", "--convergence",
    )  # fmt: skip
    assert outcome.code == 0
    assert outcome.last_line == str(tmp_path / "out")
    text = (tmp_path / "out" / "tables.md").read_text(encoding="utf-8")
    assert text.strip() in outcome.stdout
    trials = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))["trials"]
    assert [trial["method"] for trial in trials] == ["stairmap", "delmerico2013"]
    assert [trial["crash"] for trial in trials] == [None, None]
    assert len(list((tmp_path / "out").glob("convergence_b3_*.png"))) == 1


def test_wrong_choices_are_refused_before_anything_runs(tmp_path: Path) -> None:
    for arguments, word in (
        (("table1", "--only", "castle"), "castle"),
        (("table1", "--sensor", "eye"), "kinect_v1"),
        (("table1", "--robot", "rover"), "packbot"),
        (("rates",), "--output"),
        (("castles",), "table1"),
    ):
        outcome = stairmap("evaluate", *arguments)
        assert outcome.code == 2
        assert word in outcome.stderr
    check_refused(stairmap("evaluate", "buildings", "--data", tmp_path), "--data")
    check_refused(stairmap("evaluate", "real", "--data", tmp_path), "--data")


def test_kinds_print_a_line_for_each_and_json_for_each_view(tmp_path: Path) -> None:
    arguments = ("evaluate", "kinds", "--kind", "wide", "--quick", "--method", "stairmap", "--jobs", "1")
    outcome = stairmap(*arguments, "--cache", tmp_path)
    assert outcome.code == 0
    assert [line.split()[1] for line in outcome.stdout.splitlines()[2:]] == ["wide", "·", "·", "·"]
    outcome = stairmap(*arguments, "--cache", tmp_path, "--json")
    kinds = json.loads(outcome.stdout)["kinds"]["stairmap"]
    assert kinds["summaries"]["wide"]["num_views"] == len(kinds["views"]) == 15
    outcome = stairmap("evaluate", "kinds", "--kind", "castle")
    assert outcome.code == 2 and "overhang" in outcome.stderr
