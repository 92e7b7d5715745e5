"""Kernels on arrays that no detector makes: both variants agree there too, and read nothing beyond."""

from __future__ import annotations

import warnings
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_twins import assert_alike

from stairmap.kernels import (
    choice,
    corners,
    counts,
    equations,
    grounds,
    images,
    lattices,
    normals,
    outlines,
    planes,
    predictions,
    row_ends,
    sampling,
    section_fits,
    step_counts,
)

VIEW = sampling.SamplingView(60.0, 60.0, 20.0, 15.0, 0.03, 1e-3)
SEEDS = st.integers(0, 2**32 - 1)
SIZES = st.tuples(st.integers(1, 40), st.integers(1, 48))


@pytest.fixture(scope="module")
def compiled() -> ModuleType:
    try:
        return choice.load_compiled()
    except ImportError:
        pytest.skip("the compiled kernels were not built: make kernels")


def compare(compiled: ModuleType, twin: Any, *arguments: Any) -> None:
    """Call both; they say the same, or refuse the same."""
    mine, other = (outcome(kernel, arguments) for kernel in (getattr(compiled, twin.__name__), twin))
    assert_alike(mine, other, twin.__name__)


def outcome(kernel: Any, arguments: tuple[Any, ...]) -> Any:
    """What a kernel returns, or the words with which it refuses."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            return kernel(*arguments)
    except ValueError as refusal:
        return str(refusal)


def scans(random: np.random.Generator, size: tuple[int, int]) -> np.ndarray:
    """Inverse distances in steps, with holes."""
    q = np.repeat(random.uniform(0.1, 2.0, (size[0] // 5 + 1, size[1])), 5, axis=0)[: size[0]]
    q += random.normal(0, 0.01, q.shape)
    q[random.random(q.shape) < 0.2] = 0.0
    return np.ascontiguousarray(q)


def rotation(random: np.random.Generator) -> np.ndarray:
    """Three perpendicular unit vectors, any way round."""
    return np.ascontiguousarray(np.linalg.qr(random.normal(size=(3, 3)))[0])


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, size=SIZES, stride=st.integers(-1, 5))
def test_reduction_of_any_depth(compiled: ModuleType, seed: int, size: tuple[int, int], stride: int) -> None:
    random = np.random.default_rng(seed)
    depth = random.uniform(-1, 12, size).astype(np.float32)
    for value in (np.nan, np.inf, -np.inf, 0.0, 1e-12):
        depth[random.random(size) < 0.05] = value
    compare(compiled, images.reduce_depth, depth, stride, images.InverseRange(0.125, 1e3, 0.95))


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, size=SIZES, reach=st.integers(0, 4), far=st.integers(0, 9))
def test_jumps_of_any_image(
    compiled: ModuleType, seed: int, size: tuple[int, int], reach: int, far: int
) -> None:
    image = scans(np.random.default_rng(seed), size).astype(np.float32)
    compare(compiled, images.measure_jumps, image, images.JumpShape(2, reach, far, 0.05, 0.15))


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, size=SIZES)
def test_samples_of_any_heading(compiled: ModuleType, seed: int, size: tuple[int, int]) -> None:
    random = np.random.default_rng(seed)
    image = scans(random, size).astype(np.float32)
    slope, bearing = np.sort(random.uniform(-3, 3, 20)), np.sort(random.uniform(-3, 3, 24))[::-1].copy()
    slope[random.random(20) < 0.1] = np.nan
    axes = rotation(random)
    compare(compiled, sampling.sample_rays, image, axes, slope, bearing, VIEW)
    means = sampling.StripMeans(int(random.integers(1, 9)), 0.2, 2, 2)
    compare(compiled, sampling.sample_strips, image, axes, slope, bearing, VIEW, means)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, size=SIZES)
def test_corners_of_any_scans(compiled: ModuleType, seed: int, size: tuple[int, int]) -> None:
    random = np.random.default_rng(seed)
    q, slope = scans(random, size), np.linspace(-1.5, 1.0, size[0])
    rows = random.integers(1, 9, int(random.integers(1, 5)))
    jump = corners.JumpLimits(0.004, 0.25, 0.1, 0.005, 8, 0.02, 0.05)
    compare(compiled, corners.find_jumps, q, slope, rows, jump)
    weights = random.uniform(0.1, 1, 2 * int(random.integers(0, 5)) + 1).astype(np.float32)
    compare(compiled, sampling.sharpen_scans, q, weights / weights.sum(), 3, 0.8)
    crease = corners.CreaseLimits(0.004, 0.001, 0.06, 3, 10, 0.7, 0.5, 0.3, 1.0, 0.5, 2.6, -0.5)
    compare(compiled, corners.find_creases, q, slope, crease)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, number=st.integers(0, 40), num_strips=st.integers(1, 12))
def test_groups_and_lattices_of_any_corners(
    compiled: ModuleType, seed: int, number: int, num_strips: int
) -> None:
    random = np.random.default_rng(seed)
    places = random.uniform(0.5, 3, number), random.uniform(-1, 1, number)
    strip = random.integers(-1 if seed % 9 == 0 else 0, num_strips, number)
    join = lattices.JoinLimits(0.1, 0.05, 0.4, 0.3, int(random.integers(-1, 4)), int(random.integers(1, 3)))
    compare(compiled, lattices.join_corners, (*places, strip), num_strips, join)
    edges = corners.TurnLimits(3, 0.1, 0.05, 1.1, 36, 0.12, 2, 0.18)
    compare(compiled, corners.find_edge_turns, (*places, strip), random.uniform(-1, 1, num_strips), edges, 3)
    limits = lattices.LatticeLimits(
        0.1, 0.3, 0.1, 0.5, 0.1, 1.2, 3, 1, 0.05, 0.05, 0.002, 0.05, 0.15, 32, 12, 0.5, 2
    )  # fmt: skip
    strips = random.random((number, num_strips)) < 0.5
    compare(compiled, lattices.search_lattices, (*places, strips), limits, 3)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, size=SIZES)
def test_planes_and_normals_of_any_image(compiled: ModuleType, seed: int, size: tuple[int, int]) -> None:
    random = np.random.default_rng(seed)
    image = scans(random, (size[0], size[1])).astype(np.float32)
    image[random.random(image.shape) < 0.3] = 0.5
    windows = planes.PlaneWindows(9, 5, 30.0, 30.0, 10.0, 7.0, 0.5, 0.5, 0.1, 0.98)
    compare(compiled, planes.fit_window_planes, image, windows)
    number = size[0] * size[1]
    vectors = random.normal(size=(number, 3))
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    unit, points = vectors.astype(np.float32), (3 * random.normal(size=(number, 3))).astype(np.float32)
    axes = rotation(random)
    inner = random.random(number) < 0.5
    residual = random.random(number).astype(np.float32)
    level = normals.NormalLimits(0.7, -0.8, 0.3)
    compare(compiled, normals.sum_normals, unit, residual, inner, axes[0].copy(), level)
    compare(compiled, normals.count_floor_cells, unit, points, 0.1, 0.1, 40)
    facing = normals.FacingLimits(0.6, 5, 72, 6, 0.14, 1.4, 0.08, 100, 1)
    compare(compiled, normals.find_facing, unit, points, axes, facing)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, number=st.integers(0, 60), num_steps=st.integers(0, 5))
def test_counts_of_any_rays(compiled: ModuleType, seed: int, number: int, num_steps: int) -> None:
    random = np.random.default_rng(seed)
    rays = random.uniform(-1, 1, number), random.uniform(-1, 1, number), random.uniform(0, 2, number)
    rays[2][random.random(number) < 0.2] = 0.0
    size = int(random.integers(1, 30))
    table = (np.linspace(-0.8, 0.8, size), *(random.uniform(0.1, 2, size) for _ in range(5)))
    compare(compiled, counts.turn_rays, rays, 0.01, -0.02, 0.1)
    risers = counts.RiserLimits(-0.5, 0.2, 0.3, 0.0, 0.5, -1.5, 1.5)
    compare(compiled, counts.sum_risers, rays, np.arange(num_steps) * 0.3 + 0.5, risers)
    section = outlines.SectionLimits(0.1, 0.5, 1e-3, 1e-9, 0.004)
    edges = predictions.EdgeOptics(0.004, 0.0015, 0.2, 0.002, 0.1, 0.02, 6.0, 3.0)
    kinds = predictions.PieceKinds(outlines.BEHIND, outlines.TREAD, outlines.UNDERSIDE)
    shape = outlines.SectionShape(float(random.choice([-0.3, 0.3])), 0.01, 0.03, 0.01, 0.0, 0.0)
    nosings = 0.9 + 0.3 * np.arange(num_steps) * np.sign(shape.run) + 0.3 * num_steps * (shape.run < 0)
    heights = random.uniform(-1.5, -0.2) + 0.17 * np.arange(num_steps + 1)
    counted = step_counts.CountLimits(
        0.05, 0.01, 0.1, 3.0, 0.3, 0.03, 2, 1e-6, 1.5, 0.5, 0.8, 1e-3
    )  # fmt: skip
    args = rays, (nosings, heights), 0.17, shape, bool(random.random() < 0.3), edges, kinds, section
    compare(compiled, step_counts.count_steps, *args, counted)
    line = counts.LineLimits(-0.5, 0.5, -1.0, 1.0, 0.1, 0.004, 3.0, 4, 4, 1e-6)
    compare(compiled, counts.compare_with_line, rays, table, line)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, size=SIZES)
def test_ends_of_any_rows(compiled: ModuleType, seed: int, size: tuple[int, int]) -> None:
    random = np.random.default_rng(seed)
    cells = np.repeat(random.choice([0.0, 0.4, 0.5, 0.52, 0.8], (size[0], size[1] // 4 + 1)), 4, axis=1)
    cells = np.ascontiguousarray(cells[:, : size[1]], dtype=np.float32)
    rays = np.linspace(-0.5, 0.5, size[0]), np.linspace(0.4, -0.4, size[1]), np.linspace(0, 0.15, 10)
    entries = int(random.integers(1, 20))
    table = (
        np.linspace(-0.6, 0.6, entries), np.full(entries, 0.5), np.zeros(entries),
        *(np.ones(entries) for _ in range(3)),
    )  # fmt: skip
    steps = np.full(entries, 0.05), random.random(entries) < 0.8
    limits = row_ends.RowLimits(0.01, 0.0, 0.02, 0.2, 3, 0.06, 0.01, -0.05, 0.1, 0.3, 3, 0.25)
    compare(compiled, row_ends.find_row_ends, cells, rays, table, steps, limits)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, size=SIZES, is_known=st.booleans())
def test_ground_of_any_image(
    compiled: ModuleType, seed: int, size: tuple[int, int], *, is_known: bool
) -> None:
    random = np.random.default_rng(seed)
    slope, bearing = -np.sort(random.uniform(0.05, 1.5, size[0]))[::-1], random.uniform(-0.5, 0.5, 25)
    # A floor 0.6 m below a level camera, with a hole, noise, and pixels of something else.
    rows = (np.arange(size[0]) - 3.0) / 20.0
    image = np.repeat(np.maximum(rows / 0.6, 0.0)[:, None], size[1], axis=1).astype(np.float32)
    image *= random.choice([1.0, 0.99, 0.8, 0.0], image.shape, p=[0.6, 0.2, 0.1, 0.1]).astype(np.float32)
    axes = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]])
    camera = grounds.GroundCamera(20.0, 20.0, size[1] / 2, 3.0, 1e-3)
    limits = grounds.GroundLimits(
        0.1, 2.0, 0.02, 4, is_known, 0.25, 2, 2, 4.0, 1.5, 0.08, 0.05, 0.025, 0.012, 5.0, 0.3, 16, 0.25
    )
    compare(compiled, grounds.fit_ground, image, axes, slope, bearing, camera, limits)
    compare(compiled, grounds.fit_ground, image, rotation(random), slope, bearing, camera, limits)


@settings(max_examples=50, deadline=None)
@given(seed=SEEDS, size=SIZES)
def test_ledges_of_any_rays(compiled: ModuleType, seed: int, size: tuple[int, int]) -> None:
    random = np.random.default_rng(seed)
    crossing = np.sort(random.uniform(0.5, 3.0, size), axis=0).astype(np.float32)
    crossing[random.random(size) < 0.02] = np.inf
    height = np.zeros(size, dtype=np.float32)
    height[int(random.integers(0, size[0])) :] = -0.3
    height += random.normal(0, 0.03, size).astype(np.float32)
    height[random.random(size) < 0.1] = np.nan
    limits = grounds.LedgeLimits(
        0.05, 0.02, 4.0, 0.1, 0.04, 0.04, 8, 5, 6, 3, 3, 1.5, 3.5, 3, 0.7, 0.4, 0.05
    )  # fmt: skip
    compare(compiled, grounds.find_ledges, crossing, height, 0.6, limits)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, num_steps=st.integers(1, 7), direction=st.sampled_from([1.0, -1.0]), is_open=st.booleans())
def test_sections_of_any_rays(
    compiled: ModuleType, seed: int, num_steps: int, direction: float, *, is_open: bool
) -> None:
    random = np.random.default_rng(seed)
    height = -0.4 if direction > 0 else -1.5
    start = np.array([2.0, height, 0.28 * direction, 0.17, 0.0, 0.035, 0, 0, 0, 0.2, 0, 0, 0])
    start[[0, 1, 4, 6]] += random.normal(0, [0.02, 0.02, 0.01, 0.01])
    places = random.normal(0, 0.003, 2 * num_steps + 1)
    section = outlines.SectionLimits(0.1, 0.5, 1e-3, 1e-9, 0.004)
    edges = predictions.EdgeOptics(0.004, 0.0015, 0.2, 0.002, 0.1, 0.02, 6.0, 3.0)
    kinds = predictions.PieceKinds(outlines.BEHIND, outlines.TREAD, outlines.UNDERSIDE)
    distances, heights, shape = section_fits._section_of(start, places)
    slope = np.sort(random.uniform(-1.2, 0.6, 400))
    outline = outlines.trace_outline(distances, heights, shape, is_open and direction > 0, section)
    seen = predictions.predict_rays(outline, slope, edges, kinds, False)[2]
    q = seen + random.normal(0, 0.002, len(slope))
    q[random.random(len(q)) < 0.2] *= 1.3
    rays = slope, random.uniform(-0.4, 0.4, len(slope)), np.maximum(q, 1e-3)
    mean, std = np.zeros(13), np.full(13, np.inf)
    std[4:] = [0.03, 0.01, 0.02, 0.02, 0.01, 2.0, 0.01, 0.01, 0.1]
    counted = equations.EquationLimits(
        0.002, 1e-4, 0.04, 0.04, 0.1, 6.0, 40, 1.4826, 2.25e-6, 2.0, 6.0, 0.004
    )
    limits = section_fits.FitLimits(
        0.002, 100_000, 0.004, 0.008, 1.0, 0.006, 2.0, 0.004, 1.0, 0.9, 0.6, 2.0, 0.5, 0.43
    )
    rounds = np.array([0.03, 0.01, 0.0][: int(random.integers(1, 4))]), int(random.integers(0, 3)), 0.002
    args = (rays, (start, places), (mean, std), rounds, is_open and direction > 0)
    compare(compiled, section_fits.fit_section, *args, edges, kinds, section, counted, limits)
