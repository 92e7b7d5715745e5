"""Each limit of the judgement of single frames, from either side."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from frame_observations import SHAPE, all_in_view, make_view_of, observe

from stairmap.evaluation.frame_judging import FrameJudgement, is_clear_view, judge_frame, true_view_sign
from stairmap.simulation.kind_scenes import make_sloping_scene
from stairmap.simulation.views import StepsInView, View
from stairmap.transforms import rotation_from_vector

VIEW = make_view_of()


def judge(seen_from: View = VIEW, **changes: Any) -> FrameJudgement:
    return judge_frame(3, seen_from, all_in_view(), [observe(seen_from, **changes)])


def covariance(rise_std: float) -> np.ndarray:
    return np.diag([rise_std**2, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6])


def test_a_perfect_observation_is_right_without_error() -> None:
    judgement = judge()
    assert judgement.is_clear and judgement.is_found and judgement.is_right and not judgement.is_missed
    assert (judgement.num_false, judgement.num_duplicates, judgement.index) == (0, 0, 3)
    assert (judgement.kind, judgement.group, judgement.sensor, judgement.width) == (
        "overhang", "30 mm", "kinect_v1", 320,
    )  # fmt: skip
    errors = judgement.errors
    assert errors is not None
    np.testing.assert_allclose(
        [errors.rise, errors.run, errors.overhang, *errors.riser_heights], 0, atol=1e-9
    )
    assert (errors.rise_std, errors.run_std, errors.overhang_std) == pytest.approx((0.001, 0.002, 0.003))
    assert errors.riser_stds == pytest.approx([np.hypot(0.003, 0.003)] * 4)


@pytest.mark.parametrize(
    ("rise_std", "error", "is_right"),
    [
        (0.001, 0.0059, True),
        (0.001, -0.0061, False),
        (0.003, 0.0089, True),
        (0.003, -0.0091, False),
        (0.020, -0.0099, True),
        (0.020, 0.0101, False),
    ],
)
def test_a_right_rise_is_within_six_millimetres_or_three_deviations_and_within_ten(
    rise_std: float, error: float, is_right: bool
) -> None:
    judgement = judge(rise=SHAPE.rise + error, covariance=covariance(rise_std))
    assert judgement.is_found and judgement.is_right == is_right


def test_without_a_stated_deviation_a_right_rise_is_within_six_millimetres() -> None:
    for error, is_right in ((0.0059, True), (0.0061, False)):
        assert judge(rise=SHAPE.rise + error, covariance=np.zeros((0, 0))).is_right == is_right


@pytest.mark.parametrize(("error", "is_right"), [(0.0099, True), (-0.0101, False)])
def test_a_right_run_is_within_ten_millimetres(error: float, is_right: bool) -> None:
    assert judge(run=SHAPE.run + error).is_right == is_right


def test_the_wrong_view_is_found_but_not_right() -> None:
    judgement = judge(view="descending")
    assert judgement.is_found and not judgement.is_view_right and not judgement.is_right


@pytest.mark.parametrize(("degrees", "is_right"), [(24, True), (26, False)])
def test_a_heading_beyond_the_matching_limit_is_not_right(degrees: float, is_right: bool) -> None:
    pose = VIEW.map_from_camera
    forward = pose[:3, :3].T @ rotation_from_vector([0, 0, np.radians(degrees)]) @ [1.0, 0.0, 0.0]
    assert judge(forward=forward).is_right == is_right


def test_looking_down_the_flight_is_a_view_from_above() -> None:
    turned = replace(VIEW, map_from_camera=VIEW.map_from_camera @ np.diag([-1.0, 1.0, -1.0, 1.0]))
    assert (true_view_sign(VIEW), true_view_sign(turned)) == (1, -1)


def renumbered(numbers: list[int]) -> tuple[Any, ...]:
    edges = observe(VIEW, num=len(numbers)).edges
    return tuple(replace(edge, step_index=number) for edge, number in zip(edges, numbers, strict=True))


def test_step_numbers_must_keep_their_distances() -> None:
    assert judge(edges=(*observe(VIEW).edges[:2], *observe(VIEW).edges[3:])).are_steps_right
    for numbers in ([0, 1, 3, 4], [0, 1, 1, 2]):
        judgement = judge(edges=renumbered(numbers))
        assert judgement.is_found and not judgement.are_steps_right and not judgement.is_right


def test_who_saw_the_floor_must_begin_with_the_first_step() -> None:
    assert judge(first=2, floor_seen=False).is_right
    assert not judge(first=2, floor_seen=True).are_steps_right
    assert judge_frame(
        0, replace(VIEW, ends_are_known=False), all_in_view(), [observe(VIEW, first=2, floor_seen=True)]
    ).is_right


@pytest.mark.parametrize(("share", "is_right"), [(0.39, True), (0.41, False)])
def test_an_edge_lies_on_its_true_nosing(share: float, is_right: bool) -> None:
    judgement = judge(lift={1: share * SHAPE.rise})
    assert judgement.is_found and judgement.are_steps_right == is_right


def test_nosings_that_slope_sideways_are_met_where_the_edges_middle_is() -> None:
    shape = replace(SHAPE, width=4.0)
    scene = make_sloping_scene("test", shape, np.random.default_rng(0), along=0.0, across=0.04)
    view = make_view_of(scene=scene)
    edges = observe(view).edges
    # The image cuts the right half off: the middles lie 1 m to the left, 40 mm higher.
    cut = [replace(edge, nosing=[edge.nosing[0], edge.nosing.mean(axis=0)]) for edge in edges]
    assert judge(view, edges=tuple(cut)).is_right


def test_a_step_that_is_not_there_is_wrong_and_a_spare_one_is_not() -> None:
    flight = VIEW.flight
    assert flight is not None
    before = flight.steps[0].nosing - [SHAPE.run, 0.0, SHAPE.rise]
    pose = VIEW.map_from_camera
    edges = observe(VIEW).edges
    ghost = replace(edges[0], nosing=(before - pose[:3, 3]) @ pose[:3, :3], step_index=-1)
    assert not judge(edges=(ghost, *edges), floor_seen=False).are_steps_right
    spare = replace(VIEW, spare_below=before[None])
    assert judge_frame(
        0, spare, all_in_view(), [observe(VIEW, edges=(ghost, *edges), floor_seen=False)]
    ).is_right


def test_an_irregular_flight_is_held_against_the_steps_that_were_seen() -> None:
    view = make_view_of(replace(SHAPE, odd_risers=((6, 0.05),)))
    assert judge(view, rise=0.17).errors.rise == pytest.approx(0.0)  # type: ignore[union-attr]
    assert judge(view, first=3, rise=0.17).errors.rise == pytest.approx(-0.05 / 4)  # type: ignore[union-attr]


def test_an_overhang_without_a_deviation_was_not_measured() -> None:
    assert judge(overhang=0.025).errors.overhang == pytest.approx(-0.005)  # type: ignore[union-attr]
    assert np.isnan(judge(overhang=0.0, overhang_std=float("nan")).errors.overhang)  # type: ignore[union-attr]


def test_single_risers_are_judged_between_neighbours() -> None:
    errors = judge(lift={2: 0.004}).errors
    assert errors is not None
    np.testing.assert_allclose(errors.riser_heights, [0, 0.004, -0.004, 0], atol=1e-9)
    assert errors.largest_oddness == pytest.approx(0.004)
    gap = judge(edges=(*observe(VIEW).edges[:2], *observe(VIEW).edges[3:])).errors
    assert gap is not None and len(gap.riser_heights) == 2
    assert np.isnan(gap.largest_oddness)


def test_only_irregular_views_say_whether_a_riser_is_odd() -> None:
    assert judge().has_odd_riser is None
    for group, expected in (("regular", False), ("one riser odd", True)):
        assert judge(replace(VIEW, kind="irregular", group=group)).has_odd_riser is expected


def test_the_top_nosing_is_found_when_it_is_among_the_edges() -> None:
    assert judge().shows_top and not judge().is_top_found
    assert judge(first=3).is_top_found and not judge(first=2, floor_seen=False).is_top_found
    hidden = replace(all_in_view(), riser_rows=np.append(np.full(7, 10.0), 4.9))
    assert not judge_frame(0, VIEW, hidden, [observe(VIEW)]).shows_top


def test_what_is_elsewhere_is_false_and_a_second_one_a_duplicate() -> None:
    elsewhere = observe(VIEW)
    moved = replace(
        elsewhere,
        edges=tuple(replace(edge, nosing=edge.nosing + np.array([2.5, 0, 0])) for edge in elsewhere.edges),
    )
    judgement = judge_frame(0, VIEW, all_in_view(), [moved, observe(VIEW), observe(VIEW)])
    assert (judgement.num_false, judgement.num_duplicates, judgement.is_right) == (1, 1, True)
    nothing = replace(VIEW, scene=replace(VIEW.scene, stairways=()))
    judgement = judge_frame(0, nothing, None, [observe(VIEW)])
    assert (judgement.num_false, judgement.is_clear, judgement.is_found) == (1, False, False)


def test_nothing_found_in_a_clear_view_is_missed() -> None:
    assert judge_frame(0, VIEW, all_in_view(), []).is_missed
    unclear = replace(all_in_view(), riser_rows=np.full(8, 4.9))
    assert not judge_frame(0, VIEW, unclear, []).is_missed


def steps_with(**rows: Any) -> StepsInView:
    values = {"tread_rows": np.zeros(4), "riser_rows": np.zeros(4), "riser_sigmas": np.zeros(4)}
    return StepsInView(**{**values, **{name: np.array(value) for name, value in rows.items()}})


def test_a_view_is_clear_when_three_steps_cover_five_rows() -> None:
    assert is_clear_view(VIEW, steps_with(riser_rows=[5.0, 5.0, 5.0, 0.0]))
    assert not is_clear_view(VIEW, steps_with(riser_rows=[5.0, 5.0, 4.9, 0.0]))
    assert not is_clear_view(VIEW, steps_with(tread_rows=[9.0, 9.0, 9.0, 9.0]))
    down = replace(VIEW, map_from_camera=VIEW.map_from_camera @ np.diag([-1.0, 1.0, -1.0, 1.0]))
    assert is_clear_view(down, steps_with(tread_rows=[0.0, 5.0, 5.0, 5.0]))
    assert not is_clear_view(down, steps_with(riser_rows=[9.0, 9.0, 9.0, 9.0]))


def test_far_stairs_are_clear_by_rows_and_sigmas() -> None:
    far = replace(VIEW, kind="far")
    for rows, sigmas, expected in ((8.0, 5.0, True), (7.9, 5.0, False), (8.0, 4.9, False)):
        seen = steps_with(riser_rows=[rows] * 3 + [0.0], riser_sigmas=[sigmas] * 3 + [0.0])
        assert is_clear_view(far, seen) == expected


def test_a_judgement_is_json_without_nan() -> None:
    data = json.loads(json.dumps(judge(overhang_std=float("nan")).to_dict(), allow_nan=False))
    assert data["errors"]["overhang"] is None and data["is_right"] is True
