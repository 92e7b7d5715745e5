"""Each rule that stairs must keep rejects what breaks it, and nothing short of its limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from profile_rays import NOISE, fitted, make_descending, make_profile, measure
from stairmap.arrays import Float64Array
from stairmap.config import Config
from stairmap.detection.evidence import Evidence, count_evidence
from stairmap.detection.fit import Rays
from stairmap.detection.judgement import (
    Case,
    common_extent,
    find_rejections,
    find_turned,
    measure_turns,
)
from stairmap.detection.observation import Rejection
from stairmap.detection.profile import StairProfile

MAX_GROWTH = np.radians(2.0)
MAX_HIDDEN = 0.6
MAX_IRREGULARITY = 0.035
MAX_TURN = np.radians(6.0)
"""Limits that hold, written again: who changes one changes it here as well."""

UP = make_profile()
CONFIG = Config()


def make_case(
    profile: StairProfile = UP,
    *,
    rays: Rays | None = None,
    sides: tuple[float, float] = (-0.4, 0.4),
    covariance: Float64Array | None = None,
    **counts: Any,
) -> Case:
    """A case that breaks no rule, but for what is given; counts are those of its evidence."""
    rays = measure(profile) if rays is None else rays
    fit = fitted(profile)
    if covariance is not None:
        fit = replace(fit, covariance=covariance)
    evidence = count_evidence(rays, fit, profile)
    values = {name: np.broadcast_to(value, getattr(evidence, name).shape) for name, value in counts.items()}
    return Case(
        fitted=fit,
        predicted=fit.predict(rays.slope),
        evidence=replace(evidence, **values),
        rays=rays,
        sides=sides,
    )


def rejections_of(case: Case, **sections: dict[str, Any]) -> dict[str, Rejection]:
    found = find_rejections(case, Config.model_validate(sections))
    return {rejection.rule: rejection for rejection in found}


def the_only(case: Case, rule: str, **sections: dict[str, Any]) -> Rejection:
    found = rejections_of(case, **sections)
    assert list(found) == [rule]
    return found[rule]


@pytest.mark.parametrize("profile", [UP, make_descending()], ids=["up", "down"])
def test_stairs_that_keep_all_rules_are_not_rejected(profile: StairProfile) -> None:
    assert find_rejections(make_case(profile), CONFIG) == ()


@pytest.mark.parametrize(("min_steps", "is_rejected"), [(5, False), (6, True)])
def test_too_few_steps_are_rejected(min_steps: int, is_rejected: bool) -> None:
    found = rejections_of(make_case(), detection={"min_steps": min_steps})
    assert (list(found) == ["min_steps"]) == is_rejected
    if is_rejected:
        assert (found["min_steps"].measured, found["min_steps"].limit) == (5, 6)
        assert found["min_steps"].unit == "1"


def test_steps_that_are_not_seen_do_not_count() -> None:
    rejection = the_only(make_case(on=[40, 40, 0, 0, 0], farther=0, farther_tread=0), "min_steps")
    assert rejection.measured == 2


def test_every_second_step_seen_makes_no_stairs() -> None:
    long = make_profile(num_steps=7)
    every_second = [40, 0, 40, 0, 40, 0, 40]
    rejection = the_only(make_case(long, on=every_second), "min_neighbours")
    assert (rejection.measured, rejection.limit) == (0, 1.5)
    # Two of three pairs are neighbours.
    assert rejections_of(make_case(long, on=[40, 40, 0, 40, 40, 0, 0])) == {}
    assert list(rejections_of(make_case(long, on=[40, 0, 40, 40, 0, 40, 0]))) == ["min_neighbours"]


@pytest.mark.parametrize(
    ("num", "has_treads", "is_rejected"), [(3, False, True), (4, False, False), (3, True, False)]
)
def test_open_steps_without_treads_must_be_four(num: int, has_treads: bool, is_rejected: bool) -> None:
    slabs = make_profile(num_steps=num, is_open=True, height=0.3)
    rays = measure(slabs, slopes=(-0.5, 1.0))
    on_tread = 9 if has_treads else 0
    found = rejections_of(make_case(slabs, rays=rays, on_tread=on_tread))
    assert ("min_steps" in found) == is_rejected
    if is_rejected:
        assert (found["min_steps"].measured, found["min_steps"].limit) == (3, 4)
    # Closed risers are steps by themselves.
    closed = make_profile(num_steps=num, height=0.3)
    assert "min_steps" not in rejections_of(
        make_case(closed, rays=measure(closed, slopes=(-0.5, 1.0)), on_tread=0)
    )


@pytest.mark.parametrize(
    ("rule", "limit", "measured", "unit", "slack"),
    [
        ("min_rise", 0.17, 0.17, "m", 0.002),
        ("max_rise", 0.17, 0.17, "m", 0.002),
        ("min_run", 0.28, 0.28, "m", 0.002),
        ("max_run", 0.28, 0.28, "m", 0.002),
        ("min_pitch_deg", 31.264, 31.264, "deg", 1.0),
        ("max_pitch_deg", 31.264, 31.264, "deg", 1.0),
    ],
)
def test_dimensions_must_lie_in_the_envelope_up_to_their_std(
    rule: str, limit: float, measured: float, unit: str, slack: float
) -> None:
    # The standard deviations of rise and run are 1 mm, of which two are allowed.
    case = make_case(covariance=np.eye(6) * 1e-6)
    outward = 1.0 if rule.startswith("min") else -1.0
    assert rejections_of(case, envelope={rule: limit + outward * 0.9 * slack}) == {}
    beyond = limit + outward * 1.1 * slack
    rejection = the_only(case, rule.removesuffix("_deg"), envelope={rule: beyond})
    assert rejection.measured == pytest.approx(measured, abs=1e-3)
    assert rejection.limit == pytest.approx(beyond)
    assert rejection.unit == unit


@pytest.mark.parametrize("place", [0, 1], ids=["rise", "run"])
def test_the_envelope_is_never_widened_by_more_than_20_mm(place: int) -> None:
    unsure = np.eye(6) * 1e-6
    unsure[place, place] = 1.0
    name, value = ("max_rise", 0.17) if place == 0 else ("max_run", 0.28)
    pitch = {"min_pitch_deg": 10.0, "max_pitch_deg": 60.0}
    case = make_case(covariance=unsure)
    assert rejections_of(case, envelope={name: value - 0.019, **pitch}) == {}
    assert list(rejections_of(case, envelope={name: value - 0.021, **pitch})) == [name]


def test_runs_of_stairs_that_descend_are_judged_without_their_sign() -> None:
    down = make_case(make_descending())
    assert rejections_of(down, envelope={"max_run": 0.283}) == {}
    assert the_only(down, "max_run", envelope={"max_run": 0.27}).measured == pytest.approx(0.28)


@pytest.mark.parametrize(("width", "is_rejected"), [(0.62, False), (0.58, True)])
def test_narrow_stairs_are_rejected(width: float, is_rejected: bool) -> None:
    found = rejections_of(make_case(sides=(-width / 2, width / 2)), envelope={"min_width": 0.6})
    assert (list(found) == ["min_width"]) == is_rejected
    if is_rejected:
        assert found["min_width"].measured == pytest.approx(width)


@pytest.mark.parametrize("sides", [(np.nan, 0.5), (-0.5, np.nan), (np.nan, np.nan)])
def test_stairs_without_ends_have_no_width(sides: tuple[float, float]) -> None:
    case = make_case(sides=sides)
    assert case.width == 0.0
    assert rejections_of(case)["min_width"].measured == 0.0


@pytest.mark.parametrize(("num", "limit"), [(3, 0.05), (5, 0.15), (8, 0.30), (10, 0.30)])
def test_what_one_sees_through_is_not_solid(num: int, limit: float) -> None:
    profile = make_profile(num_steps=num, height=-0.83)
    # A thousand rays on steps and treads, none through treads.
    on = {"on": 500 // num, "on_tread": 500 // num}
    total = 2 * (500 // num) * num
    allowed = int(total * limit / (1 - limit)) // num
    assert rejections_of(make_case(profile, **on, farther=allowed - 1, farther_tread=0)) == {}
    through = make_case(profile, **on, farther=allowed - 1, farther_tread=3)
    rejection = the_only(through, "max_see_through")
    assert rejection.measured == pytest.approx((allowed + 2) * num / (total + (allowed + 2) * num))
    assert rejection.limit == pytest.approx(limit)
    assert rejection.unit == "1"


def test_what_is_mostly_hidden_is_something_else() -> None:
    hidden = int(50 * MAX_HIDDEN / (1 - MAX_HIDDEN))
    assert rejections_of(make_case(on=50, on_tread=0, nearer=hidden - 1, farther=0, farther_tread=0)) == {}
    rejection = the_only(
        make_case(on=50, on_tread=0, nearer=hidden + 2, farther=0, farther_tread=0), "max_occluded"
    )
    assert rejection.measured == pytest.approx((hidden + 2) / (hidden + 52))
    assert rejection.limit == MAX_HIDDEN


@pytest.mark.parametrize(("factor", "is_rejected"), [(0.95, False), (1.05, True)])
def test_steps_of_many_sizes_are_rejected(factor: float, is_rejected: bool) -> None:
    stray = factor * MAX_IRREGULARITY * np.where(np.arange(11) % 2, 1.0, -1.0)
    found = rejections_of(make_case(make_profile(offsets=stray)))
    assert ("max_irregularity" in found) == is_rejected
    if is_rejected:
        assert found["max_irregularity"].measured == pytest.approx(factor * MAX_IRREGULARITY)
        assert found["max_irregularity"].unit == "m"


def test_a_ramp_is_rejected_as_flat() -> None:
    rays = measure(UP)
    steep = UP.rise / UP.run
    foot = UP.height - 0.5 * UP.rise - steep * UP.distance
    ramp = replace(rays, inverse_distance=np.maximum((rays.slope - steep) / foot, 0.01))
    rejection = rejections_of(make_case(rays=ramp, on=50))["max_flatness"]
    assert rejection.measured > 0.9 > rejection.limit


def turned_rays(angles_deg: Sequence[float], *, noise: float = NOISE, seed: int = 0) -> Rays:
    """Rays of five risers, each turned about its middle, that lie where those of ``UP`` do."""
    rays = measure(UP, noise=noise, seed=seed)
    s, z = UP.nosing_distances, UP.tread_heights
    q = rays.inverse_distance
    for k, angle in enumerate(np.radians(angles_deg)):
        # s = s_k + t·tan(angle) along the riser, t = bearing·s.
        riser = (s[k] / (1 - rays.bearing * np.tan(angle))) ** -1
        height = rays.slope / riser
        on = (height > z[k]) & (height < z[k + 1])
        errors = np.random.default_rng(seed).normal(0, noise, len(q))
        q = np.where(on, riser + errors, q)
    return replace(rays, inverse_distance=q)


def test_turns_of_risers_are_measured_with_their_sign() -> None:
    angles = np.array([0.0, 5.0, -5.0, 10.0, 0.0])
    turn, std = measure_turns(turned_rays(angles), UP)
    np.testing.assert_allclose(np.degrees(turn), angles, atol=1.0)
    assert (np.degrees(std) < 2.0).all()
    noisy, unsure = measure_turns(turned_rays(angles, noise=0.01), UP)
    assert (unsure > std).all()
    assert (np.abs(noisy - np.radians(angles)) < 4 * unsure).all()


def test_turns_of_risers_that_are_not_in_view_are_unknown() -> None:
    rays = measure(UP)
    hidden = replace(rays, inverse_distance=np.where(rays.slope > -0.45, 0.0, rays.inverse_distance))
    turn, _ = measure_turns(hidden, UP)
    assert np.isnan(turn[3:]).all()
    assert np.isfinite(turn[:1]).all()
    assert np.isnan(measure_turns(measure(make_descending()), make_descending())[0]).all()


def test_straight_risers_are_not_turned() -> None:
    turned, largest = find_turned(np.radians([0.0, 1.0, -1.0, 0.5]), np.radians([0.5] * 4))
    assert turned.tolist() == [False] * 4
    assert largest == 0.0


@pytest.mark.parametrize(("degrees_over", "is_turned"), [(-0.3, False), (0.3, True)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_step_is_turned_beyond_6_degrees_and_two_stds(
    sign: float, degrees_over: float, is_turned: bool
) -> None:
    std = np.radians(1.0)
    turn = np.zeros(5)
    turn[4] = sign * (MAX_TURN + 2 * std + np.radians(degrees_over))
    turned, largest = find_turned(turn, np.full(5, std))
    assert turned.tolist() == [False] * 4 + [is_turned]
    assert largest == pytest.approx(abs(turn[4]) if is_turned else 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_angles_that_grow_twice_on_end_are_those_of_winders(sign: float) -> None:
    std = np.radians(0.5)
    step = sign * (MAX_GROWTH + 2 * np.hypot(std, std))
    grows = np.cumsum([0.0, 1.1 * step, 1.1 * step]) - step
    turned, largest = find_turned(grows, np.full(3, std))
    assert turned.all()
    assert largest == pytest.approx(np.abs(grows).max())
    # Once up and once down, or less each time, is no winding.
    assert not find_turned(np.array([0.0, 1.1 * step, 0.0]), np.full(3, std))[0].any()


def test_angles_that_grow_over_all_steps_are_those_of_winders_however_unsure_each_is() -> None:
    std = np.radians(4.0)
    grows = np.radians(4.2) * (np.arange(7) - 3.0)
    assert np.abs(np.diff(grows)).max() < MAX_GROWTH + 2 * np.hypot(std, std)
    assert find_turned(grows, np.full(7, std))[0].all()
    slow = np.radians(1.5) * (np.arange(7) - 3.0)
    assert not find_turned(slow, np.full(7, std))[0].any()
    # Angles known to no better than 15 degrees tell nothing.
    fast = np.radians(9.0) * (np.arange(7) - 3.0)
    assert find_turned(fast, np.full(7, np.radians(14.8)))[0].all()
    assert not find_turned(fast, np.full(7, np.radians(15.2)))[0].any()


def test_growth_counts_where_both_of_its_angles_are_sure() -> None:
    std = np.radians([0.3, 6.0, 0.3, 0.3])
    grows = np.radians([-4.5, -1.5, 1.5, 4.5])
    assert not find_turned(grows, std)[0].any()
    assert find_turned(grows, np.radians([6.0, 0.3, 0.3, 0.3]))[0].all()


def test_the_std_of_a_turn_is_a_little_larger_than_its_errors() -> None:
    ratios = []
    for seed in range(40):
        turn, std = measure_turns(measure(UP, noise=0.004, seed=seed), UP)
        ratios.append(turn / std)
    # Rays are taken to err together by one and a half.
    assert 0.65 < np.std(ratios) < 1.0


@pytest.mark.parametrize(("share", "is_used"), [(0.40, True), (0.55, False)])
def test_what_stands_half_a_run_off_a_riser_tells_no_turn(share: float, is_used: bool) -> None:
    rays = measure(UP, noise=0.0)
    turn, _ = measure_turns(rays, UP)
    riser = np.abs(1 / rays.inverse_distance - UP.nosing_distances[2]) < 1e-3
    aside = riser & (rays.bearing > 0.1)
    off = replace(
        rays,
        inverse_distance=np.where(
            aside, 1 / (UP.nosing_distances[2] + share * UP.run), rays.inverse_distance
        ),
    )
    changed, _ = measure_turns(off, UP)
    assert (np.abs(changed[2] - turn[2]) > np.radians(3)) == is_used


@pytest.mark.parametrize(("margin", "is_used"), [(0.08, True), (0.03, False)])
def test_what_stands_at_the_ends_of_the_stairs_tells_no_turn(margin: float, is_used: bool) -> None:
    rays = measure(UP, noise=0.0)
    s = 1 / rays.inverse_distance
    t = rays.bearing * s
    # The outer part of every riser leans back by 0.1 m, from so far inside of the end at 0.3 m.
    leans = replace(rays, inverse_distance=np.where(t > 0.3 - margin, 1 / (s + 0.1), rays.inverse_distance))
    plain, _ = measure_turns(rays, UP, (-0.3, 0.3))
    turn, _ = measure_turns(leans, UP, (-0.3, 0.3))
    assert (np.nanmax(np.abs(turn - plain)) > np.radians(2)) == is_used


@pytest.mark.parametrize(("num", "is_told"), [(8, True), (7, False)])
def test_eight_rays_tell_a_turn(num: int, is_told: bool) -> None:
    rays = measure(UP)
    riser = np.flatnonzero(
        (np.abs(1 / rays.inverse_distance - UP.nosing_distances[1]) < 0.01)
        & (np.abs(rays.slope * UP.nosing_distances[1] - UP.tread_heights[1] - 0.5 * UP.rise) < 0.04)
    )
    kept = np.zeros(len(rays.slope), bool)
    kept[riser[:num]] = True
    turn, _ = measure_turns(replace(rays, inverse_distance=np.where(kept, rays.inverse_distance, 0.0)), UP)
    assert np.isfinite(turn[1]) == is_told
    assert np.isnan(turn[[0, 2, 3, 4]]).all()


def test_steps_without_a_known_angle_are_not_turned() -> None:
    turned, largest = find_turned(np.full(4, np.nan), np.full(4, np.nan))
    assert not turned.any()
    assert largest == 0.0
    partly = np.array([np.nan, 0.0, np.radians(20), np.nan])
    assert find_turned(partly, np.full(4, np.radians(1)))[0].tolist() == [False, False, True, False]


def test_winders_are_rejected_with_their_angle() -> None:
    rays = turned_rays([-16.0, -8.0, 0.0, 8.0, 16.0])
    found = rejections_of(make_case(rays=rays, on=60))
    assert {"min_steps", "max_turn"} <= set(found)
    assert found["max_turn"].measured == pytest.approx(16.0, abs=3.0)
    assert found["max_turn"].limit == pytest.approx(6.0)
    assert found["max_turn"].unit == "deg"


def test_one_turned_step_does_not_count() -> None:
    case = make_case(
        rays=turned_rays([0.0, 0.0, 0.0, 0.0, 15.0]), on=60, farther=0, nearer=0, farther_tread=0
    )
    assert rejections_of(case, detection={"min_steps": 4}) == {}
    found = rejections_of(case, detection={"min_steps": 5})
    assert found["min_steps"].measured == 4
    assert found["max_turn"].measured == pytest.approx(15.0, abs=2.0)


def test_a_common_end_is_the_median_of_those_that_were_seen() -> None:
    ends = np.array([0.50, 0.52, 0.9, 0.40, np.nan])
    bounded = np.array([True, True, True, False, True])
    assert common_extent(ends, bounded, np.arange(5), 1.0) == pytest.approx(0.52)
    assert common_extent(ends, bounded, np.array([0, 1]), 1.0) == pytest.approx(0.51)
    assert common_extent(-ends, bounded, np.arange(5), -1.0) == pytest.approx(-0.52)


def test_a_common_end_that_was_never_seen_is_the_farthest_cut() -> None:
    ends, cut = np.array([0.50, 0.55, 0.40, np.nan]), np.zeros(4, dtype=bool)
    assert common_extent(ends, cut, np.arange(4), 1.0) == pytest.approx(0.55)
    assert common_extent(-ends, cut, np.arange(4), -1.0) == pytest.approx(-0.55)
    assert np.isnan(common_extent(ends, cut, np.array([3]), 1.0))
    assert np.isnan(common_extent(ends, cut, np.zeros(0, dtype=np.int64), 1.0))


def test_all_broken_rules_are_told() -> None:
    found = rejections_of(
        make_case(sides=(-0.1, 0.1), on=[40, 40, 0, 0, 0], farther=400),
        envelope={"min_width": 0.6, "max_rise": 0.15},
    )
    assert {"min_steps", "max_rise", "max_see_through", "min_width"} <= set(found)
    assert isinstance(make_case().evidence, Evidence)


def test_what_is_exactly_at_a_limit_is_within_it() -> None:
    # Five of nine steps, two pairs of them neighbours: half of the four that there could be.
    long = make_profile(num_steps=9)
    halfway = [40, 40, 0, 40, 40, 0, 40, 0, 0]
    assert rejections_of(make_case(long, on=halfway, farther=0, farther_tread=0)) == {}
    wide = make_case(sides=(-0.25, 0.5))
    assert rejections_of(wide, envelope={"min_width": 0.75}) == {}
    sure = make_case(make_profile(rise=0.1875, run=0.25, height=-0.8125), covariance=np.zeros((6, 6)))
    assert rejections_of(sure, envelope={"min_rise": 0.1875, "min_run": 0.25}) == {}
    assert rejections_of(sure, envelope={"max_rise": 0.1875, "max_run": 0.25}) == {}
    std = np.full(5, np.radians(1.0))
    at_limit = np.array([0.0, 0.0, 0.0, 0.0, MAX_TURN + 2.0 * std[0]])
    assert not find_turned(at_limit, std)[0].any()


def test_of_two_steps_nothing_may_be_seen_through() -> None:
    two = {"on": [40, 40, 0, 0, 0], "on_tread": 0, "nearer": 0, "farther_tread": 0}
    through = rejections_of(make_case(farther=[1, 0, 0, 0, 0], **two))
    assert through["max_see_through"].limit == 0.0
    assert through["max_see_through"].measured == pytest.approx(1 / 81)
    assert "max_see_through" not in rejections_of(make_case(farther=0, **two))


@pytest.mark.parametrize(("beyond", "is_used"), [(0.07, True), (0.02, False)])
def test_what_stands_at_the_right_end_of_the_stairs_tells_no_turn_either(
    beyond: float, is_used: bool
) -> None:
    rays = measure(UP, noise=0.0)
    s = 1 / rays.inverse_distance
    t = rays.bearing * s
    leans = replace(rays, inverse_distance=np.where(t < -0.3 + beyond, 1 / (s + 0.1), rays.inverse_distance))
    plain, _ = measure_turns(rays, UP, (-0.3, 0.3))
    turn, _ = measure_turns(leans, UP, (-0.3, 0.3))
    assert (np.nanmax(np.abs(turn - plain)) > np.radians(2)) == is_used
