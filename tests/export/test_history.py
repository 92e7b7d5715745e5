"""``history.jsonl``: what a run knew while it went on."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from stairmap.export.history import HISTORY_FILE, history_values, load_history
from stairmap.export.loading import ResultsError
from stairmap.export.results import create_run_folder


@pytest.fixture
def run(tmp_path, stairway):
    with create_run_folder(tmp_path / "run", "hall") as folder:
        for stamp_ns in (100, 200):
            folder.append_json(HISTORY_FILE, history_values(stamp_ns, [stairway]))
    return tmp_path / "run"


def test_history_reads_back_the_measures_at_each_stamp(run, stairway):
    moments = list(load_history(run))
    assert [moment.stamp_ns for moment in moments] == [100, 200]
    (loaded,) = moments[1].stairways
    assert loaded.id == stairway.id
    for flight, original in zip(loaded.flights, stairway.flights, strict=True):
        assert flight.rise == pytest.approx(original.rise, abs=1e-6)
        assert flight.std.rise == pytest.approx(original.std.rise, abs=1e-6)
        assert flight.num_risers == original.num_risers
        assert flight.steps == ()


def test_history_of_an_older_run_folder_is_empty(tmp_path):
    assert list(load_history(tmp_path)) == []


def test_last_line_of_a_killed_run_is_passed_over(run):
    path = run / HISTORY_FILE
    path.write_text(path.read_text()[:-40])
    assert [moment.stamp_ns for moment in load_history(run)] == [100]


@pytest.mark.parametrize("line", ['{"stamp_ns": 1}', "[]", '{"stamp_ns": 1, "stairways": [{}]}'])
def test_line_that_stairmap_did_not_write_is_named(run, line):
    path = run / HISTORY_FILE
    path.write_text(path.read_text() + line + "\n")
    with pytest.raises(ResultsError, match=r"history\.jsonl, line 3"):
        list(load_history(run))


def test_each_stairway_of_a_moment_is_kept_and_its_steps_are_left_out(stairway):
    values = history_values(7, [stairway, stairway])
    assert values["stamp_ns"] == 7
    assert len(values["stairways"]) == 2
    assert stairway.flights[0].steps
    assert [flight["steps"] for item in values["stairways"] for flight in item["flights"]] == [[]] * 4


def test_a_number_that_was_not_known_is_nan_again(tmp_path, stairway):
    unknown = replace(stairway.flights[0], std=replace(stairway.flights[0].std, rise=float("nan")))
    with create_run_folder(tmp_path / "run", "hall") as folder:
        folder.append_json(
            HISTORY_FILE, history_values(1, [replace(stairway, flights=(unknown,), landings=())])
        )
    (moment,) = load_history(tmp_path / "run")
    assert math.isnan(moment.stairways[0].flights[0].std.rise)
    assert moment.stairways[0].flights[0].std.run == pytest.approx(0.003)
