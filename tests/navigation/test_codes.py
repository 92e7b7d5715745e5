"""Building codes: which rule is broken, by how much, how sure."""

from __future__ import annotations

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
