"""A fit finds the profile, the axes and each step's own place that rays were made of, as sure as it says."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from profile_rays import NOISE, OPTICS, changed, make_descending, make_profile, measure
from side_profiles import grid_of, scan, stairs_profile
from stairmap.arrays import Float64Array
from stairmap.detection.elevation import Elevation
from stairmap.detection.fit import (
    FittedProfile,
    Rays,
    fit_profile,
    gather_rays,
    turned_rays,
)
from stairmap.detection.profile import StairProfile
from stairmap.geometry import normalized

EDGE_SHIFT_STD = 2.0
MIN_NOISE = 0.0001
OVERHANG_STD = 0.03
THICKNESS_STD = 0.01
TURN_STD = np.radians(10.0)
RAYS_PER_SAMPLE = 6.0
"""Limits that hold, written again: who changes one changes it here as well."""

UP_STD = np.radians(0.4)

NAMES = ("rise", "run", "distance", "height")

KINDS = {
    "ascending": make_profile(),
    "overhanging": make_profile(overhang=0.025),
    "raked": make_profile(rake=0.015),
    "before a low camera": make_profile(height=-0.3),
    "open": make_profile(is_open=True, overhang=0.02),
    "descending": make_descending(),
    "descending, many": make_descending(distance=2.56, height=-2.09, num_steps=8),
}


def nearby(profile: StairProfile, share: float = 1.0) -> StairProfile:
    """Where a lattice would begin: 10 mm off, or a share of it, without what only the fit tells."""
    # Where only edges tell distances, they must be off by no more than the rows over which they are felt.
    share *= 0.1 if profile.run < 0 else 1.0
    return replace(
        profile,
        distance=profile.distance + 0.01 * share,
        height=profile.height - 0.01 * share,
        run=profile.run * (1 + 0.02 * share),
        rise=profile.rise * (1 - 0.02 * share),
        overhang=0.0,
        rake=0.0,
        ground=0.0,
        slope=0.0,
        offsets=np.zeros(2 * profile.num_steps + 1),
    )


def fit(rays: Rays, start: StairProfile, **how: object) -> FittedProfile:
    found = fit_profile(rays, start, **{"noise": NOISE, "optics": OPTICS, "up_std": UP_STD, **how})  # type: ignore[arg-type]
    assert found is not None
    return found


def errors_of(found: FittedProfile, true: StairProfile) -> Float64Array:
    return np.array([getattr(found.profile, name) - getattr(true, name) for name in NAMES])


@pytest.mark.parametrize("kind", KINDS)
def test_a_fit_finds_the_profile_that_rays_were_made_of(kind: str) -> None:
    true = KINDS[kind]
    found = fit(measure(true), nearby(true))
    errors = errors_of(found, true)
    # Edges alone tell rise and tilt apart less well.
    tolerance = 0.004 if kind == "before a low camera" else 0.0015
    assert np.abs(errors[:2]).max() < tolerance
    std = np.sqrt(np.diag(found.covariance)[:4])
    assert (np.abs(errors) < 3.0 * std).all()
    np.testing.assert_allclose(found.profile.nosing_distances, true.nosing_distances, atol=0.006)
    # 3 mm while steps' places were held by 4 mm each; an edge may be anywhere within its row.
    assert np.abs(found.profile.offsets).max() < 0.004
    assert np.abs([found.roll, found.turn]).max() < np.radians(0.15)
    assert abs(found.tilt) < max(3.0 * np.sqrt(found.covariance[4, 4]), np.radians(0.2))
    assert found.profile.is_open == true.is_open


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=pytest.mark.xfail(reason="an edge that is rows off is not felt"))
        for kind in ("descending", "descending, many")
    ],
)
def test_stairs_that_descend_are_found_from_10_mm_off_too(kind: str) -> None:
    true = KINDS[kind]
    found = fit(measure(true), nearby(true, 10.0))
    assert abs(found.profile.run - true.run) < 0.0015


@pytest.mark.parametrize("overhang", [0.0, 0.02, 0.045])
def test_overhang_is_measured_to_3_mm(overhang: float) -> None:
    true = make_profile(overhang=overhang)
    found = fit(measure(true), nearby(true))
    assert found.profile.overhang == pytest.approx(overhang, abs=0.003)
    assert abs(found.profile.overhang - overhang) < 2.5 * found.overhang_std
    assert found.overhang_std < 0.005


def test_of_stairs_that_descend_the_overhang_stays_unknown() -> None:
    found = fit(measure(make_descending()), nearby(make_descending()))
    assert found.overhang_std == pytest.approx(OVERHANG_STD, rel=0.01)
    assert found.profile.overhang == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("odd", "along", "upward"), [(2, 0.0, 0.012), (1, 0.0, -0.012), (3, 0.012, 0.0), (2, -0.012, 0.0)]
)
def test_an_odd_step_is_told_from_the_others_and_pulls_none(odd: int, along: float, upward: float) -> None:
    offsets = np.zeros(11)
    offsets[odd], offsets[5 + 1 + odd] = along, upward
    true = make_profile(offsets=offsets)
    found = fit(measure(true), nearby(true))
    # How high all of it lies is another matter: up is known to 0.4 degrees.
    for name, tolerance in (("nosing_distances", 0.003), ("tread_heights", 0.005)):
        single, whole = np.diff(getattr(found.profile, name)), np.diff(getattr(true, name))
        np.testing.assert_allclose(single, whole, atol=tolerance)
    assert found.profile.offsets[odd] == pytest.approx(along, abs=0.006)
    assert found.profile.offsets[6 + odd] == pytest.approx(upward, abs=0.006)
    assert np.abs(errors_of(found, true)[:2]).max() < 0.0025


def test_a_floor_that_lies_too_low_is_its_own() -> None:
    offsets = np.zeros(11)
    offsets[5] = -0.02
    true = make_profile(offsets=offsets)
    found = fit(measure(true), nearby(true))
    assert np.diff(found.profile.tread_heights)[0] == pytest.approx(0.19, abs=0.003)
    assert found.profile.rise == pytest.approx(true.rise, abs=0.0025)


ANGLE = np.radians(1.5)


@pytest.mark.parametrize(("tilt", "roll", "turn"), [(ANGLE, 0, 0), (0, ANGLE, 0), (0, 0, ANGLE)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("kind", ["ascending", "descending"])
def test_axes_that_are_turned_are_turned_back(
    kind: str, sign: float, tilt: float, roll: float, turn: float
) -> None:
    true = KINDS[kind]
    # Seen in axes turned by the opposite angles, to first order.
    share = 0.3 if kind == "descending" else 1.0
    tilt, roll, turn = (sign * share * angle for angle in (tilt, roll, turn))
    rays = measure(true).turned(-tilt, -roll, -turn)
    found = fit(rays, nearby(true), up_std=np.radians(2.0))
    angles = np.array([found.tilt, found.roll, found.turn])
    np.testing.assert_allclose(angles[1:], [roll, turn], atol=np.radians(0.1))
    # Up along the stairs and how high they lie are hardly told apart where they descend.
    assert abs(angles[0] - tilt) < (
        np.radians(0.3) if kind == "ascending" else np.sqrt(found.covariance[4, 4])
    )
    assert abs(angles[0] - tilt) < abs(tilt) or tilt == 0
    assert np.abs(errors_of(found, true)[:2]).max() < 0.004


def test_rays_that_are_turned_are_those_of_the_turned_axes() -> None:
    rays = measure(make_profile(), noise=0.0)
    tilt, roll, turn = 0.01, -0.02, 0.03
    s = 1.0 / rays.inverse_distance
    z, t = rays.slope * s, rays.bearing * s
    new = rays.turned(tilt, roll, turn)
    # New up = up + tilt·forward + roll·left; new forward = forward - tilt·up + turn·left; left follows.
    forward = s - tilt * z + turn * t
    np.testing.assert_allclose(new.inverse_distance, 1.0 / forward)
    np.testing.assert_allclose(new.slope, (z + tilt * s + roll * t) / forward)
    np.testing.assert_allclose(new.bearing, (t - roll * z - turn * s) / forward)
    found = replace(fit(rays, make_profile()), tilt=tilt, roll=roll, turn=turn)
    np.testing.assert_array_equal(turned_rays(rays, found).slope, new.slope)


def test_axes_are_unit_vectors_turned_by_the_fitted_angles() -> None:
    elevation = scan(stairs_profile(distance=1.2, height=-0.8))
    found = replace(fit(measure(make_profile()), make_profile()), tilt=0.01, roll=-0.02, turn=0.03)
    up, forward = found.axes(elevation)
    grid = elevation.grid
    assert up @ forward == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(up) == pytest.approx(1.0)
    assert np.linalg.norm(forward) == pytest.approx(1.0)
    assert (up @ grid.forward, up @ grid.left) == pytest.approx((0.01, -0.02), abs=1e-4)
    assert (forward @ grid.up, forward @ grid.left) == pytest.approx((-0.01, 0.03), abs=1e-3)
    # By larger angles: the forward axis is turned first, and then made perpendicular to up.
    up, forward = replace(found, tilt=0.2, roll=-0.3, turn=0.1).axes(elevation)
    ahead = grid.forward - 0.2 * grid.up + 0.1 * grid.left
    np.testing.assert_allclose(up, normalized(grid.up + 0.2 * grid.forward - 0.3 * grid.left))
    np.testing.assert_allclose(forward, normalized(ahead - (ahead @ up) * up))


@pytest.mark.parametrize(
    ("shift", "tolerance"),
    [
        (-0.5, 0.4),
        (0.5, 0.2),
        (2.0, 0.3),
    ],
)
def test_the_sensors_shift_of_edges_is_found(shift: float, tolerance: float) -> None:
    # Three nosings above the camera jump, and two treads below it tell their heights.
    true = make_profile(height=-0.3)
    found = fit(measure(true, optics=replace(OPTICS, shift=shift)), true)
    assert found.optics.shift == pytest.approx(shift, abs=tolerance)
    assert found.profile.rise == pytest.approx(true.rise, abs=0.002)


@pytest.mark.parametrize("slope", [-0.02, 0.02])
def test_treads_that_drain_are_no_tilt_where_up_is_known(slope: float) -> None:
    true = make_profile(slope=slope)
    found = fit(measure(true), nearby(true), up_std=np.radians(0.05))
    assert found.profile.slope == pytest.approx(slope, abs=0.004)
    assert abs(found.profile.rise - true.rise) < 0.0015


@pytest.mark.parametrize("ground", [-0.03, 0.03])
def test_ground_that_slopes_is_no_tilt_where_up_is_known(ground: float) -> None:
    true = make_profile(ground=ground)
    start = replace(nearby(true), ground=0.8 * ground)
    found = fit(measure(true), start, up_std=np.radians(0.05))
    assert found.profile.ground == pytest.approx(ground, abs=0.004)
    assert abs(found.profile.rise - true.rise) < 0.002
    # An up that is less sure may be turned instead, and says so.
    unsure = fit(measure(true), nearby(true), up_std=np.radians(1.0))
    assert unsure.covariance[4, 4] > 4 * found.covariance[4, 4]
    assert unsure.covariance[0, 0] > found.covariance[0, 0]


def built(random: np.random.Generator) -> Float64Array:
    """Offsets of five steps and the floor: runs and risers differ by 4 mm, the first by 8, places by 6."""
    information = np.diag([1.0 / 0.006**2] * 5 + [0.0] + [1.0 / 0.006**2] * 5)
    for first in (0, 1, 2, 3, 5, 6, 7, 8, 9):
        difference = np.zeros(11)
        difference[[first, first + 1]] = -1.0, 1.0
        information += np.outer(difference, difference) / (0.008 if first == 5 else 0.004) ** 2
    return random.multivariate_normal(np.zeros(11), np.linalg.inv(information))


def drawn(seed: int) -> tuple[FittedProfile, StairProfile, Float64Array]:
    """A flight as irregular as built ones, its axes as far off as told, with noise that six rays share."""
    random = np.random.default_rng(seed)
    irregular = built(random)
    true = make_profile(offsets=irregular, overhang=0.02)
    tilt, roll = random.normal(0, UP_STD, 2)
    turn = random.normal(0, np.radians(2.0))
    rays = measure(true, seed=seed, num_alike=6, noise=0.004, bearings=np.linspace(0.3, -0.3, 12))
    found = fit(rays.turned(-tilt, -roll, -turn), nearby(make_profile()), noise=0.004)
    return found, true, np.array([tilt, turn])


@cache
def many_drawn() -> tuple[Float64Array, Float64Array, Float64Array]:
    """Errors of 200 fits over their standard deviations: of six values, of nosings' places, of all steps."""
    values, places, own = [], [], []
    for seed in range(200):
        found, true, angles = drawn(seed)
        error = np.concatenate([errors_of(found, true), [found.tilt - angles[0], found.turn - angles[1]]])
        values.append(error / np.sqrt(np.diag(found.covariance)))
        off = found.profile.offsets - true.offsets
        own.append(np.stack([off[:5], off[6:]], axis=1) / found.step_std)
        whitened = np.linalg.solve(np.linalg.cholesky(found.covariance), error)
        places.append(whitened)
    return np.array(values), np.array(places), np.array(own)


