from __future__ import annotations

from dataclasses import replace

import pytest

from stairmap.export.summary import COLUMNS, format_summary, format_table, stairway_rows, with_std
from stairmap.stairway import Stairway


def test_there_is_one_row_for_each_flight_in_units_people_read(stairway: Stairway) -> None:
    first, second = stairway_rows([stairway])
    assert (first.stairway_id, first.flight_number, second.flight_number, first.num_flights) == (3, 1, 2, 2)
    assert first.rise_mm == pytest.approx(165)
    assert first.rise_std_mm == pytest.approx(2)
    assert first.pitch_deg == pytest.approx(29.47, abs=0.01)
    assert first.base == (1.0, 2.0, 0.5)


def test_a_width_with_an_unseen_end_is_marked_as_a_lower_bound(stairway: Stairway) -> None:
    unbounded, bounded = (row.cells() for row in stairway_rows([stairway]))
    width, ends = COLUMNS.index("width mm"), COLUMNS.index("ends seen")
    assert (unbounded[width], unbounded[ends]) == ("≥ 1175 ± 20", "left")
    assert (bounded[width], bounded[ends]) == ("1000 ± 20", "both")


@pytest.mark.parametrize(
    ("bottom", "top", "risers", "ends"),
    [
        (True, True, "9", "left; both"),
        (True, False, "≥ 9", "left; bottom"),
        (False, True, "≥ 9", "left; top"),
        (False, False, "≥ 9", "left; none"),
        (True, None, "≥ 9", "left; bottom"),
        (None, None, "9", "left"),
    ],
)
def test_risers_are_a_lower_bound_where_a_level_was_not_seen(
    stairway: Stairway, bottom: bool | None, top: bool | None, risers: str, ends: str
) -> None:
    flight = replace(stairway.flights[0], bottom_seen=bottom, top_seen=top)
    cells = stairway_rows([replace(stairway, flights=(flight,))])[0].cells()
    assert cells[COLUMNS.index("risers")] == risers
    assert cells[COLUMNS.index("ends seen")] == ends


def test_the_columns_of_the_table_are_aligned(stairway: Stairway) -> None:
    lines = format_table([stairway]).splitlines()
    assert len(lines) == 4
    assert len({len(line) for line in lines}) == 1


def test_a_summary_without_stairways_gives_the_reasons() -> None:
    text = format_summary(
        [], num_frames=9, num_detections=0, reasons=["9 frames: min_steps: 2, limit 3"], problems=["a.png"]
    )
    assert "no stairway was found" in text
    assert "why frames gave no stairway:\n  9 frames: min_steps: 2, limit 3" in text
    assert "problems of the recording:\n  a.png" in text


def test_a_deviation_is_never_written_as_zero_and_left_out_when_unknown() -> None:
    assert with_std(165.2, 2.0) == "165 ± 2"
    assert with_std(165.2, 0.3) == "165 ± 0.3"
    assert with_std(165.2, float("nan")) == "165"


def test_every_measure_of_a_row_is_its_flights_in_mm_and_deg(stairway: Stairway) -> None:
    (row, _) = stairway_rows([stairway])
    assert (row.run_mm, row.width_mm) == (pytest.approx(292), pytest.approx(1175))
    assert (row.run_std_mm, row.width_std_mm) == (pytest.approx(3), pytest.approx(20))
    assert row.pitch_std_deg == pytest.approx(0.573, abs=0.001)
    assert row.heading_deg == pytest.approx(17.19, abs=0.01)
    assert (row.num_risers, row.num_observations) == (9, 57)


def test_a_row_is_written_in_the_order_of_its_columns(stairway: Stairway) -> None:
    (row, _) = stairway_rows([stairway])
    assert row.cells() == (
        "3", "1/2", "165 ± 2", "292 ± 3", "≥ 1175 ± 20", "left", "29.5 ± 0.6", "9", "17.2",
        "1.00, 2.00, 0.50", "57",
    )  # fmt: skip
    assert len(COLUMNS) == len(row.cells())


@pytest.mark.parametrize(
    ("left", "right", "words"),
    [(True, True, "both"), (True, False, "left"), (False, True, "right"), (False, False, "none")],
)
def test_the_ends_that_were_seen_are_named(stairway: Stairway, left: bool, right: bool, words: str) -> None:
    flight = replace(stairway.flights[0], left_bounded=left, right_bounded=right)
    (row,) = stairway_rows([replace(stairway, flights=(flight,))])
    assert row.ends_seen == words


def test_a_table_has_a_header_a_rule_and_a_line_for_each_flight(stairway: Stairway) -> None:
    header, rule, *lines = format_table([stairway]).splitlines()
    assert [cell.strip() for cell in header.split("  ") if cell] == list(COLUMNS)
    assert set(rule) == {"-", " "}
    assert len(lines) == 2
    # Right-aligned: the last column ends the line.
    assert lines[0].endswith(" 57")
    assert lines[1].split()[:2] == ["3", "2/2"]


def test_a_summary_with_stairways_explains_its_signs_and_counts(stairway: Stairway) -> None:
    text = format_summary([stairway], num_frames=9, num_detections=7)
    assert text.startswith("9 frames, stair edges seen in 7\n")
    assert "± is one standard deviation" in text
    assert "why frames gave no stairway" not in text
    assert "± is" not in format_summary([], num_frames=9, num_detections=0)


@pytest.mark.parametrize(
    ("std", "digits", "text"),
    [(0.6, 0, "165 ± 1"), (0.4, 0, "165 ± 0.4"), (0.06, 1, "165.2 ± 0.1"), (0.04, 1, "165.2 ± 0.04")],
)
def test_a_deviation_gets_one_decimal_more_where_it_would_round_to_zero(
    std: float, digits: int, text: str
) -> None:
    assert with_std(165.2, std, digits=digits) == text


def test_a_deviation_that_is_infinite_is_left_out() -> None:
    assert with_std(165.2, float("inf"), digits=1) == "165.2"
