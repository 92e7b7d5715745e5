"""Stairs by a LiDAR near the floor: it sees risers and no treads, the upper risers in part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stairmap.clouds.detector import detect_points
from stairmap.config import Config
from stairmap.sweep_session import detect_in_window
from stairmap.sweep_window import SweepWindow

UP = np.array([0.0, 0.0, 1.0])
RISE, RUN, WIDTH = 0.17, 0.28, 1.2
EYE = np.array([-2.0, 0.0, 0.3])
NOISE = 0.015


def first_hits(num_steps: int, *, wall: float, num: int, lowest: float = -0.12) -> np.ndarray:
    """Points that beams from ``EYE`` meet: the floor, risers, treads below the eye, and a wall behind."""
    random = np.random.default_rng(3)
    slope, side = random.uniform(lowest, 0.7, num), random.uniform(-0.4, 0.4, num)
    end = np.full(num, wall)
    for step in range(num_steps - 1, -1, -1):
        at = EYE[2] + slope * (step * RUN - EYE[0])
        across = side * (step * RUN - EYE[0])
        is_on = (at > step * RISE) & (at < (step + 1) * RISE) & (np.abs(across) < WIDTH / 2)
        end = np.where(is_on, step * RUN, end)
    falling = np.minimum(slope, -1e-9)
    end = np.minimum(end, np.where(slope < 0, EYE[0] - EYE[2] / falling, np.inf))
    length = end - EYE[0]
    points = EYE + np.column_stack([length, side * length, slope * length])
    away = (points - EYE) / np.linalg.norm(points - EYE, axis=1)[:, None]
    return np.asarray(points + NOISE * random.standard_normal((num, 1)) * away)


@pytest.mark.parametrize("num_steps", [6, 12])
def test_steps_are_counted_and_measured_by_their_risers_alone(num_steps: int) -> None:
    points = first_hits(num_steps, wall=6.0, num=25_000)

    (seen,) = detect_points(points, up=UP, noise=NOISE).observations

    assert seen.num_steps == num_steps
    assert seen.rise == pytest.approx(RISE, abs=0.002)
    assert seen.run == pytest.approx(RUN, abs=0.002)
    assert np.sqrt(seen.covariance[0, 0]) < 0.003


def test_beams_that_go_on_far_behind_the_last_nosing_tell_how_high_it_is() -> None:
    points = first_hits(3, wall=9.0, num=30_000)
    is_far = points[:, 0] > 8.0
    window = SweepWindow(
        stamp_ns=0,
        map_from_sensor=np.eye(4),
        points=points[~is_far],
        viewpoints=EYE[None],
        view_index=np.zeros(np.count_nonzero(~is_far), dtype=np.int64),
        far_points=points[is_far],
        far_view_index=np.zeros(np.count_nonzero(is_far), dtype=np.int64),
        up=UP,
        noise=NOISE,
    )
    blind = replace(window, far_points=np.zeros((0, 3)), far_view_index=np.zeros(0, dtype=np.int64))

    (with_far,) = detect_in_window(window, Config()).observations
    (without,) = detect_in_window(blind, Config()).observations

    assert with_far.edges[-1].std[1] < 0.6 * without.edges[-1].std[1]
    assert with_far.edges[-1].nosing[:, 2].mean() == pytest.approx(3 * RISE, abs=0.004)