def test_the_covariance_is_as_large_as_the_errors_are() -> None:
    values, whitened, _ = many_drawn()
    spread = values.std(axis=0)
    assert (spread > 0.55).all(), spread
    # An edge is somewhere within its row, in all strips alike, and tilt leans on edges: 1.25 for all six held
    # while steps were drawn about regular places instead of riser by riser.
    assert (spread < [1.25, 1.25, 1.25, 1.25, 1.7, 1.25]).all(), spread
    assert (np.abs(values.mean(axis=0)) < 0.35).all(), values.mean(axis=0)
    # All six together: chi squared of six degrees of freedom.
    assert 2.5 < (whitened**2).sum(axis=1).mean() < 10.0


def test_each_steps_own_std_is_as_large_as_its_errors_are() -> None:
    _, _, own = many_drawn()
    spread = own.std(axis=0)
    assert (spread > 0.5).all(), spread
    assert (spread < 1.3).all(), spread


def test_a_covariance_is_symmetric_and_positive_and_shrinks_with_the_noise() -> None:
    true = make_profile()
    stds = []
    for noise in (0.002, 0.006):
        covariance = fit(measure(true, noise=noise), nearby(true), noise=noise).covariance
        np.testing.assert_allclose(covariance, covariance.T, atol=1e-12)
        assert np.linalg.eigvalsh(covariance).min() > 0
        stds.append(np.sqrt(np.diag(covariance)))
    assert (stds[0] < stds[1]).all()


