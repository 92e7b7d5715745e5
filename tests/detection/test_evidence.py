"""Rays are on a step, nearer, farther or not measured, and that tells which steps there are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from profile_rays import NOISE, fitted, make_descending, make_profile, measure
from side_profiles import grid_of
from stairmap.arrays import Float64Array, Mask
from stairmap.detection.elevation import Elevation
from stairmap.detection.evidence import (
    Evidence,
    all_rays,
    choose_steps,
    compare_with_flat,
    count_evidence,
    is_level_seen,
    tolerances,
)
from stairmap.detection.fit import Rays
from stairmap.detection.profile import StairProfile, Surface

MIN_RAYS = 4
NUM_SIGMA = 3.0
SURFACE_TOLERANCE = 0.012
MAX_TOLERANCE_SHARE = 0.3
"""Limits that hold, written again: who changes one changes it here as well."""

UP, DOWN = make_profile(), make_descending()


def counts(num: int = 3, **changes: object) -> Evidence:
    """Evidence of steps that are plainly seen, but for what is given for each step, or for all alike."""
    values: dict[str, object] = {
        "on": 20, "nearer": 0, "farther": 0, "unmeasured": 0, "on_tread": 20, "farther_tread": 0,
    }  # fmt: skip
    values.update({name: value for name, value in changes.items() if name not in ("continued", "ended")})
    arrays = {name: np.broadcast_to(value, num).astype(np.int64) for name, value in values.items()}
    for name in ("continued", "ended"):
        given = np.asarray(changes.get(name, 0))
        arrays[name] = np.broadcast_to(given, (2, num)).astype(np.int64)
    return Evidence(**arrays)


def evidence_of(rays: Rays, profile: StairProfile, noise: float = NOISE) -> Evidence:
    return count_evidence(rays, fitted(profile, noise=noise), profile)


def flatness(
    rays: Rays, profile: StairProfile, noise: float = NOISE, sides: tuple[float, float] = (-9.0, 9.0)
) -> float:
    fit = fitted(profile, noise=noise)
    return compare_with_flat(rays, fit, fit.predict(rays.slope), sides)


def where(rays: Rays, chosen: Mask, value: Float64Array | float) -> Rays:
    return replace(rays, inverse_distance=np.where(chosen, value, rays.inverse_distance))


def towards(rays: Rays, profile: StairProfile, surfaces: tuple[Surface, ...], step: int) -> Mask:
    """Which rays meet a surface of a step."""
    predicted = fitted(profile).predict(rays.slope)
    entry = predicted.entries(rays.slope)
    return np.isin(predicted.surface[entry], surfaces) & (predicted.step[entry] == step)


FACE = (Surface.RISER, Surface.FRONT)


@pytest.mark.parametrize(
    ("changes", "is_seen"),
    [
        ({"on": MIN_RAYS}, True),
        ({"on": MIN_RAYS - 1}, False),
        ({"on": 10, "farther": 10}, True),
        ({"on": 10, "farther": 11}, False),
        ({"on": 10, "nearer": 40}, True),
        ({"on": 10, "nearer": 41}, False),
        ({"on": 10, "nearer": 35, "farther": 5}, True),
        ({"on": 10, "nearer": 35, "farther": 6}, False),
        ({"on": 10, "unmeasured": 500}, True),
        ({"continued": 6, "ended": 5}, False),
        ({"continued": 5, "ended": 5}, True),
        ({"continued": MIN_RAYS - 1}, True),
        ({"continued": MIN_RAYS}, False),
        ({"continued": [[9], [0]]}, False),
        ({"continued": [[0], [9]]}, False),
    ],
)
def test_a_step_is_seen_where_enough_rays_lie_on_it_and_it_ends(
    changes: dict[str, object], is_seen: bool
) -> None:
    assert counts(**changes).is_seen.tolist() == [is_seen] * 3


@pytest.mark.parametrize(
    ("changes", "is_refuted"),
    [
        ({}, False),
        ({"on": 0}, False),
        ({"on": 0, "nearer": 100}, False),
        ({"on": 0, "farther": MIN_RAYS}, True),
        ({"on": 0, "farther": MIN_RAYS - 1}, False),
        ({"on": 10, "farther": 10}, False),
        ({"on": 10, "farther": 11}, True),
        ({"continued": 9}, True),
    ],
)
def test_a_step_is_refuted_where_rays_go_through_or_its_surface_goes_on(
    changes: dict[str, object], is_refuted: bool
) -> None:
    assert counts(**changes).is_refuted.tolist() == [is_refuted] * 3


SEEN, HIDDEN, GONE = (20, 0, 0), (0, 30, 0), (0, 0, 30)
"""Rays on a step, nearer and farther."""


@pytest.mark.parametrize(
    ("steps", "found", "chosen"),
    [
        ((SEEN,) * 5, (1, 3), (0, 4)),
        ((GONE, SEEN, SEEN, SEEN, GONE), (1, 3), (1, 3)),
        ((SEEN, HIDDEN, SEEN, SEEN, HIDDEN, SEEN), (2, 3), (0, 5)),
        ((SEEN, HIDDEN, HIDDEN, SEEN, SEEN, HIDDEN, HIDDEN, SEEN), (3, 4), (3, 4)),
        ((SEEN, GONE, SEEN, SEEN, GONE, SEEN), (2, 3), (2, 3)),
        ((HIDDEN, SEEN, SEEN, HIDDEN), (1, 2), (1, 2)),
        ((SEEN, SEEN, GONE, GONE), (2, 3), None),
        ((HIDDEN, HIDDEN), (0, 1), None),
    ],
    ids=[
        "beyond those found", "refuted at both ends", "one hidden on end", "two hidden on end",
        "refuted between", "hidden at both ends", "none of those found", "all hidden",
    ],
)  # fmt: skip
def test_stairs_reach_as_far_as_steps_are_seen(
    steps: tuple[tuple[int, int, int], ...], found: tuple[int, int], chosen: tuple[int, int] | None
) -> None:
    on, nearer, farther = np.array(steps).T
    assert choose_steps(counts(len(steps), on=on, nearer=nearer, farther=farther), found) == chosen


def test_stairs_are_gone_along_from_the_step_with_most_rays() -> None:
    # A refuted step between two parts: the better one is the stairs.
    on = np.array([10, 10, 0, 30, 30])
    farther = np.array([0, 0, 30, 0, 0])
    assert choose_steps(counts(5, on=on, farther=farther), (0, 4)) == (3, 4)
    assert choose_steps(counts(5, on=on[::-1], farther=farther), (0, 4)) == (0, 1)


def test_evidence_of_some_steps_is_theirs() -> None:
    part = counts(5, on=np.arange(5), continued=np.arange(10).reshape(2, 5)).of_steps(1, 3)
    assert part.on.tolist() == [1, 2, 3]
    assert part.continued.tolist() == [[1, 2, 3], [6, 7, 8]]


@pytest.mark.parametrize("profile", [UP, DOWN], ids=["up", "down"])
def test_all_rays_of_a_flight_lie_on_it(profile: StairProfile) -> None:
    evidence = evidence_of(measure(profile), profile)
    assert (evidence.on > 20).all()
    assert evidence.is_seen.all()
    assert not evidence.is_refuted.any()
    total = evidence.on.sum()
    assert evidence.nearer.sum() < 0.03 * total
    assert evidence.farther.sum() < 0.03 * total
    assert evidence.unmeasured.sum() == 0


def test_rays_on_treads_are_counted_beside_those_on_risers() -> None:
    low = evidence_of(measure(UP), UP)
    assert (low.on_tread[:4] > 20).all()
    high = make_profile(height=0.0)
    above = evidence_of(measure(high, slopes=(-1.0, 0.8)), high)
    assert above.on_tread.tolist() == [0, 0, 0, 0, 0]
    # Of stairs that descend, treads are what tells a step.
    assert evidence_of(measure(DOWN), DOWN).on_tread.tolist() == [0, 0, 0, 0, 0]


@pytest.mark.parametrize(("profile", "surfaces"), [(UP, FACE), (DOWN, (Surface.TREAD,))], ids=["up", "down"])
@pytest.mark.parametrize(("name", "factor"), [("nearer", 1.3), ("farther", 0.7), ("unmeasured", 0.0)])
def test_what_hides_a_step_or_is_seen_through_it_is_counted_for_it(
    profile: StairProfile, surfaces: tuple[Surface, ...], name: str, factor: float
) -> None:
    rays = measure(profile)
    chosen = towards(rays, profile, surfaces, 2)
    before = evidence_of(rays, profile)
    after = evidence_of(where(rays, chosen, factor * rays.inverse_distance), profile)
    assert getattr(after, name)[2] > 0.9 * before.on[2]
    assert after.on[2] == 0
    assert getattr(after, name)[[0, 1, 3, 4]].tolist() == getattr(before, name)[[0, 1, 3, 4]].tolist()
    assert after.is_seen.tolist() == [True, True, False, True, True]
    if name == "farther":
        assert after.is_refuted.tolist() == [False, False, True, False, False]


def test_what_is_seen_through_a_tread_is_counted_beside() -> None:
    rays = measure(UP)
    chosen = towards(rays, UP, (Surface.TREAD,), 1)
    after = evidence_of(where(rays, chosen, 0.7 * rays.inverse_distance), UP)
    assert after.farther_tread[1] > 20
    assert after.farther_tread[[0, 2, 3]].max() <= 2
    assert after.farther.sum() < 5


def test_rays_beside_the_stairs_say_nothing_of_them() -> None:
    rays = measure(UP, bearings=np.linspace(0.6, -0.6, 28))
    q = rays.inverse_distance
    across = rays.bearing / q
    beside = where(rays, np.abs(across) > 0.35, 0.4 * q)
    evidence = evidence_of(beside, UP)
    assert (evidence.on > 20).all()
    assert evidence.farther.sum() < 0.1 * evidence.on.sum()


@pytest.mark.parametrize(("off", "is_on"), [(0.0, True), (0.009, True), (-0.009, True), (0.02, False)])
def test_a_ray_is_on_a_surface_within_12_mm_of_it(off: float, is_on: bool) -> None:
    rays = measure(UP, noise=0.0)
    chosen = towards(rays, UP, FACE, 1)
    moved = 1.0 / (1.0 / np.maximum(rays.inverse_distance, 1e-6) + off)
    evidence = evidence_of(where(rays, chosen, moved), UP, noise=1e-5)
    assert (evidence.on[1] > 20) == is_on


def test_tolerances_follow_the_noise_up_to_a_share_of_a_step() -> None:
    predicted = fitted(UP).predict(np.linspace(-0.9, -0.1, 50))
    is_tread = predicted.surface == Surface.TREAD
    exact, noisy, wild = (tolerances(predicted, UP, noise) for noise in (0.0, 0.002, 1.0))
    np.testing.assert_allclose(exact, SURFACE_TOLERANCE * predicted.sensitivity)
    most = MAX_TOLERANCE_SHARE * np.where(is_tread, UP.rise, UP.run) * predicted.sensitivity
    np.testing.assert_allclose(noisy, np.minimum(exact + NUM_SIGMA * 0.002, most))
    np.testing.assert_allclose(wild, most)
    assert is_tread.any()
    assert not is_tread.all()


def test_a_wall_that_goes_on_above_is_no_step() -> None:
    rays = measure(UP, slopes=(-1.6, 0.4))
    last = UP.nosing_distances[-1]
    above = rays.slope > UP.tread_heights[-1] / last
    wall = evidence_of(where(rays, above, 1.0 / last), UP)
    assert wall.goes_on.tolist() == [False, False, False, False, True]
    assert wall.is_refuted[-1]
    assert not evidence_of(rays, UP).goes_on.any()
    # Half of its width: a post beside, or a wall that ends.
    half = above & (rays.bearing > 0.08)
    assert not evidence_of(where(rays, half, 1.0 / last), UP).goes_on.any()


def test_a_floor_that_goes_on_is_no_step_down() -> None:
    rays = measure(DOWN, slopes=(-1.6, -0.3))
    # The second level from above goes on as a floor: the nosings below it are not there.
    level = DOWN.tread_heights[3]
    s = DOWN.nosing_distances[2]
    floor = where(rays, rays.slope > level / s, rays.slope / level)
    evidence = evidence_of(floor, DOWN)
    assert evidence.goes_on[2]
    assert not evidence.goes_on[[3, 4]].any()
    assert evidence.is_refuted[2]
    assert choose_steps(evidence, (2, 4)) == (3, 4)


def test_a_level_that_goes_on_in_front_is_no_tread() -> None:
    # A floor at the height of the second tread reaches up to it from the camera: step 1 is none.
    rays = measure(UP)
    level = UP.tread_heights[2]
    s = UP.nosing_distances[1]
    floor = where(rays, rays.slope < level / s, rays.slope / level)
    evidence = evidence_of(floor, UP)
    assert evidence.goes_on[1]
    assert not evidence.goes_on[2:].any()


def test_stairs_are_told_from_one_flat_surface() -> None:
    assert flatness(measure(UP), UP) < 0.1
    assert flatness(measure(DOWN), DOWN) < 0.2
    ramp = measure(UP)
    # A ramp through the nosings: z = z0 + (s - s0)·rise/run, in Q over slope a straight line.
    steep = UP.rise / UP.run
    foot = UP.height - 0.5 * UP.rise - steep * UP.distance
    q = (ramp.slope - steep) / foot
    noise = np.random.default_rng(0).normal(0, NOISE, len(q))
    assert flatness(replace(ramp, inverse_distance=np.maximum(q + noise, 0.0)), UP) > 0.9


def test_noise_as_large_as_steps_leaves_nothing_to_tell_them() -> None:
    rays = measure(UP, noise=0.15)
    assert flatness(rays, UP, noise=0.15) > flatness(measure(UP), UP) + 0.3


def test_only_rays_between_the_sides_are_compared_with_a_flat_surface() -> None:
    rays = measure(UP, bearings=np.linspace(0.6, -0.6, 28))
    across = rays.bearing / rays.inverse_distance
    wall = where(rays, np.abs(across) > 0.35, 0.8)
    assert flatness(wall, UP, sides=(-0.3, 0.3)) < 0.1
    assert flatness(wall, UP) > 0.2
    assert flatness(wall, UP, sides=(5.0, 6.0)) == 1.0
    nothing = replace(rays, inverse_distance=np.zeros(len(rays.slope)))
    assert flatness(nothing, UP) == 1.0


def test_what_stands_before_a_flat_surface_does_not_make_it_steps() -> None:
    # A ramp of which a fifth is hidden by something 0.3 1/m nearer, more of it farther up.
    rays = measure(UP)
    steep = UP.rise / UP.run
    foot = UP.height - 0.5 * UP.rise - steep * UP.distance
    q = np.maximum((rays.slope - steep) / foot, 0.05)
    hidden = np.random.default_rng(1).random(len(q)) < 0.4 * (rays.slope + 0.8)
    ramp = replace(rays, inverse_distance=np.where(hidden, q + 0.3, q))
    assert flatness(ramp, UP) > 0.85
    assert flatness(where(measure(UP), hidden, measure(UP).inverse_distance + 0.3), UP) < 0.5


def test_rays_within_three_sigma_of_a_surface_are_on_it() -> None:
    # Noise that is more than the unevenness of surfaces: hardly a ray is off by chance.
    evidence = evidence_of(measure(UP, noise=0.006), UP, noise=0.006)
    off = evidence.nearer.sum() + evidence.farther.sum() + evidence.farther_tread.sum()
    assert off < 0.01 * (evidence.on.sum() + evidence.on_tread.sum())


@pytest.mark.parametrize("profile", [UP, DOWN], ids=["up", "down"])
def test_a_level_farther_than_a_tread_is_a_floor_or_a_landing(profile: StairProfile) -> None:
    # The upper floor is seen steeply down where the stairs descend.
    rays = measure(profile, slopes=(-5.0, 0.4))
    s, z = profile.nosing_distances, profile.tread_heights
    # As the profile goes on, the level behind the last nosing in view goes on; the other ends.
    floor_q, top_q = rays.slope / z[0], rays.slope / z[-1]
    far = rays.slope > z[0] / s[0] if profile.run < 0 else rays.slope < z[0] / s[0]
    assert is_level_seen(where(rays, far, floor_q), profile, is_top=False)
    beyond = rays.slope > z[-1] / s[-1] if profile.run > 0 else rays.slope < z[-1] / s[-1]
    assert is_level_seen(where(rays, beyond, top_q), profile, is_top=True)
    # A wall in its place, or nothing.
    for value in (0.0, 1.0 / (s.max() + 0.1)):
        assert not is_level_seen(where(rays, far | beyond, value), profile, is_top=False)
        assert not is_level_seen(where(rays, far | beyond, value), profile, is_top=True)


@pytest.mark.parametrize(("off", "is_seen"), [(0.2, True), (-0.2, True), (0.4, False), (-0.4, False)])
def test_a_floor_lies_within_0p3_rises_of_its_level(off: float, is_seen: bool) -> None:
    rays = measure(UP, slopes=(-2.5, 0.4))
    level = UP.tread_heights[0] + off * UP.rise
    near = rays.slope < UP.tread_heights[0] / UP.distance
    assert is_level_seen(where(rays, near, rays.slope / level), UP, is_top=False) == is_seen


@pytest.mark.parametrize(("num", "is_seen"), [(5, False), (6, True)])
def test_few_rays_tell_no_floor(num: int, is_seen: bool) -> None:
    rays = measure(UP, slopes=(-2.5, 0.4), noise=0.0)
    x = (UP.distance - 1.0 / rays.inverse_distance) / UP.run
    on = np.flatnonzero((x > 1.2) & (x < 1.7))
    kept = np.zeros(len(rays.slope), bool)
    kept[on[:num]] = True
    assert is_level_seen(where(rays, ~kept, 0.0), UP, is_top=False) == is_seen


@pytest.mark.parametrize(("low", "high", "is_seen"), [(1.2, 1.7, True), (1.9, 2.8, False), (0.3, 1.1, False)])
def test_a_floor_is_looked_for_between_1p15_and_1p8_runs(low: float, high: float, is_seen: bool) -> None:
    rays = measure(UP, slopes=(-4.0, 0.4), noise=0.0)
    x = (UP.distance - 1.0 / np.maximum(rays.inverse_distance, 1e-6)) / UP.run
    assert is_level_seen(where(rays, (x < low) | (x > high), 0.0), UP, is_top=False) == is_seen


def test_all_rays_hold_those_without_a_measurement() -> None:
    slope = np.linspace(-1.0, 0.2, 7)
    q = np.arange(28.0).reshape(7, 4)
    elevation = Elevation(
        grid=grid_of(slope, 4), bearing=np.array([0.3, 0.1, -0.1, -0.3]), inverse_distance=q
    )
    rays = all_rays(elevation, np.array([0, 3]))
    assert len(rays.slope) == 14
    assert rays.inverse_distance[:4].tolist() == [0.0, 3.0, 4.0, 7.0]
    assert rays.bearing[:2].tolist() == [0.3, -0.3]
    assert rays.row.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6]
    third = all_rays(elevation, np.array([0, 3]), 3)
    assert third.row.tolist() == [0, 0, 3, 3, 6, 6]
    assert third.strip.tolist() == [0, 3] * 3
    np.testing.assert_allclose(third.slope, slope[[0, 0, 3, 3, 6, 6]])


@pytest.mark.parametrize(("low", "high", "is_told"), [(0.65, 0.78, True), (0.82, 1.4, False)])
@pytest.mark.parametrize("profile", [UP, DOWN], ids=["up", "down"])
def test_a_surface_is_followed_over_0p8_rises_or_runs_beyond_its_nosing(
    profile: StairProfile, low: float, high: float, is_told: bool
) -> None:
    # A piece of the wall, or floor, that would go on beyond the last nosing in view.
    rays = measure(profile, slopes=(-1.6, 0.4), noise=0.0)
    step = 4 if profile.run > 0 else 0
    s, z = profile.nosing_distances[step], profile.tread_heights[step + 1]
    beyond = (
        (rays.slope * s - z) / profile.rise if profile.run > 0 else (z / rays.slope - s) / abs(profile.run)
    )
    surface = 1.0 / s if profile.run > 0 else rays.slope / z
    piece = (beyond > low) & (beyond < high)
    assert piece.any()
    evidence = evidence_of(where(rays, piece, surface), profile, noise=1e-4)
    assert (evidence.continued[0, step] > 0) == is_told


@pytest.mark.parametrize(("sigmas", "is_told"), [(1.4, False), (1.7, True)])
def test_a_ray_tells_whether_a_surface_goes_on_where_that_makes_1p5_standard_deviations(
    sigmas: float, is_told: bool
) -> None:
    # Of the last step, where a riser that goes on and the level behind it differ most.
    rays = measure(UP, slopes=(-1.6, 0.4), noise=0.0)
    s, z = UP.nosing_distances[-1], UP.tread_heights[-1]
    behind = fitted(UP).predict(rays.slope)
    expected = behind.expected(rays.slope, behind.entries(rays.slope))
    above = (rays.slope > z / s) & (rays.slope < (z + 0.8 * UP.rise) / s)
    # Told by what the rays meet, not by what is foretold to be behind.
    most = float((1.0 / s - np.maximum(expected, behind.farthest[behind.entries(rays.slope)]))[above].max())
    evidence = evidence_of(where(rays, above, 1.0 / s), UP, noise=most / sigmas)
    assert (evidence.continued[0, -1] + evidence.ended[0, -1] > 0) == is_told


@pytest.mark.parametrize(("share", "is_inside"), [(0.02, False), (0.05, True)])
def test_a_few_rays_in_a_hundred_beside_the_stairs_do_not_widen_them(share: float, is_inside: bool) -> None:
    # One more strip far aside, of which hardly a ray was measured.
    rays = measure(UP, bearings=np.append(0.6, np.linspace(0.3, -0.3, 14)))
    aside = rays.bearing > 0.5
    towards_step = np.zeros(len(rays.slope), bool)
    for step in range(5):
        chosen = np.flatnonzero(towards(rays, UP, FACE, step) & aside)
        total = np.count_nonzero(towards(rays, UP, FACE, step) & ~aside)
        towards_step[chosen[: round(share * total)]] = True
    evidence = evidence_of(where(rays, aside & ~towards_step, 0.0), UP)
    assert (evidence.unmeasured.sum() > 20) == is_inside
    assert (evidence.unmeasured.sum() == 0) == (not is_inside)


@pytest.mark.parametrize("profile", [UP, DOWN], ids=["up", "down"])
def test_a_flat_surface_is_compared_from_the_foot_of_the_stairs_to_the_last_nosing(
    profile: StairProfile,
) -> None:
    rays = measure(profile, slopes=(-3.0, 0.6))
    s, z = profile.nosing_distances, profile.tread_heights
    # Of stairs that descend the lowest rays see the uppermost tread, and its nosing ends the floor before it.
    low, high = (z[0] / s[0], z[-1] / s[-1]) if profile.run > 0 else (z[-1] / s[-1], z[1] / s[0])
    reference = flatness(rays, profile)
    for beyond in (rays.slope < low - 1e-3, rays.slope > high + 1e-3):
        assert flatness(where(rays, beyond, 1.5), profile) == pytest.approx(reference, rel=1e-6)
    for inside in (
        (rays.slope > low) & (rays.slope < low + 0.05),
        (rays.slope < high) & (rays.slope > high - 0.05),
    ):
        assert inside.any()
        assert flatness(where(rays, inside, 1.5), profile) != pytest.approx(reference, rel=0.01)


def test_only_a_step_that_found_the_lattice_begins_the_stairs() -> None:
    # The step behind those found shows most rays; between it and them one is refuted.
    on, farther = np.array([20, 20, 0, 90]), np.array([0, 0, 30, 0])
    assert choose_steps(counts(4, on=on, farther=farther), (0, 1)) == (0, 1)
    assert choose_steps(counts(4, on=on, farther=farther), (0, 3)) == (3, 3)
    assert choose_steps(counts(4, on=on[::-1], farther=farther[::-1]), (2, 3)) == (2, 3)


def test_four_rays_tell_a_flat_surface() -> None:
    rays = measure(UP, noise=0.0)
    inside = np.flatnonzero((rays.slope > -0.8) & (rays.slope < -0.1))[::400]
    for num, is_told in ((3, False), (4, True)):
        kept = np.zeros(len(rays.slope), bool)
        kept[inside[:num]] = True
        few = where(rays, ~kept, 0.0)
        assert (flatness(few, UP) != 1.0) == is_told
