"""What up is made of, normal by normal: each weight and each limit with a case on either side."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.arrays import Float64Array, Vector
from stairmap.detection.inverse_depth import SurfaceNormals
from stairmap.detection.orientation import CorrectedUp, correct_up, estimate_up, find_headings, level_axes
from stairmap.geometry import angle_between, normalized
from stairmap.transforms import rotation_from_vector

UP, AHEAD, ASIDE = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
WIDE = np.radians(60.0)
"""A limit of corrections that holds nothing back, rad."""


def exact(*groups: tuple[Vector, int]) -> SurfaceNormals:
    """So many normals of each direction, without noise."""
    normals = np.concatenate([np.tile(axis, (num, 1)) for axis, num in groups]).astype(np.float32)
    num = len(normals)
    return SurfaceNormals(
        normals=normals,
        points=2.0 * normals,
        residual=np.full(num, 1e-4, np.float32),
        is_inner=np.ones(num, bool),
        noise=1e-4,
    )


def leaning(axis: Vector, degrees: float) -> Vector:
    """``axis`` turned about the optical axis."""
    return rotation_from_vector([0.0, 0.0, np.radians(degrees)]) @ axis


def correct(*groups: tuple[Vector, int], up: Vector = UP, std: float = 1.0) -> CorrectedUp:
    return correct_up(exact(*groups), up, max_correction=WIDE, std=std)


def lean_of_ground(*groups: tuple[Vector, int], up: Vector = UP) -> float:
    """By how much the ground's normal leans about the optical axis, degrees; NaN where up is kept."""
    found = correct(*groups, up=up)
    if found.std == 1.0:
        return float("nan")
    x, y, _ = found.ground
    return float(np.degrees(np.arctan2(x, -y)))


@pytest.mark.parametrize(("num", "lean"), [(1000, 1.0), (500, 2.0 / 3.0), (4000, 1.6)])
def test_ten_upright_normals_weigh_as_much_as_a_level_one(num: int, lean: float) -> None:
    # A hundred level ones: the ground lies between them and walls that lean by 2 degrees, by their weights.
    assert lean_of_ground((-UP, 100), (leaning(ASIDE, 2.0), num)) == pytest.approx(lean, abs=0.01)


@pytest.mark.parametrize(("lean", "is_level"), [(14.8, True), (15.2, False)])
def test_normals_within_15_degrees_of_the_given_up_are_level(lean: float, is_level: bool) -> None:
    found = lean_of_ground((leaning(-UP, lean), 200))
    assert found == pytest.approx(lean if is_level else np.nan, abs=0.01, nan_ok=True)


def test_then_normals_within_9_degrees_of_the_ground_are_level() -> None:
    # Both floors are level at first, 5.6 and 10.4 degrees off their mean; then only the larger one.
    floors = (leaning(-UP, 6.0), 650), (leaning(-UP, -10.0), 350)
    assert lean_of_ground(*floors) == pytest.approx(6.0, abs=0.01)
    # 5.3 and 8.7 degrees off: both once more, and then neither.
    assert np.isnan(lean_of_ground((leaning(-UP, 5.3), 621), (leaning(-UP, -8.7), 379)))


@pytest.mark.parametrize(("lean", "is_level"), [(5.4, True), (5.8, False)])
def test_at_last_normals_within_5_degrees_of_the_ground_are_level(lean: float, is_level: bool) -> None:
    # Of eleven one leans: the ground leans by an eleventh of it before the last round.
    found = lean_of_ground((-UP, 1000), (leaning(-UP, lean), 100))
    assert found == pytest.approx(lean / 11 if is_level else 0.0, abs=0.01)


@pytest.mark.parametrize(("lean", "found"), [(9.4, 0.375 * 9.4), (9.8, 0.0), (10.2, 0.0)])
def test_walls_within_10_8_and_6_degrees_of_upright_have_a_say(lean: float, found: float) -> None:
    # Of 160 weights 60: at first 9.4 degrees off, then 5.9; of 9.8 degrees 6.1 are left, which is too much.
    ground = lean_of_ground((-UP, 100), (leaning(ASIDE, lean), 600))
    assert ground == pytest.approx(found, abs=0.05)


def test_walls_that_lean_by_more_than_10_degrees_have_no_say_however_many_they_are() -> None:
    assert lean_of_ground((-UP, 100), (leaning(ASIDE, 10.3), 850)) == pytest.approx(0.0, abs=0.01)
    assert lean_of_ground((-UP, 100), (leaning(ASIDE, 9.8), 850)) == pytest.approx(0.459 * 9.8, abs=0.05)


