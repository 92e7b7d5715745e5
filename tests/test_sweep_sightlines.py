"""Heights of nosings by the beams that pass over them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stairmap.detection.observation import StairEdge, StairObservation
from stairmap.sweep_sightlines import refined_by_sightlines

RISE, RUN, WIDTH, NUM = 0.17, 0.28, 1.2, 6
EYE = np.array([-2.5, 0.1, 0.3])


def beams(
    eye: np.ndarray, heights: np.ndarray, *, noise: float = 0.02, num: int = 20_000, seed: int = 0
) -> np.ndarray:
    """Points on risers and the wall behind that a LiDAR near the floor measures."""
    random = np.random.default_rng(seed)
    slope, side = random.uniform(-0.1, 0.5, num), random.uniform(-0.22, 0.22, num)
    end = np.full(num, (NUM - 1) * RUN + 1.5)
    for step in range(NUM - 1, -1, -1):
        at = eye[2] + slope * (step * RUN - eye[0])
        low = heights[step - 1] if step else 0.0
        end = np.where((at < heights[step]) & (at > low - 1.0), step * RUN, end)
    length = (end - eye[0]) * (1 + noise * random.standard_normal(num) / (end - eye[0]))
    points = np.column_stack([length, side * length, slope * length]) + eye
    return points[np.abs(points[:, 1]) < WIDTH / 2]


def seen(*, rise: float, height: float = 0.0, std: float = 0.05) -> StairObservation:
    """What a detector may say that knows the risers' places but not their heights."""
    edges = tuple(
        StairEdge(
            nosing=np.array([[k * RUN, y, height + (k + 1) * rise] for y in (WIDTH / 2, -WIDTH / 2)]),
            step_index=k,
            left_bounded=True,
            right_bounded=True,
            cue="crease",
            num_pixels=0,
            std=(0.005, std),
        )
        for k in range(NUM)
    )
    return StairObservation(
        stamp_ns=0,
        view="ascending",
        up=np.array([0.0, 0.0, 1.0]),
        forward=np.array([1.0, 0.0, 0.0]),
        edges=edges,
        rise=rise,
        run=RUN,
        width=WIDTH,
        origin=np.array([0.0, 0.0, height + rise]),
        covariance=np.diag([0.02**2] * 6),
        points=np.zeros((0, 3)),
    )


@pytest.mark.parametrize(("rise", "height"), [(0.175, -0.02), (0.16, 0.03), (0.17, 0.0)])
def test_low_beams_tell_heights_that_points_do_not(rise: float, height: float) -> None:
    points = beams(EYE, RISE * np.arange(1, NUM + 1))
    index = np.zeros(len(points), dtype=np.int64)
    found = refined_by_sightlines(seen(rise=rise, height=height), points, EYE[None], index)
    assert found.rise == pytest.approx(RISE, abs=0.001)
    assert found.origin[2] == pytest.approx(RISE, abs=0.003)
    assert np.sqrt(found.covariance[0, 0]) < 0.003
    heights = [edge.nosing[:, 2].mean() for edge in found.edges]
    np.testing.assert_allclose(heights, RISE * np.arange(1, NUM + 1), atol=0.004)


def test_uneven_steps_keep_their_own_heights() -> None:
    true = RISE * np.arange(1, NUM + 1) + [0.0, 0.012, -0.01, 0.0, 0.008, 0.0]
    points = beams(EYE, true)
    found = refined_by_sightlines(seen(rise=RISE), points, EYE[None], np.zeros(len(points), dtype=np.int64))
    # The first nosing is below the LiDAR: beams that pass over it may end on its tread.
    np.testing.assert_allclose([edge.nosing[0, 2] for edge in found.edges][1:], true[1:], atol=0.004)


def test_heights_that_are_known_well_are_kept() -> None:
    points = beams(EYE, RISE * np.arange(1, NUM + 1))
    index = np.zeros(len(points), dtype=np.int64)
    found = refined_by_sightlines(seen(rise=RISE + 0.004, std=0.0005), points, EYE[None], index)
    assert found.rise > RISE + 0.0012


def test_from_above_the_steps_nothing_is_changed() -> None:
    points = beams(EYE, RISE * np.arange(1, NUM + 1))
    index = np.zeros(len(points), dtype=np.int64)
    observation = seen(rise=0.175)
    found = refined_by_sightlines(observation, points, EYE[None] + [0, 0, 3.0], index)
    assert found is observation


def test_few_beams_change_nothing() -> None:
    points = beams(EYE, RISE * np.arange(1, NUM + 1), num=100)
    observation = seen(rise=0.175)
    index = np.zeros(len(points), dtype=np.int64)
    assert refined_by_sightlines(observation, points, EYE[None], index) is observation


def test_beams_beside_the_steps_do_not_count() -> None:
    true = RISE * np.arange(1, NUM + 1)
    points = beams(EYE, true)
    # Stairs beside these, half a rise higher.
    aside = np.array([0, WIDTH + 0.02, 0])
    others = beams(EYE, true + 0.5 * RISE, seed=1) + aside
    every = np.concatenate([points, others])
    eyes = np.array([EYE, EYE + aside])
    index = np.repeat([0, 1], [len(points), len(others)])
    found = refined_by_sightlines(seen(rise=0.173), every, eyes, index)
    assert found.rise == pytest.approx(RISE, abs=0.001)
    assert found.origin[2] == pytest.approx(RISE, abs=0.003)


def test_the_stamp_and_the_sides_stay() -> None:
    points = beams(EYE, RISE * np.arange(1, NUM + 1))
    observation = replace(seen(rise=0.175), stamp_ns=7)
    found = refined_by_sightlines(observation, points, EYE[None], np.zeros(len(points), dtype=np.int64))
    assert (found.stamp_ns, found.run, found.width) == (7, RUN, WIDTH)
    np.testing.assert_allclose(found.edges[0].nosing[:, 1], [WIDTH / 2, -WIDTH / 2])
