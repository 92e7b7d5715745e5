"""A profile says which surface each ray meets, what it measures there, and how that changes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from stairmap.arrays import Float64Array, IntArray
from stairmap.detection.profile import (
    Optics,
    Outline,
    Prediction,
    StairProfile,
    Surface,
    outline_of,
    predict,
    tabulate,
)

BEHIND_SHARE = 0.5
MIN_FORWARD = 0.1
"""Limits that hold, written again: who changes one changes it here as well."""

ROW = 1 / 290
SHARP = Optics(row_size=ROW, smoothing=0.0, shift=0.0)
BLURRED = Optics(row_size=ROW, smoothing=0.8, shift=0.4)
SLOPES = np.linspace(-1.3003, 0.9007, 1501)


def ascending(**changes: Any) -> StairProfile:
    """Stairs that lead up, the camera 0.67 m over their floor."""
    values = {"distance": 1.2, "height": -0.5, "run": 0.28, "rise": 0.17, "num_steps": 7}
    return StairProfile(**{**values, **changes})


def descending(**changes: Any) -> StairProfile:
    """Stairs that lead down, the camera 0.98 m over the last tread."""
    values = {"distance": 3.0, "height": -2.0, "run": -0.28, "rise": 0.17, "num_steps": 7}
    return StairProfile(**{**values, **changes})


UP, DOWN = ascending(), descending()
FULL = {"overhang": 0.025, "rake": 0.03, "slope": 0.01, "ground": 0.02, "thickness": 0.04}

Section = tuple[Surface, int, tuple[float, float], tuple[float, float]]
"""A surface of a step, and its two ends (s, z), m."""


def sections_of(profile: StairProfile) -> list[Section]:
    """Every surface of a profile as a piece of a section, none of them hidden."""
    s, z = profile.nosing_distances, profile.tread_heights
    rise_of = [
        profile.direction * (profile.ground + (profile.slope if k > 0 else 0.0)) for k in range(len(z))
    ]
    start = np.append(s[0] - profile.run, s)

    def on_level(row: int, distance: float) -> tuple[float, float]:
        return distance, z[row] + rise_of[row] * (distance - start[row])

    parts: list[Section] = []
    if profile.run < 0:
        for row in range(len(z)):
            parts.append((Surface.TREAD, row - 1, on_level(row, 0.01), on_level(row, start[row])))
        return parts
    depth = profile.run + profile.overhang
    begin = 0.05
    for k in range(profile.num_steps):
        top, under = z[k + 1], z[k + 1] - profile.thickness
        foot = s[k] + profile.overhang
        if profile.is_open:
            end = s[0] + BEHIND_SHARE * profile.run if k == 0 else s[k - 1] + depth
            parts.append((Surface.TREAD, k - 1, on_level(k, begin), on_level(k, end)))
            parts.append((Surface.UNDERSIDE, k, (s[k], under), (s[k] + depth, under)))
        else:
            # Tread k - 1 ends where it meets the riser s = foot + rake·(top - z).
            c, rake = rise_of[k], profile.rake
            meet = (foot + rake * (top - z[k] + c * start[k])) / (1 + rake * c)
            parts.append((Surface.TREAD, k - 1, on_level(k, begin), on_level(k, meet)))
            upper = (foot + rake * profile.thickness, under)
            parts.append((Surface.RISER, k, on_level(k, meet), upper))
            parts.append((Surface.UNDERSIDE, k, (s[k], under), upper))
        parts.append((Surface.FRONT, k, (s[k], under), (s[k], top)))
        begin = float(s[k])
    last = profile.num_steps
    # As far as the slab under it, which begins one overhang behind the nosing.
    end = s[-1] + profile.run + profile.overhang
    parts.append((Surface.TREAD, last - 1, on_level(last, begin), on_level(last, end)))
    return parts


def cast(profile: StairProfile, slopes: Float64Array) -> tuple[Float64Array, IntArray, IntArray]:
    """Inverse distance of the first surface along each ray, which it is, and its step; 0 for none."""
    nearest = np.full(len(slopes), np.inf)
    surface, step = np.full(len(slopes), -1), np.full(len(slopes), -9)
    for kind, index, (s0, z0), (s1, z1) in sections_of(profile):
        ds, dz = s1 - s0, z1 - z0
        denominator = dz - slopes * ds
        share = (slopes * s0 - z0) / np.where(np.abs(denominator) > 1e-12, denominator, np.nan)
        s = s0 + share * ds
        hit = (share >= 0) & (share <= 1) & (s > 0) & (s < nearest - 1e-9)
        nearest[hit], surface[hit], step[hit] = s[hit], kind, index
    return np.where(np.isfinite(nearest), 1.0 / nearest, 0.0), surface, step


def away_from_borders(outline: Outline, slopes: Float64Array, reach: float = 1e-4) -> Float64Array:
    """Slopes farther than ``reach`` from every border."""
    if len(outline.top) == 1:
        return slopes
    return slopes[np.abs(slopes[:, None] - outline.top[:-1]).min(axis=1) > reach]


def assert_seen_as_cast(profile: StairProfile) -> None:
    # Whether a tread near the camera's height is in view depends on its slope as well, which is left out.
    sight = profile.tread_heights[1:] / profile.nosing_distances
    assume(np.abs(sight).min() > 0.07)
    outline = outline_of(profile)
    slopes = away_from_borders(outline, SLOPES)
    predicted = predict(outline, slopes, SHARP)
    q, surface, step = cast(profile, slopes)
    # Where no ray meets the stairs there is nothing to compare.
    assume((q > 0).any())
    # What lies beyond the last surface is unknown.
    known = slopes < min(outline.top[-2], slopes[q > 0].max())
    is_behind = predicted.surface == Surface.BEHIND
    plain = known & ~is_behind
    np.testing.assert_allclose(predicted.inverse_distance[plain], q[plain], rtol=1e-6)
    np.testing.assert_array_equal(predicted.surface[plain], surface[plain])
    np.testing.assert_array_equal(predicted.step[plain], step[plain])
    # Where nothing is known of what lies behind, all that is farther agrees.
    assert (q[known & is_behind] <= predicted.farthest[known & is_behind] + 1e-9).all()
    assert (predicted.farthest[plain & (predicted.edge_spread == 0)] == 0).all()


@st.composite
def profiles(draw: st.DrawFn, *, run_sign: float, is_open: bool = False) -> StairProfile:
    num = draw(st.integers(2, 9))
    rise, run = draw(st.floats(0.10, 0.22)), draw(st.floats(0.22, 0.40))
    if run_sign > 0:
        distance, height = draw(st.floats(0.6, 2.5)), draw(st.floats(-1.2, -0.15)) + rise
    else:
        distance, height = 0.4 + run * num, -draw(st.floats(0.3, 1.2)) - rise * num
    irregular = st.floats(-0.01, 0.01)
    # Where the tread of a slab ends, it is taken for level.
    most = 0.0 if is_open else 1.0
    return StairProfile(
        distance=distance,
        height=height,
        run=run_sign * run,
        rise=rise,
        num_steps=num,
        overhang=draw(st.floats(0.0, 0.045)),
        thickness=draw(st.floats(0.02, 0.05)),
        is_open=is_open,
        rake=0.0 if is_open else draw(st.floats(0.0, 0.04)),
        ground=most * draw(st.floats(-0.04, 0.04)),
        slope=most * draw(st.floats(-0.02, 0.02)),
        offsets=np.array(draw(st.lists(irregular, min_size=2 * num + 1, max_size=2 * num + 1))),
    )


@settings(max_examples=60, deadline=None, derandomize=True)
@given(profiles(run_sign=1.0))
def test_rays_meet_what_is_nearest_of_stairs_that_ascend(profile: StairProfile) -> None:
    assert_seen_as_cast(profile)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(profiles(run_sign=-1.0))
def test_rays_meet_what_is_nearest_of_stairs_that_descend(profile: StairProfile) -> None:
    assert_seen_as_cast(profile)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(profiles(run_sign=1.0, is_open=True))
def test_rays_meet_what_is_nearest_of_open_stairs(profile: StairProfile) -> None:
    assert_seen_as_cast(profile)


def seen_pieces(profile: StairProfile) -> list[tuple[str, int]]:
    outline = outline_of(profile)
    return [(Surface(s).name, int(k)) for s, k in zip(outline.surface, outline.step, strict=True)]


def test_below_the_camera_floor_risers_and_treads_take_turns() -> None:
    low = ascending(height=-1.4, num_steps=3, thickness=0.0)
    assert seen_pieces(low) == [
        ("TREAD", -1), ("RISER", 0), ("TREAD", 0), ("RISER", 1), ("TREAD", 1), ("RISER", 2), ("TREAD", 2),
        ("BEHIND", 2),
    ]  # fmt: skip


def test_above_the_camera_risers_follow_each_other_and_no_tread_is_seen() -> None:
    high = ascending(height=0.3, num_steps=3, thickness=0.0)
    assert [piece for piece in seen_pieces(high) if piece[0] != "FRONT"] == [
        ("RISER", 0), ("RISER", 1), ("RISER", 2), ("BEHIND", 2),
    ]  # fmt: skip


@pytest.mark.parametrize(("overhang", "shows"), [(0.0, False), (0.03, True)])
def test_only_an_overhang_above_the_camera_shows_its_underside(overhang: float, shows: bool) -> None:
    high = ascending(height=0.2, num_steps=3, overhang=overhang)
    assert (("UNDERSIDE", 0) in seen_pieces(high)) == shows
    low = ascending(height=-1.4, num_steps=3, overhang=overhang)
    assert not any(surface == "UNDERSIDE" for surface, _ in seen_pieces(low))


def test_of_stairs_that_descend_only_treads_are_seen_the_nearest_first() -> None:
    assert seen_pieces(descending(num_steps=3, distance=1.2, height=-1.6)) == [
        ("TREAD", 2), ("TREAD", 1), ("TREAD", 0), ("TREAD", -1), ("BEHIND", 0),
    ]  # fmt: skip


def test_the_last_level_that_is_seen_goes_on() -> None:
    low = ascending(height=-1.4, num_steps=3)
    outline = outline_of(low)
    np.testing.assert_allclose(outline.line[-1], [0.0, 1 / low.tread_heights[-1]])
    # Above the camera there is no level: what follows the last nosing lies half a run behind it.
    high = ascending(height=0.3, num_steps=3)
    np.testing.assert_allclose(outline_of(high).line[-1], [1 / (1.2 + 2.5 * 0.28), 0.0])


def test_what_lies_beside_or_behind_the_camera_is_not_seen() -> None:
    around = ascending(distance=MIN_FORWARD - 0.28, height=-1.4)
    assert min(step for surface, step in seen_pieces(around) if surface == "RISER") == 2
    just = replace(around, distance=around.distance + 0.01)
    assert min(step for surface, step in seen_pieces(just) if surface == "RISER") == 1


@pytest.mark.parametrize(("extent_rows", "kept"), [(0.15, True), (0.3, False)])
def test_level_surfaces_seen_edge_on_are_left_out(extent_rows: float, kept: bool) -> None:
    # The tread of nosing 2 lies 10 mm under the camera, 1.76 to 2.04 m away: 0.23 rows.
    outline = outline_of(ascending(height=-0.35), min_extent=extent_rows * ROW)
    treads = outline.step[outline.surface == Surface.TREAD].tolist()
    assert treads == [-1, 0, 1, 2] if kept else [-1, 0, 1]
    assert Surface.FRONT in outline.surface[outline.step == 2]


SHAPE = ("overhang", "thickness", "rake", "ground", "slope")


def moved(profile: StairProfile, value: int, change: float) -> StairProfile:
    """The profile with one of its shape's values changed: nosings, levels, then ``SHAPE``."""
    num_places = 2 * profile.num_steps + 1
    if value < num_places:
        offsets = profile.offsets.copy()
        offsets[value] += change
        return replace(profile, offsets=offsets)
    name = SHAPE[value - num_places]
    return replace(profile, **{name: getattr(profile, name) + change})


