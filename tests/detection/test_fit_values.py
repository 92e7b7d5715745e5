"""What a fit makes of a few hard views, in numbers: who changes a prior on purpose writes them anew.

Each view leans on priors and limits that exact rays of regular stairs never need: up that is unsure over
ground that slopes, built irregularity, rays that met something else, a sensor that blends edges.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from profile_rays import NOISE, OPTICS, changed, make_descending, make_profile, measure
from stairmap.detection.fit import FittedProfile, fit_profile

IRREGULAR = np.array([2.0, -5.0, 4.0, 9.0, -3.0, 14.0, -4.0, 6.0, -11.0, 5.0, 3.0]) / 1000.0
"""Offsets of five nosings and of the six levels, m."""


def sloping() -> FittedProfile | None:
    """Ground that climbs, treads that drain, seen with an up that is off by as much."""
    true = make_profile(ground=0.025, slope=-0.01, overhang=0.015)
    rays = measure(true, noise=0.003).turned(0.015, -0.01, 0.03)
    return fit_profile(rays, make_profile(), noise=0.003, optics=OPTICS, up_std=np.radians(1.0))


def irregular() -> FittedProfile | None:
    """A flight built worse than most."""
    rays = measure(make_profile(offsets=IRREGULAR, rake=0.02), noise=0.004, seed=1)
    return fit_profile(rays, make_profile(), noise=0.004, optics=OPTICS, up_std=np.radians(0.4))


def half_hidden() -> FittedProfile | None:
    """Rays of which a third met something nearer, and a floor and a wall that are not the stairs'."""
    rays = measure(make_profile(), noise=0.002, seed=2, slopes=(-3.0, 0.5))
    random = np.random.default_rng(3)
    nearer = rays.inverse_distance + random.uniform(0.01, 0.06, len(rays.slope))
    rays = changed(rays, random.random(len(rays.slope)) < 0.33, nearer)
    rays = changed(rays, rays.slope < -1.3, 1.15)
    rays = changed(rays, rays.slope > -0.04, 0.45)
    return fit_profile(rays, make_profile(distance=1.21), noise=0.0005, optics=OPTICS, up_std=np.radians(0.4))


def leaning_over() -> FittedProfile | None:
    """Risers that hang over, before a low camera whose sensor shifts edges."""
    true = make_profile(height=-0.35, rake=-0.03)
    rays = measure(true, noise=0.002, seed=4, optics=replace(OPTICS, shift=1.2))
    return fit_profile(rays, make_profile(height=-0.35), noise=0.002, optics=OPTICS, up_std=np.radians(0.4))


def open_slabs() -> FittedProfile | None:
    """Slabs that are thicker than most, through a sensor that blends three rows."""
    optics = replace(OPTICS, smoothing=1.5)
    true = make_profile(is_open=True, thickness=0.05, overhang=0.02)
    start = make_profile(is_open=True)
    rays = measure(true, noise=0.003, seed=5, optics=optics)
    return fit_profile(rays, start, noise=0.003, optics=optics, up_std=np.radians(0.4))


def going_on() -> FittedProfile | None:
    """The second of two fits, which begins where a coarse one of fewer steps ended."""
    true = make_profile(offsets=0.5 * IRREGULAR)
    rays = measure(true, noise=0.003, seed=6).turned(-0.01, 0.0, 0.02)
    start = make_profile(num_steps=3)
    how = {"noise": 0.003, "optics": OPTICS, "up_std": np.radians(1.0)}
    coarse = fit_profile(rays, start, is_coarse=True, **how)
    assert coarse is not None
    return fit_profile(rays, coarse.profile.with_steps(0, 2), around=coarse, **how)


def descending() -> FittedProfile | None:
    """Treads seen from above, with an up that is off."""
    rays = measure(make_descending(), noise=0.002, seed=7).turned(0.003, 0.004, -0.01)
    return fit_profile(rays, make_descending(), noise=NOISE, optics=OPTICS, up_std=np.radians(1.0))


def measures(found: FittedProfile) -> tuple[list[float], list[float]]:
    """Lengths, mm, and angles, mrad; then standard deviations, the noise and the cost."""
    profile = found.profile
    lengths = [
        profile.rise,
        profile.run,
        profile.distance,
        profile.height,
        profile.overhang,
        profile.thickness,
    ]
    angles = [profile.rake, profile.ground, profile.slope, found.tilt, found.roll, found.turn]
    own = [*np.abs(profile.offsets[[1, 3, -6, -3]])]
    std = np.sqrt(np.diag(found.covariance))
    return (
        [round(1e3 * float(value), 2) for value in (*lengths, *angles, *own, found.optics.shift)],
        [
            float(f"{value:.4g}")
            for value in (*(1e3 * std), 1e3 * found.overhang_std, *(1e3 * found.step_std[[0, -1]].ravel()),
                          1e3 * found.noise, found.cost)
        ],
    )  # fmt: skip