def test_rise_information_holds_rise_and_shift_without_the_shifts_prior() -> None:
    true = make_profile(height=0.1)
    optics = replace(OPTICS, shift=0.3)
    found = fit(measure(true, optics=optics), nearby(true), optics=optics)
    information = found.rise_information[:, :2]
    estimate = np.linalg.solve(information, found.rise_information[:, 2])
    # The shift that reducing the image made is known, and not counted. The prior held the rest back a little.
    assert estimate[1] > found.optics.shift - 0.3 > 0
    with_prior = information + np.diag([0.0, 1.0 / EDGE_SHIFT_STD**2])
    assert np.linalg.inv(with_prior)[0, 0] == pytest.approx(found.covariance[0, 0], rel=1e-6)
    together = np.linalg.solve(with_prior, found.rise_information[:, 2])
    assert together == pytest.approx([found.profile.rise, found.optics.shift - 0.3])


def test_noise_is_what_the_rays_show_whatever_was_told() -> None:
    true = make_profile()
    rays = measure(true, noise=0.003)
    for told in (0.001, 0.003, 0.009):
        found = fit(rays, nearby(true), noise=told)
        # Surfaces seen from near are uneven by more than the rays' noise.
        assert found.noise == pytest.approx(0.003, rel=0.15)
    assert fit(measure(true, noise=0.0), nearby(true), noise=0.0).noise >= MIN_NOISE / 20
    assert fit(measure(true, noise=0.0), nearby(true), noise=0.01).noise == pytest.approx(0.01 / 20, rel=0.5)