def numeric_gradient(profile: StairProfile, slopes: Float64Array, optics: Optics) -> Float64Array:
    columns, thin = [], {"min_extent": optics.smoothing * ROW}
    for value in range(2 * profile.num_steps + 6):
        high, low = (
            predict(outline_of(moved(profile, value, change), **thin), slopes, optics).inverse_distance
            for change in (1e-6, -1e-6)
        )
        columns.append((high - low) / 2e-6)
    high, low = (
        predict(
            outline_of(profile, **thin), slopes, replace(optics, shift=optics.shift + change)
        ).inverse_distance
        for change in (1e-5, -1e-5)
    )
    return np.stack([*columns, (high - low) / 2e-5], axis=1)


PROFILES = {
    "ascending": ascending(**FULL),
    "ascending below the camera": ascending(height=-1.5, num_steps=5, **FULL),
    "without overhang": ascending(thickness=0.04),
    "hidden backs of treads": ascending(height=-1.5, distance=0.4, **{**FULL, "overhang": 0.06}),
    "open": ascending(is_open=True, **{**FULL, "rake": 0.0}),
    "descending": descending(**FULL),
    "irregular": ascending(offsets=np.random.default_rng(0).normal(0, 0.004, 15), **FULL),
}


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("smoothing", [0.5, 2.0])
def test_derivatives_are_those_of_the_prediction(name: str, smoothing: float) -> None:
    profile = PROFILES[name]
    optics = replace(BLURRED, smoothing=smoothing)
    outline = outline_of(profile, min_extent=smoothing * ROW)
    predicted = predict(outline, SLOPES, optics)
    # What is behind an edge is unknown, and its place is not differentiated.
    is_behind = outline.surface == Surface.BEHIND
    edges = outline.top[:-1][is_behind[1:] | is_behind[:-1]]
    near = np.abs(SLOPES[:, None] - edges).min(axis=1) < 8.0 * smoothing * ROW
    clear = ~near & (predicted.surface != Surface.BEHIND)
    assert np.count_nonzero(clear) > 200
    expected = numeric_gradient(profile, SLOPES, optics)[clear]
    found = predicted.gradient[clear]
    np.testing.assert_allclose(found, expected, atol=0.005 * np.abs(expected).max(axis=0, initial=1e-3).max())
    # A value that moves what is seen by much must do so in the prediction, whichever it is.
    moving = np.abs(expected).max(axis=0) > 1e-3
    relative = np.abs(found - expected).max(axis=0)[moving] / np.abs(expected).max(axis=0)[moving]
    assert relative.max() < 0.02


