"""Which surface of a lattice each pixel lies on, and what noise does to the rotation fitted to them."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.arrays import Float64Array, IntArray
from stairmap.detection.lattice_fit import fit_rotation
from stairmap.detection.stair_pixels import Membership, StairPixels, find_members, shown_riser_heights

RISE, RUN, NUM_STEPS = 0.17, 0.28, 8
FIRST, CAMERA_HEIGHT = 1.2, 1.0
UPWARD = {"distance": FIRST, "height": RISE - CAMERA_HEIGHT, "run": RUN, "rise": RISE}
DOWNWARD = {"distance": 2.2, "height": -1.9, "run": -RUN, "rise": RISE}
"""Stairs that ascend, three of their nosings above a camera 1 m up, and stairs that descend."""

ROWS = np.linspace(-1.4, 0.5, 700)
COLUMNS = np.linspace(-0.3, 0.3, 61)
"""Slopes z/s and t/s of the rays."""


def first_hits(slopes: Float64Array) -> tuple[Float64Array, IntArray, IntArray]:
    """Where rays meet stairs that ascend: forward distance, 1 on treads and 0 on risers, index of the nosing.

    The floor before the stairs counts as tread -1; what passes over the stairs has distance 0.
    """
    distance = np.zeros(len(slopes))
    kind, index = np.zeros(len(slopes), np.int64), np.full(len(slopes), -9)
    for place, slope in enumerate(slopes):
        best = np.inf
        for k in range(-1, NUM_STEPS):
            z = UPWARD["height"] + k * RISE
            start = UPWARD["distance"] + k * RUN if k >= 0 else 0.0
            level = z / slope if slope * z > 0 else np.inf
            if start < level < UPWARD["distance"] + (k + 1) * RUN and level < best:
                best, kind[place], index[place] = level, 1, k
            if k >= 0 and z - RISE < slope * start < z and start < best:
                best, kind[place], index[place] = start, 0, k
        distance[place] = best if np.isfinite(best) else 0.0
    return distance, kind, index


def pixels_of(slopes: Float64Array, distance: Float64Array) -> StairPixels:
    """One pixel for each slope and column, each at a forward distance."""
    s = np.repeat(distance, len(COLUMNS)) if distance.ndim == 1 else distance.ravel()
    slope, across = np.repeat(slopes, len(COLUMNS)), np.tile(COLUMNS, len(slopes))
    row = np.repeat(np.arange(len(slopes))[::-1], len(COLUMNS))
    return StairPixels(
        forward=s.astype(np.float32),
        height=(s * slope).astype(np.float32),
        left=(s * across).astype(np.float32),
        row=row,
        column=np.tile(np.arange(len(COLUMNS)), len(slopes)),
    )


def seen_upward(noise: float = 0.0, seed: int = 0) -> tuple[StairPixels, Membership, IntArray, IntArray]:
    """Pixels of stairs that ascend with noise of inverse depth, their membership, true kind and index."""
    distance, kind, index = first_hits(ROWS)
    slopes, kind, index = ROWS[distance > 0], kind[distance > 0], index[distance > 0]
    true = np.repeat(distance[distance > 0], len(COLUMNS))
    random = np.random.default_rng(seed)
    measured = 1.0 / (1.0 / true + noise * random.standard_normal(len(true)))
    pixels = pixels_of(slopes, measured.reshape(len(slopes), -1))
    members = find_members(pixels, **UPWARD, noise=max(noise, 1e-4), num_nosings=NUM_STEPS)
    return pixels, members, np.repeat(kind, len(COLUMNS)), np.repeat(index, len(COLUMNS))


def test_every_member_lies_on_its_own_surface() -> None:
    _, members, kind, index = seen_upward()
    np.testing.assert_array_equal(members.index[members.tread], index[members.tread])
    np.testing.assert_array_equal(members.index[members.riser], index[members.riser])
    assert (kind[members.tread] == 1).all()
    assert (kind[members.riser] == 0).all()
    assert set(np.unique(members.index[members.riser])) == set(range(NUM_STEPS))
    # The treads of nosings 0 to 4 lie below the camera.
    assert set(np.unique(members.index[members.tread])) == set(range(5))


def test_the_floor_is_on_no_riser() -> None:
    pixels, _, kind, index = seen_upward()
    below = find_members(pixels, distance=FIRST - 2 * RUN, height=-CAMERA_HEIGHT - RISE, run=RUN, rise=RISE,
                         noise=0.002, num_nosings=NUM_STEPS + 2)  # fmt: skip
    is_floor = (kind == 1) & (index == -1)
    assert not (below.riser & is_floor).any()


@pytest.mark.parametrize("noise", [0.002, 0.004])
def test_noise_does_not_choose_pixels_that_err_one_way(noise: float) -> None:
    pixels, members, _, _ = seen_upward(noise=noise)
    for k in range(NUM_STEPS):
        mine = members.riser & (members.index == k)
        errors = pixels.forward[mine] - (FIRST + k * RUN)
        assert abs(errors.mean()) < 3.5 * errors.std() / np.sqrt(mine.sum()) + 0.001


@pytest.mark.parametrize("seed", range(3))
def test_noise_does_not_tilt_the_axes(seed: int) -> None:
    pixels, members, _, _ = seen_upward(noise=0.004, seed=seed)
    tilt, roll, turn, _ = fit_rotation(pixels, members, 0.004, NUM_STEPS, 1, np.radians(2.0), **UPWARD)
    assert np.degrees(abs(tilt)) < 0.1
    assert np.degrees(abs(roll)) < 0.1
    assert np.degrees(abs(turn)) < 0.1


def test_only_the_fronts_of_slabs_are_risers_where_these_are_open() -> None:
    distance, _, _ = first_hits(ROWS)
    pixels = pixels_of(ROWS[distance > 0], distance[distance > 0])
    members = find_members(pixels, **UPWARD, noise=1e-4, num_nosings=NUM_STEPS, slab_thickness=0.05)
    nosing_z = UPWARD["height"] + members.index[members.riser] * RISE
    assert (nosing_z - pixels.height[members.riser] < 0.051).all()
    assert set(np.unique(members.index[members.riser])) == set(range(NUM_STEPS))


def test_a_riser_above_the_camera_shows_what_the_step_below_it_leaves() -> None:
    shown = shown_riser_heights(**UPWARD, num_nosings=NUM_STEPS)
    below = UPWARD["height"] + np.arange(NUM_STEPS) * RISE < RISE
    np.testing.assert_allclose(shown[below], 0.7 * RISE, rtol=1e-6)
    # Nosing 7 over nosing 6: the line of sight over 0.19 m at 2.88 m meets the riser at 3.16 m 18 mm higher.
    assert shown[7] == pytest.approx(0.7 * (RISE - 0.19 * RUN / 2.88), abs=1e-3)
    assert (np.diff(shown[~below]) < 0).all()


def test_of_stairs_that_descend_only_treads_are_seen() -> None:
    index = np.arange(NUM_STEPS)
    s, z = DOWNWARD["distance"] + index * DOWNWARD["run"], DOWNWARD["height"] + index * RISE
    # Just above the line of sight over the nosing before it, and just below that over its own.
    slopes = np.concatenate([z[1:] / s[1:] + 0.01, z[:-1] / s[:-1] - 0.01])
    owner = np.concatenate([index[:-1], index[:-1]])
    inner = (slopes > np.concatenate([z[1:] / s[1:]] * 2)) & (slopes < np.concatenate([z[:-1] / s[:-1]] * 2))
    distance = (DOWNWARD["height"] + owner * RISE) / slopes
    pixels = pixels_of(slopes[inner], distance[inner])
    members = find_members(pixels, **DOWNWARD, noise=1e-4, num_nosings=NUM_STEPS)
    assert not members.riser.any()
    np.testing.assert_array_equal(
        members.index[members.tread], np.repeat(owner[inner], len(COLUMNS))[members.tread]
    )
