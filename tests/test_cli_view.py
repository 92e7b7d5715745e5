"""``stairmap view`` end to end."""

from __future__ import annotations

import sys

import pytest

from command_line import check_refused, stairmap


def test_page_needs_no_extra_package(run_folder, tmp_path, monkeypatch):
    for name in ("rerun", "foxglove", "matplotlib", "jinja2"):
        monkeypatch.setitem(sys.modules, name, None)
    outcome = stairmap("view", run_folder, "--page", tmp_path / "run.html")
    assert outcome.code == 0
    assert outcome.last_line == str(tmp_path / "run.html")
    assert outcome.stderr == ""
    assert (tmp_path / "run.html").read_text().startswith("<!DOCTYPE html>")


def test_several_files_are_written_at_once(run_folder, tmp_path):
    pytest.importorskip("foxglove")
    page, mcap = tmp_path / "new" / "run.html", tmp_path / "new" / "run.mcap"
    outcome = stairmap("view", run_folder, "--foxglove", mcap, "--page", page, "--every", "2")
    assert outcome.code == 0
    assert outcome.stdout.split() == [str(page), str(mcap)]
    assert "4 frames" in page.read_text()
    assert mcap.read_bytes().startswith(b"\x89MCAP")


def test_moved_recording_is_told_and_the_rest_is_shown(run_folder, tmp_path):
    other = tmp_path / "run"
    other.mkdir()
    for name in ("stairways.json", "detections.jsonl", "trajectory.tum"):
        (other / name).write_bytes((run_folder / name).read_bytes())
    outcome = stairmap("view", other, "--page", tmp_path / "run.html")
    assert outcome.code == 0
    assert outcome.stderr.count("\n") == 1
    assert "--recording PATH" in outcome.stderr
    assert "stairway 1" in (tmp_path / "run.html").read_text()
    again = stairmap(
        "view", other, "--page", tmp_path / "again.html", "--recording", run_folder.parent / "stairs"
    )
    assert again.stderr == ""


def test_folder_that_is_no_run_is_refused(tmp_path):
    check_refused(stairmap("view", tmp_path, "--page", tmp_path / "p.html"), "stairmap run", "stairways.json")
    check_refused(stairmap("view", tmp_path / "nowhere", "--page", tmp_path / "p.html"), "there is no")


@pytest.mark.parametrize(
    ("package", "option", "extra"),
    [("rerun", "--save", "stairmap[rerun]"), ("foxglove", "--foxglove", "stairmap[foxglove]")],
)
def test_missing_package_is_one_line_that_names_the_extra(
    run_folder, tmp_path, monkeypatch, package, option, extra
):
    monkeypatch.setitem(sys.modules, package, None)
    path = tmp_path / {"--save": "run.rrd", "--foxglove": "run.mcap"}[option]
    check_refused(stairmap("view", run_folder, option, path), extra)
    assert not path.exists()


def test_a_bag_is_not_overwritten_by_a_file_for_foxglove(run_folder, tmp_path):
    (tmp_path / "walk.mcap").write_bytes(b"an hour of walking")
    check_refused(stairmap("view", run_folder, "--foxglove", tmp_path / "walk.mcap"), "is there already")
    assert (tmp_path / "walk.mcap").read_bytes() == b"an hour of walking"


@pytest.mark.parametrize("option", ["--save", "--page", "--foxglove"])
def test_a_file_of_another_kind_is_not_overwritten(run_folder, tmp_path, option):
    (tmp_path / "notes.txt").write_text("mine")
    assert stairmap("view", run_folder, option, tmp_path / "notes.txt").code == 2
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_window_without_rerun_names_the_extra_before_a_run_begins(run_folder, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    check_refused(stairmap("view", run_folder), "stairmap[rerun]")
    recording = run_folder.parent / "stairs"
    check_refused(stairmap("run", recording, "--view", "-o", tmp_path / "out"), "stairmap[rerun]")
    assert not (tmp_path / "out").exists()


def test_port_is_the_port_of_web(run_folder):
    outcome = stairmap("view", run_folder, "--port", "9000")
    assert outcome.code == 2
    assert "add --web" in outcome.stderr