def test_there_are_no_derivatives_where_none_are_asked_for() -> None:
    outline = outline_of(UP)
    assert predict(outline, SLOPES, BLURRED, has_gradient=False).gradient.shape == (len(SLOPES), 0)
    with_them = predict(outline, SLOPES, BLURRED)
    without = predict(outline, SLOPES, BLURRED, has_gradient=False)
    np.testing.assert_array_equal(with_them.inverse_distance, without.inverse_distance)
    assert with_them.gradient.shape == (len(SLOPES), 2 * 7 + 6 + 1)


def test_by_slope_is_the_derivative_by_the_slope() -> None:
    for profile in PROFILES.values():
        outline = outline_of(profile)
        high, low = (predict(outline, SLOPES + change, BLURRED).inverse_distance for change in (1e-7, -1e-7))
        predicted = predict(outline, SLOPES, BLURRED)
        scale = np.abs(predicted.by_slope).max()
        np.testing.assert_allclose(predicted.by_slope, (high - low) / 2e-7, atol=1e-4 * scale)


@pytest.mark.parametrize("smoothing", [0.7, 1.5])
@pytest.mark.parametrize("name", ["ascending", "descending", "without overhang"])
def test_smoothing_is_a_convolution_of_what_is_seen_sharply(name: str, smoothing: float) -> None:
    profile = PROFILES[name]
    outline = outline_of(profile)
    scale = smoothing * 0.55 * ROW
    # The density of a logistic distribution; its steps are a twentieth of its scale.
    offsets = np.arange(-400, 401) * scale / 20
    density = 1.0 / (4 * np.cosh(offsets / scale / 2) ** 2)
    density /= density.sum()
    slopes = SLOPES[(SLOPES > -1.0) & (outline.top[-2] - 15 * scale > SLOPES)]
    sharp = predict(outline, (slopes[:, None] - offsets).ravel(), SHARP, has_gradient=False)
    expected = sharp.inverse_distance.reshape(len(slopes), -1) @ density
    found = predict(outline, slopes, Optics(row_size=ROW, smoothing=smoothing, shift=0.0)).inverse_distance
    # Pieces thinner than the kernel are felt by their neighbours only.
    thickness = np.diff(np.concatenate([[-9.0], outline.top[:-1], [9.0]]))
    thin = np.flatnonzero(thickness < 12 * scale)
    near = np.zeros(len(slopes), dtype=bool)
    for piece in thin:
        low, high = outline.top[piece - 1], outline.top[piece]
        near |= (slopes > low - 14 * scale) & (slopes < high + 14 * scale)
    assert np.count_nonzero(~near) > 100
    np.testing.assert_allclose(found[~near], expected[~near], rtol=1e-3)


