"""Verdicts in words and units: signs, decimals, and never more certain than they are."""

from __future__ import annotations

import math

import pytest

from stairmap.export.verdicts import (
    CODE_COLUMNS,
    VERDICT_COLUMNS,
    code_cells,
    format_limit,
    format_margin,
    format_measured,
    format_probability,
    format_verdicts,
    verdict_cells,
)
from stairmap.navigation.codes import check_code, load_code
from stairmap.navigation.limits import Limit, check_limit
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.traversability import assess
from walkable_stairways import make_flight, make_stairway


def check_of(measure="rise", sense="max", value=0.178, measured=0.17, std=0.004):
    return check_limit(Limit(measure=measure, sense=sense, value=value), measured, std, flight_number=2)


@pytest.mark.parametrize(
    ("probability", "text"),
    [
        ((0.5, 0.5), "50.0 %"), ((0.5, 0.504), "50.0 %"), ((0.5, 0.506), "50.0 % to 50.6 %"),
        ((0.0, 1.0), "< 0.1 % to > 99.9 %"), ((0.9989, 0.9989), "99.9 %"), ((0.9991, 1.0), "> 99.9 %"),
        ((0.0011, 0.0011), "0.1 %"), ((0.0009, 0.0009), "< 0.1 %"),
    ],
)  # fmt: skip
def test_a_probability_is_one_number_or_a_range_and_never_certainty(probability, text):
    assert format_probability(probability) == text


def test_lengths_are_mm_angles_deg_with_a_decimal_and_numbers_bare():
    assert format_measured(check_of()) == "170 ± 4 mm"
    assert format_measured(check_of("pitch", value=0.6, measured=0.5, std=0.01)) == "28.6 ± 0.6 deg"
    assert format_measured(check_of("risers", value=12, measured=10, std=0.6)) == "10.0 ± 0.6"


def test_a_limit_says_its_sense_or_that_it_was_never_published():
    assert format_limit(check_of()) == "≤ 178 mm"
    assert format_limit(check_of(sense="min", value=0.25)) == "≥ 250 mm"
    assert format_limit(check_of("pitch", value=math.radians(36), measured=0.5)) == "≤ 36 deg"
    assert format_limit(check_of("risers", value=12, measured=10)) == "≤ 12"
    assert format_limit(check_of(value=None)) == "not published"


def test_a_margin_has_a_sign_and_is_empty_where_it_is_not_known():
    assert format_margin(check_of()) == "+8 mm"
    assert format_margin(check_of(measured=0.19)) == "-12 mm"
    assert format_margin(check_of("pitch", value=math.radians(36), measured=math.radians(34.5))) == "+1.5 deg"
    assert format_margin(check_of("risers", value=12, measured=14)) == "-2.0"
    assert format_margin(check_of(value=None)) == ""


def test_a_row_of_the_table_of_verdicts_has_a_cell_for_each_column():
    steep = make_stairway(make_flight(), make_flight(base=(4, 0, 1.7), rise=0.25), stairway_id=5)
    cells = dict(zip(VERDICT_COLUMNS, verdict_cells(assess(steep, load_robot("spot"))), strict=True))
    assert cells == {
        "stairway": "5", "robot": "Boston Dynamics Spot", "verdict": "impassable", "P passable": "< 0.1 %",
        "limiting": "rise, flight 2", "measured": "250 ± 3 mm", "limit": "≤ 178 mm", "margin": "-72 mm",
    }  # fmt: skip


def test_a_code_has_a_row_for_each_rule_that_is_broken_then_for_each_that_is_undecided():
    stairway = make_stairway(make_flight(rise=0.19, run=0.281), stairway_id=5)
    rows = code_cells(check_code(stairway, load_code("ibc")))
    first, second = (dict(zip(CODE_COLUMNS, row, strict=True)) for row in rows)
    assert first == {
        "stairway": "5", "code": "ibc", "verdict": "breaks", "P kept": "< 0.1 %", "flight": "1",
        "rule": "rise (IBC 1011.5.2)", "measured": "190 ± 3 mm", "limit": "≤ 178 mm", "by": "-12 mm",
    }  # fmt: skip
    assert (second["rule"], second["by"]) == ("run (IBC 1011.5.2)", "+2 mm")


def test_a_code_that_is_kept_has_one_row_without_a_rule():
    (row,) = code_cells(check_code(make_stairway(make_flight(rise=0.16, run=0.30)), load_code("ibc")))
    cells = dict(zip(CODE_COLUMNS, row, strict=True))
    assert cells["verdict"] == "keeps"
    assert [cells[name] for name in CODE_COLUMNS[4:]] == [""] * 5


def test_each_assessment_is_a_sentence():
    assessments = [
        assess(make_stairway(make_flight(rise=0.25), stairway_id=number), load_robot("spot"))
        for number in (1, 2)
    ]
    first, second = format_verdicts(assessments).splitlines()
    assert first == (
        "stairway 1, Boston Dynamics Spot: impassable (P < 0.1 %); rise 250 ± 3 mm, limit ≤ 178 mm"
    )
    assert second.startswith("stairway 2, ")
