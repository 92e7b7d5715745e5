"""Building codes: which rule is broken, by how much, how sure."""

from __future__ import annotations

import math

import pytest

from stairmap.errors import ConfigError
from stairmap.navigation.codes import check_code, code_ids, load_code
from walkable_stairways import make_flight, make_stairway


def check(code_id, **flight):
    return check_code(make_stairway(make_flight(**flight)), load_code(code_id))


def test_every_rule_names_its_clause():
    for code_id in code_ids():
        assert all(rule.source for rule in load_code(code_id).rules)


def test_a_stairway_of_160_by_290_keeps_them_all_but_osha_s_steepness():
    kept = {
        code_id for code_id in code_ids() if check(code_id, rise=0.16, run=0.29, width=1.2).word == "keeps"
    }
    assert kept == set(code_ids()) - {"osha"}


def test_a_high_riser_breaks_ibc_by_so_much():
    result = check("ibc", rise=0.19, run=0.29)
    assert result.word == "breaks"
    (broken,) = result.broken
    assert broken.limit.source == "IBC 1011.5.2"
    assert broken.margin == pytest.approx(-0.012)
    assert broken.probability[1] < 1e-3


def test_a_flat_industrial_stair_breaks_osha_s_30_degrees():
    (broken,) = check("osha", rise=0.13, run=0.34).broken
    assert (broken.limit.measure, broken.limit.sense) == ("pitch", "min")


def test_a_rise_at_the_limit_is_not_decided():
    result = check("ada", rise=0.1795, run=0.30)
    assert result.word == "unknown"
    assert [item.limit.measure for item in result.undecided] == ["rise"]


def test_a_flight_of_more_than_12_feet_breaks_ibc():
    (broken,) = check("ibc", rise=0.16, run=0.29, num_risers=25).broken
    assert broken.limit.measure == "height"


def test_a_stair_of_a_dwelling_may_be_steeper_than_a_public_one():
    flight = {"rise": 0.19, "run": 0.265, "width": 1.1}
    assert check("ibc_dwelling", **flight).word == "keeps"
    assert check("ibc", **flight).word == "breaks"


@pytest.mark.parametrize(("num_risers", "word"), [(10, "keeps"), (12, "unknown"), (14, "breaks")])
def test_more_than_twelve_risers_are_too_many_for_a_general_access_stair(num_risers, word):
    result = check("uk_k_general", rise=0.16, run=0.30, num_risers=num_risers)
    assert result.word == word
    assert [item.limit.measure for item in (*result.broken, *result.undecided)] == ["risers"] * (
        word != "keeps"
    )


def test_every_code_tells_what_is_not_checked():
    for code_id in code_ids():
        result = check(code_id)
        assert any("alike" in what for what in result.unchecked)
        assert result.to_dict()["unchecked"] == list(result.unchecked)


def test_twice_the_rise_plus_the_going_is_checked_in_the_united_kingdom():
    assert "2 rise + run" in {
        item.limit.measure for item in check("uk_k_private", rise=0.15, run=0.23).broken
    }


def test_an_unknown_code_is_told_the_known_ones():
    with pytest.raises(ConfigError, match="choose one of ada, ibc"):
        load_code("din")


def test_a_code_holds_the_values_of_its_clauses_in_metres_and_radians():
    rules = {(rule.measure, rule.sense): rule for rule in load_code("ibc").rules}
    assert rules["rise", "min"].value == 0.102
    assert rules["rise", "max"].value == 0.178
    assert rules["run", "min"].value == 0.279
    assert all(rule.is_binding for rule in rules.values())
    (steepest,) = [rule for rule in load_code("osha").rules if (rule.measure, rule.sense) == ("pitch", "max")]
    assert steepest.value == pytest.approx(math.radians(50))


def test_every_flight_is_held_against_every_rule():
    code = load_code("ibc")
    stairway = make_stairway(
        make_flight(rise=0.16, run=0.29), make_flight(rise=0.19, run=0.29), stairway_id=7
    )
    result = check_code(stairway, code)
    assert [check.flight_number for check in result.checks] == [1] * len(code.rules) + [2] * len(code.rules)
    assert [check.limit for check in result.checks] == [*code.rules, *code.rules]
    assert [(check.flight_number, check.limit.measure) for check in result.broken] == [(2, "rise")]
    assert (result.stairway_id, result.code_id) == (7, "ibc")
    assert result.probability[1] == min(check.probability[1] for check in result.checks)


def test_a_width_with_an_unseen_end_breaks_no_rule_of_a_least_width():
    narrow = {"rise": 0.16, "run": 0.29, "width": 0.7}
    assert check("ibc", **narrow).word == "breaks"
    assert check("ibc", **narrow, left_bounded=False).word == "unknown"
    assert check("ibc", rise=0.16, run=0.29, width=1.2, left_bounded=False).word == "keeps"


def test_a_check_of_a_code_is_json():
    result = check("ibc", rise=0.19, run=0.29)
    values = result.to_dict()
    assert (values["stairway"], values["code"], values["verdict"]) == (1, "ibc", "breaks")
    assert values["probability"] == list(result.probability)
    assert values["checks"] == [item.to_dict() for item in result.checks]


def test_a_code_has_a_title_and_its_ids_are_sorted():
    assert load_code("ibc").title == "International Building Code 2021, section 1011"
    assert list(code_ids()) == sorted(code_ids())