def test_a_gaussian_and_its_logistic_blend_an_edge_alike() -> None:
    # One jump: the share of the farther side, against the integral of a Gaussian of one row.
    edge = StairProfile(distance=1.0, height=0.3, run=0.3, rise=0.6, num_steps=1, thickness=0.0)
    outline = outline_of(edge)
    rows = np.arange(-3.0, 3.1, 0.25)
    slopes = outline.top[-2] + rows * ROW
    q = predict(outline, slopes, Optics(row_size=ROW, smoothing=1.0, shift=0.0)).inverse_distance
    near, far = 1.0, outline.line[-1, 0]
    share = (near - q) / (near - far)
    np.testing.assert_allclose(share, ndtr(rows), atol=0.024)


@pytest.mark.parametrize("shift", [0.0, 0.7, 2.0])
def test_a_shift_moves_edges_of_near_surfaces_outward(shift: float) -> None:
    optics = Optics(row_size=ROW, smoothing=0.3, shift=shift)
    # From below: nosing 6 is the upper end of its riser, so that it moves up.
    up = ascending(thickness=0.0)
    edge = up.tread_heights[-1] / up.nosing_distances[-1]
    fine = np.linspace(edge - 5 * ROW, edge + 5 * ROW, 2001)
    q = predict(outline_of(up), fine, optics).inverse_distance
    halfway = fine[np.argmin(np.abs(q - 0.5 * (q[0] + q[-1])))]
    assert (halfway - edge) / ROW == pytest.approx(shift, abs=0.02)
    kink = StairProfile(distance=1.2, height=-1.2, run=0.28, rise=0.17, num_steps=1, thickness=0.0)
    still, shifted = (
        predict(outline_of(kink), SLOPES, replace(optics, shift=value)).inverse_distance
        for value in (0.0, shift)
    )
    # Where two surfaces meet there is no edge to move.
    foot = kink.tread_heights[0] / 1.2
    around = np.abs(SLOPES - foot) < 4 * ROW
    np.testing.assert_allclose(still[around], shifted[around], rtol=1e-9)


