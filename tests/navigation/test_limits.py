"""Probabilities, bounds and verdicts of limits, on either side of each."""

from __future__ import annotations

import math

import pytest
from scipy.stats import norm

from stairmap.navigation.limits import (
    RISERS_STD,
    STEP_STD,
    SURE,
    WIDTH_STD,
    Limit,
    LimitCheck,
    check_limit,
    joint_probability,
    limiting_check,
    measure_flight,
    verdict_from_probability,
)
from walkable_stairways import make_flight, make_std

HIGHEST = Limit(measure="rise", sense="max", value=0.18)
NARROWEST = Limit(measure="width", sense="min", value=0.60)


def check_of(low, high, *, limit=HIGHEST, measured=0.17):
    return LimitCheck(flight_number=1, limit=limit, measured=measured, std=0.01, probability=(low, high))


@pytest.mark.parametrize(
    ("limit", "measured", "spare"), [(HIGHEST, 0.17, 2), (HIGHEST, 0.195, -3), (NARROWEST, 0.605, 1)]
)
def test_a_limit_is_kept_as_probably_as_a_gaussian_error_leaves_its_margin(limit, measured, spare):
    check = check_limit(limit, measured, 0.005, flight_number=3)
    assert check.margin == pytest.approx(spare * 0.005)
    assert check.probability == pytest.approx((norm.cdf(spare),) * 2)
    assert (check.flight_number, check.measured, check.std) == (3, measured, 0.005)


def test_a_measure_without_any_doubt_keeps_its_limit_also_right_at_it():
    assert check_limit(HIGHEST, 0.18, 0.0, flight_number=1).probability == (1.0, 1.0)
    assert check_limit(HIGHEST, 0.1801, 0.0, flight_number=1).probability == (0.0, 0.0)
    assert check_limit(NARROWEST, 0.6, 0.0, flight_number=1).probability == (1.0, 1.0)


@pytest.mark.parametrize("std", [math.nan, math.inf])
def test_a_deviation_that_is_not_known_leaves_everything_open(std):
    assert check_limit(HIGHEST, 0.1, std, flight_number=1).probability == (0.0, 1.0)


def test_a_limit_that_was_never_published_leaves_everything_open_and_has_no_margin():
    check = check_limit(Limit(measure="run", sense="min", value=None), 0.3, 0.01, flight_number=1)
    assert check.probability == (0.0, 1.0)
    assert math.isnan(check.margin)
    assert math.isnan(check.to_dict()["limit"])


def test_a_lower_bound_may_be_any_amount_larger():
    """It can prove a least width, and that a greatest one is broken; nothing else."""
    widest = Limit(measure="width", sense="max", value=0.60)
    kept = norm.cdf(0.5)
    options = {"flight_number": 1, "is_lower_bound": True}
    assert check_limit(NARROWEST, 0.65, 0.1, **options).probability == pytest.approx((kept, 1.0))
    assert check_limit(widest, 0.55, 0.1, **options).probability == pytest.approx((0.0, kept))


def test_a_limit_that_does_not_bind_speaks_for_but_never_against():
    slope = Limit(measure="pitch", sense="max", value=0.5, is_binding=False)
    assert check_limit(slope, 0.55, 0.1, flight_number=1).probability == pytest.approx((norm.cdf(-0.5), 1.0))


@pytest.mark.parametrize(
    ("measure", "value", "std"),
    [
        ("rise", 0.17, math.hypot(0.003, STEP_STD)),
        ("single rise", 0.17, math.hypot(0.003, STEP_STD)),
        ("run", 0.28, math.hypot(0.004, STEP_STD)),
        ("pitch", math.atan2(0.17, 0.28), math.hypot(0.006, STEP_STD / math.hypot(0.17, 0.28))),
        ("width", 1.2, math.hypot(0.03, WIDTH_STD)),
        ("height", 1.7, 10 * math.hypot(0.003, STEP_STD)),
        ("2 rise + run", 0.62, math.hypot(2 * math.hypot(0.003, STEP_STD), math.hypot(0.004, STEP_STD))),
        ("risers", 10, RISERS_STD),
    ],
)
def test_a_measure_comes_with_the_models_deviation_and_what_that_does_not_cover(measure, value, std):
    flight = make_flight(std=make_std(rise=0.003, run=0.004, pitch=0.006, width=0.03))
    assert measure_flight(flight, measure) == (pytest.approx(value), pytest.approx(std), False)