def test_walls_that_lean_by_7_degrees_have_no_say_at_last() -> None:
    assert lean_of_ground((-UP, 100), (leaning(ASIDE, 6.8), 100)) == pytest.approx(0.0, abs=0.01)
    assert lean_of_ground((-UP, 100), (leaning(ASIDE, 6.4), 100)) == pytest.approx(6.4 / 11, abs=0.01)


@pytest.mark.parametrize("azimuth_deg", [20.0, 45.0, 110.0, 160.0])
@pytest.mark.parametrize("std_deg", [0.4, 2.0])
def test_from_whichever_side_a_wall_is_seen_it_holds_up_alike(azimuth_deg: float, std_deg: float) -> None:
    def turn_of_up(turned_by: float) -> Vector:
        about = rotation_from_vector(-np.radians(turned_by) * UP)
        wall, ground = about @ leaning(ASIDE, 0.7), about @ rotation_from_vector([0.012, 0.0, 0.02]) @ -UP
        found = correct((ground, 800), (wall, 600), std=np.radians(std_deg))
        return about.T @ np.array([*found.up, found.std])[:3] + found.std

    np.testing.assert_allclose(turn_of_up(azimuth_deg), turn_of_up(0.0), atol=1e-6)


def test_two_walls_at_an_angle_hold_up_as_bayes_rule_says() -> None:
    # All that is told of up's two turns, on a grid.
    std, num_walls, num_level = np.radians(1.0), 500, 300
    sample = np.radians(1.5) ** 2 * 15.0
    walls = [normalized([1.0, 0.02, 0.3]), normalized([0.4, -0.015, 1.0])]
    ground = rotation_from_vector([0.01, 0.0, 0.015]) @ -UP
    found = correct((ground, num_level), *((wall, num_walls) for wall in walls), std=std)
    x, z = np.meshgrid(*[np.linspace(-0.06, 0.06, 601)] * 2, indexing="ij")
    level = -found.ground[[0, 2]] / found.ground[1]
    scatter = sum(num_walls * np.outer(wall, wall) for wall in walls)
    up = np.stack([x, -np.ones_like(x), z])
    # A degree is common to all walls: together they know no more than that.
    told = 1.0 + (scatter[0, 0] + scatter[2, 2]) / sample * np.radians(1.0) ** 2
    against = np.einsum("iab,ij,jab->ab", up, scatter, up) / sample / told
    density = np.zeros_like(x)
    for share, slope in ((0.85, np.radians(0.15)), (0.15, np.radians(1.2))):
        variance = sample / num_level + slope**2
        apart = (x - level[0]) ** 2 + (z - level[1]) ** 2
        density += share / variance * np.exp(-0.5 * apart / variance)
    density *= np.exp(-0.5 * (x**2 + z**2) / std**2 - 0.5 * against)
    density /= density.sum()
    mean = np.array([(density * axis).sum() for axis in (x, z)])
    spread: Float64Array = density * ((x - mean[0]) ** 2 + (z - mean[1]) ** 2)
    np.testing.assert_allclose(found.up[[0, 2]] / -found.up[1], mean, atol=5e-5)
    assert found.std == pytest.approx(np.sqrt(0.5 * spread.sum()), rel=0.02)


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], ids=["nodding", "rolled"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_floor_whose_normals_scatter_over_9_degrees_is_larger_than_one_that_is_exact(
    axis: list[float], sign: float
) -> None:
    # Cells are 3 degrees wide: neighbouring ones count together.
    spread = [
        (rotation_from_vector(np.radians(sign * 20.0 + lean) * np.array(axis)) @ -UP, 300)
        for lean in (-3.0, 0.0, 3.0)
    ]
    other = rotation_from_vector(-np.radians(sign * 20.0) * np.array(axis)) @ -UP
    found = estimate_up(exact(*spread, (other, 700)))
    assert found is not None
    middle = rotation_from_vector(np.radians(sign * 20.0) * np.array(axis)) @ UP
    assert np.degrees(angle_between(found, middle)) < 0.5


@pytest.mark.parametrize(("pitch_deg", "is_found"), [(55.0, True), (62.0, False)])
@pytest.mark.parametrize("roll_deg", [0.0, 12.0])
def test_a_floor_may_be_pitched_by_60_degrees(pitch_deg: float, is_found: bool, roll_deg: float) -> None:
    turn = rotation_from_vector([0, 0, np.radians(roll_deg)]) @ rotation_from_vector(
        [np.radians(pitch_deg), 0, 0]
    )
    found = estimate_up(exact((turn @ -UP, 500)))
    assert (found is not None) == is_found
    if found is not None:
        assert np.degrees(angle_between(found, turn @ UP)) < 0.1


@pytest.mark.parametrize(("limit", "is_found"), [(31, True), (29, False)])
def test_a_floor_has_30_normals(limit: int, is_found: bool) -> None:
    assert (estimate_up(exact((-UP, limit))) is not None) == is_found


@pytest.mark.parametrize(("lean_deg", "num", "is_found"), [(34, 50, True), (36, 50, False), (36, 110, True)])
def test_a_floor_beyond_35_degrees_takes_a_tenth_of_the_frame(
    lean_deg: float, num: int, is_found: bool
) -> None:
    floor = rotation_from_vector([np.radians(lean_deg), 0.0, 0.0]) @ -UP
    assert (estimate_up(exact((floor, num), (AHEAD, 1000 - num))) is not None) == is_found


@pytest.mark.parametrize(("tilt", "mean_deg"), [(4.6, 4.6 / 6), (6.2, 0.0)])
def test_at_last_a_floors_normals_lie_within_5_degrees(tilt: float, mean_deg: float) -> None:
    tilted = rotation_from_vector([np.radians(tilt), 0.0, 0.0]) @ -UP
    found = estimate_up(exact((-UP, 500), (tilted, 100)))
    assert found is not None
    assert np.degrees(angle_between(found, UP)) == pytest.approx(mean_deg, abs=0.05)


@pytest.mark.parametrize(("z", "is_forward"), [(0.94, True), (-0.94, True), (0.96, False), (-0.96, False)])
def test_a_camera_within_18_degrees_of_the_vertical_heads_where_its_top_points(
    z: float, is_forward: bool
) -> None:
    up = np.array([0.0, -np.sqrt(1 - z * z), z])
    ahead, left = level_axes(up)
    axis = np.array([0.0, 0.0, 1.0]) if is_forward else np.array([0.0, -1.0, 0.0])
    np.testing.assert_allclose(ahead, normalized(axis - (axis @ up) * up))
    np.testing.assert_allclose(left, np.cross(up, ahead))


@pytest.mark.parametrize(("num", "is_found"), [(21, True), (19, False)])
def test_twenty_upright_normals_tell_a_heading(num: int, is_found: bool) -> None:
    assert bool(find_headings(exact((AHEAD, num)), UP, max_headings=2)) == is_found


@pytest.mark.parametrize(("apart_deg", "num"), [(7.4, 2), (9.0, 1)])
def test_normals_within_8_degrees_of_a_peak_are_of_its_heading(apart_deg: float, num: int) -> None:
    # In the middle of a bin of 5 degrees, and so far from it.
    axes = [rotation_from_vector(np.radians(angle) * UP) @ AHEAD for angle in (2.5, 2.5 + apart_deg)]
    surfaces = exact((axes[0], 200), (axes[1], 100))
    surfaces.points[200:] *= 2.0
    (heading,) = find_headings(surfaces, UP, max_headings=6)
    assert np.degrees(heading.angle) == pytest.approx(2.5, abs=0.01)
    assert heading.num_distances == num


@pytest.mark.parametrize(("spacing", "num"), [(0.09, 6), (0.03, 3)])
def test_distances_are_told_apart_by_8_cm(spacing: float, num: int) -> None:
    surfaces = exact((AHEAD, 300))
    surfaces.points[:] = (1.0 + spacing * (np.arange(300) % 6))[:, None] * surfaces.normals
    (heading,) = find_headings(surfaces, UP, max_headings=1)
    assert abs(heading.num_distances - num) <= (0 if num == 6 else 1)


@pytest.mark.parametrize(("num_each", "num"), [(4, 1 + 5), (3, 1)])
def test_more_than_three_normals_stand_at_a_distance(num_each: int, num: int) -> None:
    surfaces = exact((AHEAD, 100 + 5 * num_each))
    distance = np.full(len(surfaces.points), 1.02)
    distance[100:] = 1.5 + 0.4 * (np.arange(5 * num_each) % 5)
    surfaces.points[:] = distance[:, None] * surfaces.normals
    assert find_headings(surfaces, UP, max_headings=1)[0].num_distances == num


@pytest.mark.parametrize(("distance", "num"), [(7.0, 2), (8.1, 1)])
def test_distances_are_told_apart_up_to_8_m(distance: float, num: int) -> None:
    surfaces = exact((AHEAD, 200))
    surfaces.points[:] = (distance + 0.9 * (np.arange(200) % 2))[:, None] * surfaces.normals
    assert find_headings(surfaces, UP, max_headings=1)[0].num_distances == num