def test_a_near_surface_above_a_far_one_is_shifted_downward() -> None:
    # A slab below the camera: the lower edge of its front is the lower end of what is near.
    slab = StairProfile(
        distance=1.0, height=-0.1, run=0.3, rise=0.2, num_steps=1, is_open=True, thickness=0.05
    )
    outline = outline_of(slab)
    lower = np.flatnonzero(outline.surface == Surface.FRONT)[0]
    edge = outline.top[lower - 1]
    fine = np.linspace(edge - 5 * ROW, edge + 5 * ROW, 2001)
    still, shifted = (
        predict(outline, fine, Optics(row_size=ROW, smoothing=0.3, shift=shift)).inverse_distance
        for shift in (0.0, 1.5)
    )
    jump = outline.line[lower, 0] + outline.line[lower, 1] * edge - outline.line[lower - 1, 0]
    assert jump > 0
    level = outline.line[lower - 1, 0] + 0.5 * jump
    moved_by = fine[np.argmin(np.abs(shifted - level))] - fine[np.argmin(np.abs(still - level))]
    assert moved_by / ROW == pytest.approx(-1.5, abs=0.1)


def test_sensitivity_tells_how_a_surface_that_moves_along_its_normal_changes_it() -> None:
    outline = outline_of(ascending(thickness=0.0))
    slopes = away_from_borders(outline, SLOPES, 0.01)
    slopes = slopes[slopes < outline.top[-2]]
    predicted = predict(outline, slopes, SHARP)
    risers = predicted.surface == Surface.RISER
    # A riser k at s: dQ/ds = 1/s²; a tread at z: dQ/dz = tau / z².
    s = UP.nosing_distances[predicted.step[risers]]
    np.testing.assert_allclose(predicted.sensitivity[risers], 1 / s**2)
    z = UP.tread_heights[predicted.step[~risers] + 1]
    np.testing.assert_allclose(predicted.sensitivity[~risers], np.abs(slopes[~risers]) / z**2, rtol=1e-6)


def test_an_edges_place_within_a_row_spreads_only_rays_near_a_jump() -> None:
    outline = outline_of(ascending(thickness=0.0))
    predicted = predict(outline, SLOPES, replace(BLURRED, smoothing=0.5, shift=0.0))
    jumps = np.abs(np.diff(outline.line[:, 0]) + np.diff(outline.line[:, 1]) * outline.top[:-1]) > 1e-6
    distance = np.abs(SLOPES[:, None] - outline.top[:-1][jumps]).min(axis=1)
    assert predicted.edge_spread[distance > 4 * ROW].max() < 1e-9
    at_edge = predict(outline, outline.top[:-1][jumps], replace(BLURRED, smoothing=0.5, shift=0.0))
    assert at_edge.edge_spread.min() > 0.005


