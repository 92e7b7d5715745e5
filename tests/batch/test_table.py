from __future__ import annotations

import csv
import math

import numpy as np
import pytest

from stairmap.batch.job import RecordingResult
from stairmap.batch.summary_page import SummaryPage, robust_deviations
from stairmap.batch.table import columns, rows_of
from stairmap.batch.table_files import read_table, write_tables
from stairmap.navigation.robot_profile import load_robot
from stairmap.stairway import Flight, FlightStd, Stairway

SPOT = {"spot": load_robot("spot")}


def make_result(recording="/r/hall", rise=0.17, **values):
    std = FlightStd(
        rise=0.002, run=0.003, width=0.01, pitch=0.004, heading=0.01, base=np.array([0.01, 0.02, 0.03])
    )
    flight = Flight(
        base=np.array([1.0, 2.0, 3.0]), heading=0.5, rise=rise, run=0.28, width=1.2, num_risers=8, std=std,
        bottom_seen=True, top_seen=None,
    )  # fmt: skip
    stairway = Stairway(id=4, flights=(flight, flight), num_observations=9, first_seen_ns=0, last_seen_ns=1)
    return RecordingResult(
        recording=recording, folder="hall", fingerprint="a", num_frames=90, num_detections=80,
        stairways=(stairway.to_dict(),), **values,
    )  # fmt: skip


def test_a_flight_is_a_row_with_the_keys_of_stairways_json():
    rows = rows_of(make_result(), SPOT)
    assert [row["flight"] for row in rows] == [1, 2]
    row = rows[0]
    assert list(row) == list(columns(SPOT))
    assert (row["recording"], row["stairway"], row["folder"], row["error"]) == ("/r/hall", 4, "hall", "")
    assert (row["base_x"], row["base_y"], row["base_z"]) == (1.0, 2.0, 3.0)
    assert (row["base_x_std"], row["base_y_std"], row["base_z_std"]) == (0.01, 0.02, 0.03)
    assert (row["heading"], row["rise"], row["run"], row["width"]) == (0.5, 0.17, 0.28, 1.2)
    assert row["pitch"] == pytest.approx(math.atan2(0.17, 0.28), abs=1e-6)
    assert (row["rise_std"], row["run_std"], row["width_std"]) == (0.002, 0.003, 0.01)
    assert (row["pitch_std"], row["heading_std"]) == (0.004, 0.01)
    assert (row["num_risers"], row["num_observations"], row["num_frames"]) == (8, 9, 90)
    assert (row["bottom_seen"], row["top_seen"]) == (True, None)
    assert row["verdict_spot"] == "passable"


def test_verdict_follows_the_stairway():
    assert rows_of(make_result(rise=0.35), SPOT)[0]["verdict_spot"] == "impassable"


def test_recording_without_stairs_and_failure_are_a_row_each():
    empty = RecordingResult(recording="/r/e", folder="e", fingerprint="a", num_frames=5)
    failed = RecordingResult(recording="/r/f", folder="", fingerprint="a", error="no poses")
    for result in (empty, failed):
        (row,) = rows_of(result, SPOT)
        assert row["recording"] == result.recording and row["error"] == result.error
        assert row["stairway"] is None and row["rise"] is None and row["verdict_spot"] is None


def test_recording_that_broke_off_has_its_flights_and_its_error():
    rows = rows_of(make_result(error="cut off"), {})
    assert [row["error"] for row in rows] == ["", "", "cut off"]


def test_csv_and_parquet_hold_the_same(tmp_path):
    rows = [
        *rows_of(make_result(), SPOT),
        *rows_of(RecordingResult(recording="/e", folder="", fingerprint="a", error="x, y"), SPOT),
    ]
    write_tables(tmp_path, columns(SPOT), iter(rows))
    assert read_table(tmp_path) == [dict(row) for row in rows]
    with (tmp_path / "batch.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert [line["rise"] for line in table] == ["0.17", "0.17", ""]
    assert table[0]["bottom_seen"] == "true" and table[0]["top_seen"] == "" and table[2]["error"] == "x, y"
    write_tables(tmp_path, columns({}), iter([]))
    assert read_table(tmp_path) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["batch.csv", "batch.parquet"]


def test_page_shows_outliers_before_failures_and_distributions():
    page = SummaryPage("fleet <1>", columns(SPOT))
    rises = [0.17, 0.171, 0.172, 0.169, 0.168, 0.24]
    rows = [
        row for number, rise in enumerate(rises) for row in rows_of(make_result(f"/r/{number}", rise), SPOT)
    ]
    rows += rows_of(
        RecordingResult(recording="/r/bad", folder="", fingerprint="a", error="no <poses> in /r/bad"), SPOT
    )
    assert list(page.watch(rows)) == rows
    text = page.render()
    assert "fleet &lt;1&gt;" in text and "7 recordings, 12 flights" in text
    assert (
        text.index("Outliers") < text.index("Failures") < text.index("Distributions") < text.index("Verdicts")
    )
    outliers = text[text.index("Outliers") : text.index("Failures")]
    assert "/r/5" in outliers and "/r/0" not in outliers and "<b>240</b>" in outliers
    assert "no &lt;poses&gt; in …" in text and text.count("<svg") == 4


def test_page_of_an_empty_batch_is_a_page():
    page = SummaryPage("empty", columns({}))
    assert list(page.watch([])) == []
    assert "0 recordings, 0 flights" in page.render()


def test_deviations_are_robust_and_never_below_what_measuring_scatters():
    values = np.array([1.0, 1.001, 0.999, 1.0, 2.0])
    off = robust_deviations(values, 0.01)
    assert off[4] == pytest.approx(100.0)
    assert np.abs(off[:4]).max() < 0.2