def only(rays: Rays, chosen: Float64Array) -> Rays:
    return Rays(
        slope=rays.slope[chosen],
        bearing=rays.bearing[chosen],
        inverse_distance=rays.inverse_distance[chosen],
        row=rays.row[chosen],
        strip=rays.strip[chosen],
    )


@pytest.mark.parametrize(("num", "is_fitted"), [(0, False), (35, False), (60, True)])
def test_too_few_rays_are_refused(num: int, is_fitted: bool) -> None:
    true = make_profile()
    rays = measure(true, slopes=(-0.8, -0.2))
    chosen = np.random.default_rng(0).choice(len(rays.slope), num, replace=False)
    found = fit_profile(only(rays, chosen), true, noise=NOISE, optics=OPTICS, up_std=UP_STD)
    assert (found is not None) == is_fitted


def test_rays_that_lie_nowhere_near_are_refused() -> None:
    rays = measure(make_profile())
    far = replace(rays, inverse_distance=0.3 * rays.inverse_distance)
    assert fit_profile(far, make_profile(), noise=NOISE, optics=OPTICS, up_std=UP_STD) is None


def test_a_fit_that_runs_away_is_refused() -> None:
    # A flat wall lets the profile slide up without end.
    rays = measure(make_profile())
    wall = replace(rays, inverse_distance=np.full(len(rays.slope), 1 / 1.4))
    found = fit_profile(wall, make_profile(), noise=NOISE, optics=OPTICS, up_std=UP_STD)
    assert found is None or abs(found.profile.distance - 1.2) < 0.5 * 0.28


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_what_stands_before_the_stairs_pulls_nothing(share: float) -> None:
    true = make_profile()
    rays = measure(true)
    hidden = rays.bearing > np.quantile(rays.bearing, 1 - share)
    found = fit(changed(rays, hidden, rays.inverse_distance + 0.4), nearby(true))
    assert np.abs(errors_of(found, true)[:2]).max() < 0.0015


