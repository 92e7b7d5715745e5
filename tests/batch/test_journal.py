from __future__ import annotations

import pytest

from stairmap.batch.job import BatchSettings, RecordingResult
from stairmap.batch.journal import BatchJournal
from stairmap.errors import ResultsError


def result(recording, folder, fingerprint="a", **values):
    return RecordingResult(recording=recording, folder=folder, fingerprint=fingerprint, **values)


def test_journal_goes_on_with_names_and_results(tmp_path):
    path = tmp_path / "batch.jsonl"
    journal = BatchJournal(path, "a")
    assert journal.folder_of("/x/hall") == "hall"
    assert journal.folder_of("/y/hall.bag") == "hall_2"
    journal.add(result("/y/hall.bag", "hall_2", num_frames=3))
    journal.add(result("/z", "", error="unreadable"))
    journal.close()

    again = BatchJournal(path, "a")
    assert again.is_done("/y/hall.bag") and not again.is_done("/x/hall") and not again.is_done("/z")
    assert again.folder_of("/x/hall") == "hall"
    assert again.folder_of("/q/HALL") == "HALL_3"
    assert again.result_of("/y/hall.bag").num_frames == 3
    assert again.result_of("/z").error == "unreadable"
    assert again.result_of("/x/hall") is None


def test_other_settings_do_everything_again_under_new_names(tmp_path):
    path = tmp_path / "batch.jsonl"
    journal = BatchJournal(path, "a")
    journal.add(result("/x/hall", journal.folder_of("/x/hall")))
    journal.close()
    other = BatchJournal(path, "b")
    assert not other.is_done("/x/hall")
    assert other.folder_of("/x/hall") == "hall_2"


def test_last_result_counts_and_a_cut_line_is_dropped(tmp_path):
    path = tmp_path / "batch.jsonl"
    journal = BatchJournal(path, "a")
    journal.add(result("/x", "", error="no disk"))
    journal.add(result("/x", journal.folder_of("/x"), num_frames=7))
    journal.close()
    whole = path.read_bytes()
    path.write_bytes(whole + b'{"recording": "/y", "finger')
    again = BatchJournal(path, "a")
    assert again.result_of("/x").num_frames == 7
    again.add(result("/y", again.folder_of("/y"), num_frames=2))
    again.close()
    assert BatchJournal(path, "a").result_of("/y").num_frames == 2


def test_file_of_something_else_is_refused(tmp_path):
    path = tmp_path / "batch.jsonl"
    path.write_text('{"recording": "/x"}\n')
    with pytest.raises(ResultsError, match="line 1 is not what stairmap writes"):
        BatchJournal(path, "a")


def test_names_that_are_no_utf8_go_round(tmp_path):
    path = tmp_path / "batch.jsonl"
    journal = BatchJournal(path, "a")
    name = "/x/h\udcffll"
    journal.add(result(name, journal.folder_of(name)))
    journal.close()
    assert BatchJournal(path, "a").result_of(name).recording == name


def test_fingerprint_tells_what_changes_results_and_nothing_else():
    plain = BatchSettings()
    assert BatchSettings(with_reports=True).fingerprint() == plain.fingerprint()
    for other in (
        BatchSettings(version="0.0.1"),
        BatchSettings(config_yaml="detection: {max_depth: 4.0}"),
        BatchSettings(up="+y"),
        BatchSettings(method="delmerico2013"),
        BatchSettings(with_odometry=True),
    ):
        assert other.fingerprint() != plain.fingerprint()