VALUES = {
    sloping: (
        [
            169.89,
            280.19,
            1201.48,
            -831.29,
            14.82,
            35.23,
            -0.31,
            22.38,
            -6.73,
            -15.42,
            10.32,
            -29.7,
            0.24,
            0.19,
            0.24,
            0.04,
            0.0,
        ],
        [1.734, 1.584, 4.783, 5.154, 3.038, 1.634, 1.588, 3.91, 3.842, 3.955, 3.862, 3.012, 3752.0],
    ),
    irregular: (
        [
            170.71,
            279.57,
            1201.66,
            -833.52,
            0.52,
            34.56,
            6.94,
            -0.42,
            -0.01,
            -0.85,
            -0.08,
            0.92,
            4.61,
            2.84,
            17.5,
            9.41,
            0.0,
        ],
        [2.174, 1.857, 5.477, 6.106, 3.785, 2.207, 2.261, 4.27, 4.487, 4.288, 4.321, 4.101, 4977.0],
    ),
    half_hidden: (
        [
            169.38,
            280.37,
            1197.44,
            -833.95,
            -0.24,
            35.21,
            -0.7,
            -2.0,
            0.31,
            -3.03,
            0.01,
            -0.77,
            0.44,
            0.08,
            0.68,
            0.07,
            0.0,
        ],
        [2.03, 1.669, 5.562, 6.476, 4.542, 1.638, 1.605, 3.912, 3.853, 3.951, 3.878, 2.525, 6949.0],
    ),
    leaning_over: (
        [
            170.61,
            278.78,
            1202.54,
            -341.09,
            -2.21,
            38.58,
            -2.78,
            6.58,
            1.75,
            6.78,
            -0.02,
            -1.34,
            0.36,
            0.61,
            1.94,
            1.29,
            1275.99,
        ],
        [2.431, 1.585, 4.164, 6.003, 3.766, 1.031, 1.326, 3.887, 3.934, 3.922, 4.092, 1.841, 2030.0],
    ),
    open_slabs: (
        [
            169.83,
            281.17,
            1196.53,
            -833.7,
            0.0,
            44.86,
            0.0,
            -4.49,
            2.48,
            -2.55,
            -0.32,
            -0.4,
            0.33,
            0.02,
            1.41,
            0.9,
            -1341.59,
        ],
        [1.469, 2.614, 4.269, 3.954, 0.7296, 1.67, 30.16, 4.098, 3.866, 4.136, 3.927, 1.977, 3233.0],
    ),
    going_on: (
        [
            169.16,
            281.05,
            1196.88,
            -837.14,
            -0.37,
            32.88,
            -0.17,
            -2.94,
            -2.57,
            5.04,
            0.33,
            -20.56,
            2.53,
            1.29,
            8.35,
            4.56,
            0.0,
        ],
        [2.328, 1.799, 6.123, 7.346, 5.308, 1.598, 1.601, 4.046, 4.18, 4.059, 4.132, 2.958, 3764.0],
    ),
    descending: (
        [
            168.89,
            -280.74,
            1726.33,
            -1573.28,
            0.0,
            35.0,
            0.0,
            -4.54,
            -0.65,
            0.9,
            -3.61,
            8.99,
            0.01,
            0.08,
            0.56,
            0.0,
            -9.65,
        ],
        [3.971, 3.679, 24.84, 23.25, 13.29, 1.885, 30.0, 3.915, 3.845, 3.887, 3.826, 2.026, 1273.0],
    ),
}
"""Of each view what ``measures`` returns."""


@pytest.mark.parametrize("view", VALUES, ids=lambda view: view.__name__)
def test_a_hard_view_gives_the_measures_and_the_deviations_it_gave(
    view: Callable[[], FittedProfile | None],
) -> None:
    found = view()
    assert found is not None
    values, stds = measures(found)
    np.testing.assert_allclose(values, VALUES[view][0], rtol=1e-3, atol=0.05)
    np.testing.assert_allclose(stds, VALUES[view][1], rtol=5e-3)
