"""``stairmap batch`` on one process of this machine, without dask."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys

import pytest

from cloud_files import write_binary_pcd
from command_line import check_refused, stairmap
from sampled_clouds import sampled_scene
from small_recordings import damage_image, write_recording
from stairmap.batch.table_files import read_table
from stairmap.export.loading import load_stairways


@pytest.fixture(scope="module")
def batch(recordings, tmp_path_factory):
    """The folder of a batch over all recordings and one that is not there."""
    folder = tmp_path_factory.mktemp("done") / "fleet"
    outcome = stairmap(
        "batch", recordings, recordings / "lost", "-o", folder, "--workers", "0", "--robot", "spot", "--json"
    )
    assert outcome.code == 0, outcome.stderr
    values = json.loads(outcome.stdout)
    assert (values["num_recordings"], values["num_done"], values["num_failed"]) == (6, 4, 2)
    assert "6 recordings, 1 worker" in outcome.stderr
    return folder


def test_each_recording_has_a_run_folder_as_run_writes_it(batch, recordings, tmp_path):
    for name in ("r0", "r1", "r2", "r3"):
        assert (batch / name / "summary.txt").exists() and (batch / name / "config.yaml").exists()
    outcome = stairmap("run", recordings / "r0", "-o", tmp_path / "run", "--no-report")
    assert outcome.code == 0
    for name in ("stairways.json", "detections.jsonl", "trajectory.tum", "history.jsonl", "recording.json"):
        assert (batch / "r0" / name).read_bytes() == (tmp_path / "run" / name).read_bytes(), name
    assert not list((batch / ".partial").iterdir())


def test_table_has_a_row_for_each_flight_each_empty_recording_and_each_failure(batch, recordings):
    rows = read_table(batch)
    assert [row["recording"].rpartition("/")[2] for row in rows] == ["broken", "r0", "r1", "r2", "r3", "lost"]
    by_name = {row["recording"].rpartition("/")[2]: row for row in rows}
    assert "'depth/none.png' is not there" in by_name["broken"]["error"]
    assert by_name["lost"]["error"].startswith("expected a recording, but there is no")
    flight = load_stairways(batch / "r0").stairways[0].flights[0]
    row = by_name["r0"]
    assert (row["rise"], row["run"], row["num_risers"]) == (flight.rise, flight.run, flight.num_risers)
    assert row["verdict_spot"] == "passable" and row["error"] == ""
    assert (
        by_name["r2"]["stairway"] is None
        and by_name["r2"]["error"] == ""
        and by_name["r2"]["num_frames"] == 5
    )
    with (batch / "batch.csv").open(newline="") as file:
        assert len(list(csv.DictReader(file))) == 6


def test_called_again_it_does_only_what_is_missing(batch, recordings, tmp_path):
    write_recording(tmp_path / "more", num_frames=5)
    before = (batch / "r0" / "task.json").stat().st_mtime_ns
    outcome = stairmap("batch", recordings, tmp_path / "more", "-o", batch, "--workers", "0")
    assert outcome.code == 0
    assert "6 recordings: 1 done, 4 done before, 1 failed; 4 stairways" in outcome.stdout
    assert outcome.last_line == str(batch)
    assert (batch / "r0" / "task.json").stat().st_mtime_ns == before
    assert (batch / "more" / "stairways.json").exists()


def test_end_is_told_for_all_recordings_and_what_was_done_before_counts_as_done(
    recordings, tmp_path, monkeypatch
):
    monkeypatch.setattr("stairmap.cli.progress.LINE_PERIOD", 0.0)
    first = stairmap("batch", recordings / "r0", "-o", tmp_path / "out", "--workers", "0")
    assert first.stderr.splitlines()[1:] == [
        f"recording 1/1 · 1 stairway · ends {first.stderr.splitlines()[1].rpartition(' ')[2]}"
    ]
    again = stairmap("batch", recordings / "r*", "-o", tmp_path / "out", "--workers", "0").stderr.splitlines()
    shown = [line.partition(" · ends ")[0] for line in again[1:]]
    assert shown == [
        "recording 2/4 · 2 stairways",
        "recording 3/4 · 2 stairways",
        "recording 4/4 · 3 stairways",
    ]
    assert all(re.fullmatch(r"\d\d:\d\d:\d\d", line.rpartition(" ")[2]) for line in again[1:])


def test_result_whose_answer_was_lost_is_found_and_not_made_again(batch, recordings, tmp_path):
    folder = tmp_path / "fleet"
    assert stairmap("batch", recordings / "r0", "-o", folder, "--workers", "0").code == 0
    (name,) = [line for line in (folder / "batch.jsonl").read_text().splitlines() if "stairways" not in line]
    (folder / "batch.jsonl").write_text(name + "\n")
    before = (folder / "r0" / "stairways.json").stat().st_mtime_ns
    assert "1 done" in stairmap("batch", recordings / "r0", "-o", folder, "--workers", "0").stdout
    assert (folder / "r0" / "stairways.json").stat().st_mtime_ns == before


def test_other_configuration_is_done_again_beside_the_first(recordings, tmp_path):
    folder = tmp_path / "fleet"
    for options in ((), ("--set", "detection.max_depth=5.0")):
        assert stairmap("batch", recordings / "r0", "-o", folder, "--workers", "0", *options).code == 0
    assert (folder / "r0" / "stairways.json").exists() and (folder / "r0_2" / "stairways.json").exists()
    (row,) = read_table(folder)
    assert row["folder"] == "r0_2"


def test_recording_that_breaks_off_keeps_what_was_seen(tmp_path):
    recording = write_recording(tmp_path / "cut", num_frames=5)
    damage_image(recording, 3)
    assert stairmap("batch", recording, "-o", tmp_path / "out", "--workers", "0").code == 0
    (row,) = read_table(tmp_path / "out")
    assert row["num_frames"] == 4 and row["rise"] is not None


def test_second_batch_into_one_folder_is_refused_while_the_first_runs(recordings, tmp_path):
    folder = tmp_path / "fleet"
    folder.mkdir()
    code = (
        "import sys, time\nfrom stairmap.batch.batch_folder import BatchFolder\n"
        f"with BatchFolder({str(folder)!r}, 'a'):\n    print('locked', flush=True)\n    time.sleep(600)\n"
    )
    owner = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert owner.stdout.readline() == "locked\n"
    outcome = stairmap("batch", recordings / "r0", "-o", folder, "--workers", "0")
    check_refused(outcome, "another batch is writing into", f"process {owner.pid}")
    owner.kill()
    owner.wait()
    assert stairmap("batch", recordings / "r0", "-o", folder, "--workers", "0").code == 0


def test_folder_of_something_else_and_a_file_are_refused(recordings, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    check_refused(stairmap("batch", recordings, "-o", tmp_path, "--workers", "0"), "no batch is in it")
    check_refused(stairmap("batch", recordings, "-o", tmp_path / "notes.txt", "--workers", "0"), "is a file")


def test_list_that_is_not_there_is_one_line(tmp_path):
    outcome = stairmap("batch", "@none.txt", "-o", tmp_path / "out", "--workers", "0")
    check_refused(outcome, "cannot read none.txt")


def test_workers_and_scheduler_exclude_each_other(tmp_path):
    outcome = stairmap(
        "batch", "x", "-o", tmp_path / "out", "--workers", "1", "--scheduler", "tcp://127.0.0.1:1"
    )
    assert outcome.code == 2 and "exclude each other" in outcome.stderr


def test_scheduler_that_is_not_there_is_one_line(recordings, tmp_path, monkeypatch):
    monkeypatch.setattr("stairmap.batch.cluster.CONNECT_TIMEOUT", 1.0)
    outcome = stairmap("batch", recordings, "-o", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9")
    check_refused(outcome, "no scheduler answers at tcp://127.0.0.1:9", "dask scheduler")
    outcome = stairmap("batch", recordings, "-o", tmp_path / "out", "--scheduler", "nonsense://x")
    check_refused(outcome, "no scheduler answers at nonsense://x")


def test_output_may_be_an_address_and_goes_on_there(recordings, tmp_path):
    store = f"file://{tmp_path}/store"
    first = stairmap("batch", f"file://{recordings}/r0", "-o", f"{store}/fleet", "--workers", "0")
    assert first.code == 0, first.stderr
    folder = tmp_path / "store" / "fleet"
    assert load_stairways(folder / "r0").stairways and (folder / "r0" / "task.json").exists()
    assert [row["folder"] for row in read_table(folder)] == ["r0"]
    both = [f"file://{recordings}/r0", f"file://{recordings}/r1"]
    again = stairmap("batch", *both, "-o", f"{store}/fleet", "--workers", "0")
    assert "2 recordings: 1 done, 1 done before" in again.stdout, again.stderr
    assert len(read_table(folder)) == 2
    lost = stairmap("batch", f"file://{recordings}/none", "-o", f"{store}/other", "--workers", "0")
    assert lost.code == 0 and "there is no file://" in read_table(tmp_path / "store" / "other")[0]["error"]


def test_worker_that_does_not_see_the_disk_sends_the_run_folder_back(recordings, tmp_path, monkeypatch):
    """The token that a worker looks for is another one, as on a disk of its own with the same path."""
    write = "stairmap.batch.output_place.LocalPlace.write"
    from stairmap.batch.output_place import TOKEN_FILE, LocalPlace  # noqa: PLC0415

    original = LocalPlace.write
    monkeypatch.setattr(
        write, lambda self, name, content: original(self, name, b"other" if name == TOKEN_FILE else content)
    )
    outcome = stairmap("batch", recordings / "r0", "-o", tmp_path / "out", "--workers", "0")
    assert outcome.code == 0, outcome.stderr
    assert load_stairways(tmp_path / "out" / "r0").stairways
    assert not list((tmp_path / "out" / ".partial").iterdir())


def test_what_a_process_that_is_gone_left_half_done_is_removed(recordings, tmp_path):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    partial = tmp_path / "out" / ".partial"
    host = os.uname().nodename
    for name in (f"r0-{host}-{gone.pid}", f"r1-{host}-{os.getpid()}", "r2-elsewhere-1"):
        (partial / name).mkdir(parents=True)
    assert stairmap("batch", recordings / "r2", "-o", tmp_path / "out", "--workers", "0").code == 0
    assert sorted(entry.name for entry in partial.iterdir()) == sorted(
        [f"r1-{host}-{os.getpid()}", "r2-elsewhere-1"]
    )


def test_cloud_is_looked_at_as_scan_does(tmp_path):
    points, _ = sampled_scene("free_standing", density=1000.0)
    write_binary_pcd(tmp_path / "hall.pcd", points)
    outcome = stairmap("batch", tmp_path / "hall.pcd", "-o", tmp_path / "fleet", "--workers", "0")
    assert outcome.code == 0, outcome.stderr
    assert stairmap("scan", tmp_path / "hall.pcd", "-o", tmp_path / "scan", "--no-report").code == 0
    for name in ("stairways.json", "detections.jsonl", "scan.json", "config.yaml", "stairways.ply"):
        assert (tmp_path / "fleet" / "hall" / name).read_bytes() == (tmp_path / "scan" / name).read_bytes(), (
            name
        )
    (row,) = read_table(tmp_path / "fleet")
    assert row["rise"] == load_stairways(tmp_path / "scan").stairways[0].flights[0].rise