def test_a_coarse_fit_knows_regular_steps_only() -> None:
    true = make_profile(offsets=np.random.default_rng(0).normal(0, 0.004, 11))
    coarse = fit(measure(true), nearby(make_profile()), is_coarse=True)
    assert (coarse.profile.offsets == 0).all()
    assert np.isnan(coarse.step_std).all()
    assert np.abs(errors_of(coarse, true)[:2]).max() < 0.006
    fine = fit(measure(true), coarse.profile, around=coarse)
    assert np.isfinite(fine.step_std).all()
    assert fine.step_std.shape == (5, 2)
    np.testing.assert_allclose(np.diff(fine.profile.tread_heights), np.diff(true.tread_heights), atol=0.003)
    wrong = np.abs(np.diff(coarse.profile.tread_heights) - np.diff(true.tread_heights)).max()
    assert np.abs(np.diff(fine.profile.tread_heights) - np.diff(true.tread_heights)).max() < 0.5 * wrong


def test_a_fit_goes_on_from_the_angles_and_optics_of_another() -> None:
    true = make_profile()
    rays = measure(true, optics=replace(OPTICS, shift=0.8)).turned(-0.02, 0.01, -0.03)
    coarse = fit(rays, nearby(true), up_std=np.radians(2.0), is_coarse=True)
    going_on = fit(rays, coarse.profile, up_std=np.radians(2.0), around=coarse)
    afresh = fit(rays, nearby(true), up_std=np.radians(2.0))
    np.testing.assert_allclose(errors_of(going_on, afresh.profile)[:2], 0.0, atol=1e-3)
    np.testing.assert_allclose(
        [going_on.tilt, going_on.roll, going_on.turn], [afresh.tilt, afresh.roll, afresh.turn], atol=2e-3
    )
    assert going_on.optics.shift == pytest.approx(afresh.optics.shift, abs=0.2)