def test_what_the_model_does_not_cover_is_as_large_as_was_found():
    assert (STEP_STD, WIDTH_STD, RISERS_STD) == (0.0025, 0.05, 0.6)


@pytest.mark.parametrize("ends", [(False, True), (True, False), (False, False)])
def test_only_a_width_is_a_lower_bound_and_only_where_an_end_was_not_seen(ends):
    flight = make_flight(left_bounded=ends[0], right_bounded=ends[1])
    assert measure_flight(flight, "width")[2]
    assert not measure_flight(flight, "run")[2]
    assert not measure_flight(make_flight(), "width")[2]


def test_a_measure_of_no_flight_is_refused():
    with pytest.raises(ValueError, match="landing length is no measure of a flight"):
        measure_flight(make_flight(), "landing length")


def test_all_limits_together_are_bounded_as_frechet_says():
    assert joint_probability([check_of(0.9, 0.95), check_of(0.8, 0.99)]) == pytest.approx((0.7, 0.95))
    assert joint_probability([check_of(0.4, 0.6), check_of(0.5, 0.7)]) == pytest.approx((0.0, 0.6))
    assert joint_probability([]) == (1.0, 1.0)


def test_a_verdict_needs_two_standard_deviations_either_way():
    assert pytest.approx(norm.cdf(2.0)) == SURE
    assert verdict_from_probability((SURE, 1.0)) == "passable"
    assert verdict_from_probability((SURE - 1e-6, 1.0)) == "unknown"
    assert verdict_from_probability((0.0, 1 - SURE)) == "impassable"
    assert verdict_from_probability((0.0, 1 - SURE + 1e-6)) == "unknown"
    assert check_of(SURE, 1.0).verdict == "passable"


def test_the_check_that_decides_is_the_broken_one_or_the_least_certain():
    open_, broken = check_of(0.0, 1.0), check_of(0.01, 0.01)
    assert limiting_check([open_, broken], "impassable") is broken
    assert limiting_check([open_, broken], "unknown") is open_
    assert limiting_check([check_of(0.99, 0.99), open_], "passable") is open_
    assert limiting_check([], "passable") is None


def test_among_equally_certain_checks_the_one_with_the_smallest_share_to_spare_decides():
    """1 cm of 0.6 m is less to spare than 1 cm of 0.18 m; certainty counts to a thousandth."""
    rise = check_of(0.99996, 1.0, measured=0.17)
    width = check_of(0.99999, 1.0, limit=NARROWEST, measured=0.61)
    assert limiting_check([rise, width], "passable") is width
    assert limiting_check([check_of(0.998, 1.0), width], "passable").probability == (0.998, 1.0)
    unpublished = check_of(0.0, 1.0, limit=Limit(measure="run", sense="min", value=None))
    assert limiting_check([check_of(0.0, 1.0), unpublished], "unknown") is unpublished


@pytest.mark.parametrize(("measure", "unit"), [("rise", "m"), ("pitch", "rad"), ("risers", "")])
def test_a_check_is_json_with_its_unit(measure, unit):
    limit = Limit(measure=measure, sense="max", value=0.5, source="a law")
    assert check_limit(limit, 0.4, 0.1, flight_number=2).to_dict() == {
        "flight": 2, "measure": measure, "sense": "max", "measured": 0.4, "std": 0.1, "limit": 0.5,
        "margin": pytest.approx(0.1), "unit": unit, "probability": pytest.approx([norm.cdf(1)] * 2),
        "source": "a law",
    }  # fmt: skip


def test_a_bound_that_does_not_bind_keeps_its_lower_probability():
    loose = Limit(measure="width", sense="max", value=0.60, is_binding=False)
    check = check_limit(loose, 0.50, 0.05, flight_number=1, is_lower_bound=True)
    assert check.probability == (0.0, 1.0)


def test_a_measure_that_is_not_known_has_nothing_to_spare_and_one_beyond_its_limit_has_less():
    unknown, beyond = check_of(0.0, 1.0, measured=math.nan), check_of(0.0, 1.0, measured=0.20)
    assert limiting_check([unknown, beyond], "unknown") is beyond
    inside = check_of(0.0, 1.0)
    assert limiting_check([inside, unknown], "unknown") is unknown