def test_before_what_is_unknown_all_that_is_farther_agrees() -> None:
    outline = outline_of(ascending(height=0.2, num_steps=2, thickness=0.0))
    top = outline.top[-2]
    beyond = 1 / (UP.distance + 1.5 * 0.28)
    slopes = np.array([top - 10 * ROW, top - 0.5 * ROW, top + 10 * ROW])
    predicted = predict(outline, slopes, replace(BLURRED, smoothing=0.5, shift=0.0))
    assert predicted.farthest[0] == 0
    np.testing.assert_allclose(predicted.farthest[1:], beyond)


def test_a_table_has_two_entries_a_row_and_is_straight_between_them() -> None:
    outline = outline_of(UP)
    table = tabulate(outline, BLURRED, -0.8, 0.2, has_gradient=False)
    np.testing.assert_allclose(np.diff(table.slope), 0.5 * ROW)
    assert table.slope[0] == -0.8
    assert table.slope[-1] >= 0.2
    slopes = np.random.default_rng(2).uniform(-0.8, 0.2, 400)
    entries = table.entries(slopes)
    assert np.abs(table.slope[entries] - slopes).max() <= 0.25 * ROW + 1e-12
    exact = predict(outline, slopes, BLURRED).inverse_distance
    # Half a row off an edge, it bends.
    np.testing.assert_allclose(table.expected(slopes, entries), exact, atol=0.02)
    assert np.median(np.abs(table.expected(slopes, entries) - exact)) < 1e-5


def test_entries_of_rays_beyond_a_table_are_its_ends() -> None:
    table = tabulate(outline_of(UP), BLURRED, -0.5, 0.0, has_gradient=False)
    assert table.entries(np.array([-3.0, 3.0])).tolist() == [0, len(table.slope) - 1]
    single: Prediction = predict(outline_of(UP), np.array([0.1]), BLURRED)
    assert single.entries(np.array([-3.0, 3.0])).tolist() == [0, 0]


def test_nosings_and_treads_lie_on_the_lattice_and_their_own_offsets() -> None:
    own = np.arange(15) * 0.001
    profile = ascending(offsets=own)
    np.testing.assert_allclose(profile.nosing_distances, 1.2 + 0.28 * np.arange(7) + own[:7])
    np.testing.assert_allclose(profile.tread_heights, -0.5 + 0.17 * np.arange(-1, 7) + own[7:])
    assert (UP.direction, DOWN.direction) == (1.0, -1.0)
    with pytest.raises(ValueError, match="read-only"):
        profile.offsets[0] = 1.0


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.integers(0, 5), st.integers(0, 5))
def test_steps_that_are_added_and_cut_off_again_change_nothing(below: int, above: int) -> None:
    profile = ascending(offsets=np.random.default_rng(below).normal(0, 0.004, 15))
    wider = profile.with_steps(below, above)
    assert wider.num_steps == 7 + below + above
    np.testing.assert_allclose(wider.nosing_distances[below : below + 7], profile.nosing_distances)
    np.testing.assert_allclose(wider.tread_heights[below + 1 : below + 8], profile.tread_heights[1:])
    again = wider.with_steps(-below, -above)
    np.testing.assert_allclose(again.nosing_distances, profile.nosing_distances)
    np.testing.assert_allclose(again.tread_heights[1:], profile.tread_heights[1:])
    # The floor is no tread: below it, others are as regular as ever.
    floor = profile.tread_heights[0] if below == 0 else profile.height - profile.rise
    assert again.tread_heights[0] == pytest.approx(floor)


@pytest.mark.parametrize(("below", "above"), [(2, 0), (0, 3), (2, 3)])
def test_steps_that_are_cut_off_leave_the_others_where_they_are(below: int, above: int) -> None:
    profile = ascending(offsets=np.random.default_rng(5).normal(0, 0.004, 15))
    part = profile.with_steps(-below, -above)
    assert part.num_steps == 7 - below - above
    np.testing.assert_allclose(part.nosing_distances, profile.nosing_distances[below : 7 - above])
    # The tread below the first that is left has the place it had.
    np.testing.assert_allclose(part.tread_heights, profile.tread_heights[below : 8 - above])


def test_added_steps_are_regular() -> None:
    profile = ascending(offsets=np.full(15, 0.01))
    wider = profile.with_steps(2, 1)
    np.testing.assert_allclose(wider.offsets[[0, 1, 9]], 0.0)
    np.testing.assert_allclose(wider.offsets[10:13], 0.0)
    assert wider.offsets[-1] == 0.0