@pytest.mark.parametrize(("true_smoothing", "other"), [(0.5, 2.0), (2.0, 0.5)])
def test_the_right_smoothing_costs_least(true_smoothing: float, other: float) -> None:
    true = make_profile(height=-0.4)
    rays = measure(true, optics=replace(OPTICS, smoothing=true_smoothing))
    right, wrong = (
        fit(rays, nearby(true), optics=replace(OPTICS, smoothing=value), is_coarse=True).cost
        for value in (true_smoothing, other)
    )
    assert right < 0.9 * wrong


def test_a_prior_counts_where_rays_tell_nothing() -> None:
    # Without an overhang, a lip is part of its riser: its thickness stays as unsure as it was.
    true = make_profile(overhang=0.0, thickness=0.035)
    found = fit(measure(true), nearby(true))
    assert found.profile.thickness == pytest.approx(0.035, abs=0.5 * THICKNESS_STD)
    # One strip tells no roll and no turn.
    single = fit(measure(true, bearings=np.zeros(3)), nearby(true), up_std=0.01)
    assert single.covariance[5, 5] == pytest.approx(TURN_STD**2, rel=0.05)
    assert single.roll == pytest.approx(0.0, abs=1e-6)


def test_risers_that_lean_forward_are_taken_for_an_overhang() -> None:
    # Over their foot by 20 mm and more: built risers do not hang over.
    found = fit(measure(make_profile(rake=-0.05)), nearby(make_profile()))
    assert found.profile.rake > -0.03


def test_values_of_a_fit_are_read_only() -> None:
    found = fit(measure(make_profile()), nearby(make_profile()))
    for array in (found.covariance, found.step_std, found.rise_information):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_a_fit_predicts_its_own_profile_or_another() -> None:
    found = fit(measure(make_profile()), nearby(make_profile()))
    slopes = np.linspace(-0.8, 0.2, 50)
    own = found.predict(slopes)
    assert own.slope[0] == pytest.approx(-0.8)
    assert own.slope[-1] >= 0.2
    assert own.gradient.shape[1] == 0
    wider = found.predict(slopes, found.profile.with_steps(0, 3))
    assert wider.step[-1] > own.step[-1]


def test_gathered_rays_are_the_measured_ones_of_their_strips() -> None:
    slope = np.linspace(-1.0, 0.2, 30)
    q = np.zeros((30, 4))
    q[3, 1], q[7, 2], q[9, 3] = 0.5, 0.6, 0.7
    grid = grid_of(slope, 4)
    elevation = Elevation(grid=grid, bearing=np.array([0.3, 0.1, -0.1, -0.3]), inverse_distance=q)
    rays = gather_rays(elevation, np.array([1, 2]))
    assert rays.row.tolist() == [3, 7]
    assert rays.strip.tolist() == [1, 2]
    np.testing.assert_allclose(rays.inverse_distance, [0.5, 0.6])
    np.testing.assert_allclose(rays.bearing, [0.1, -0.1])
    np.testing.assert_allclose(rays.slope, slope[[3, 7]])


def test_independent_rays_are_more_certain_than_is_said() -> None:
    # Rays are taken to err six by six: the square root of it is what independent ones are better.
    true = make_profile(offsets=np.zeros(11))
    errors = []
    for seed in range(40):
        found = fit(measure(true, seed=seed, noise=0.004), nearby(true), noise=0.004)
        errors.append(found.profile.nosing_distances - true.nosing_distances)
    assert np.std(errors) < 0.0015
    assert RAYS_PER_SAMPLE > 1


def test_rows_far_below_and_above_the_stairs_are_not_used() -> None:
    true = make_profile()
    rays = measure(true, slopes=(-3.0, 0.6))
    # A floor that ends two runs before the stairs, and a ceiling.
    wild = (rays.slope < -1.0 / (1.2 - 1.3 * 0.28)) | (rays.slope > 0.15)
    found = fit(changed(rays, wild, 1.1), nearby(true))
    reference = fit(rays, nearby(true))
    np.testing.assert_allclose(errors_of(found, reference.profile), 0.0, atol=1e-4)
