"""What a frame shows becomes a candidate, and is rejected with what was measured and what the limit is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analytic_stairs import AnalyticStairs, pose_looking
from solid_scenes import FLOOR, frame_of, pose_towards, room, stairs_solid
from stairmap.arrays import Transform
from stairmap.config import Config
from stairmap.detection.candidate import Candidate
from stairmap.detection.detector import StairEdgeDetector
from stairmap.detection.observation import Detection, Rejection
from stairmap.frame import DepthFrame
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_block, make_turned_block, make_wall
from stairmap.transforms import rotation_from_vector

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=5)
POSE = pose_towards((0.6, 0.0, 0.5), distance=1.4, height=1.2)


def detect(
    *solids: TriangleMesh, pose: Transform = POSE, has_up: bool = True, **sections: dict[str, Any]
) -> Detection:
    frame = frame_of(solids, pose, has_up=has_up)
    return StairEdgeDetector(Config.model_validate(sections)).detect(frame)


def detect_stairs(**envelope: float) -> Detection:
    return detect(stairs_solid(STAIRS), room(), envelope=envelope)


def the_rejection(detection: Detection, rule: str) -> Rejection:
    assert not detection
    found = [rejection for rejection in detection.rejections if rejection.rule == rule]
    assert len(found) == 1, [str(rejection) for rejection in detection.rejections]
    return found[0]


def test_the_stairs_of_these_tests_are_accepted_without_a_rejection() -> None:
    detection = detect_stairs()
    assert len(detection.observations) == 1
    assert detection.rejections == ()


@pytest.mark.parametrize(
    ("rule", "limit", "measured", "unit"),
    [
        ("min_rise", 0.185, 0.17, "m"),
        ("max_rise", 0.16, 0.17, "m"),
        ("min_run", 0.30, 0.28, "m"),
        ("max_run", 0.26, 0.28, "m"),
        ("min_pitch_deg", 33.5, 31.26, "deg"),
        ("max_pitch_deg", 29.0, 31.26, "deg"),
        ("min_width", 1.4, 1.2, "m"),
    ],
)
def test_a_dimension_outside_the_envelope_is_rejected(
    rule: str, limit: float, measured: float, unit: str
) -> None:
    rejection = the_rejection(detect_stairs(**{rule: limit}), rule.removesuffix("_deg"))
    assert rejection.limit == limit
    assert rejection.measured == pytest.approx(measured, rel=0.01)
    assert rejection.unit == unit


def test_too_few_steps_are_rejected() -> None:
    rejection = the_rejection(detect(stairs_solid(STAIRS), room(), detection={"min_steps": 6}), "min_steps")
    assert (rejection.measured, rejection.limit, rejection.unit) == (5, 6, "1")


def test_two_steps_are_not_a_stairway() -> None:
    two = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=2)
    rejection = the_rejection(detect(stairs_solid(two), room()), "min_steps")
    assert rejection.measured <= 2
    assert rejection.limit == 3


def test_a_frame_with_too_few_measurements_is_rejected() -> None:
    frame = frame_of([stairs_solid(STAIRS), room()], POSE)
    depth = frame.depth.copy()
    depth[:-2] = np.nan
    sparse = DepthFrame(stamp_ns=3, depth=depth, camera=frame.camera, up=frame.up)
    detection = StairEdgeDetector(Config()).detect(sparse)
    assert detection.stamp_ns == 3
    rejection = the_rejection(detection, "valid_pixels")
    assert rejection.measured == pytest.approx(2 / 240)
    assert rejection.measured < rejection.limit


def test_a_frame_without_up_and_without_a_floor_is_rejected() -> None:
    wall = make_wall((2.0, -5), (2.0, 5), -3, 5)
    rejection = the_rejection(detect(wall, pose=pose_looking((0, 0, 1.0)), has_up=False), "up_from_floor")
    assert np.isnan(rejection.measured)
    assert rejection.to_dict()["measured"] is None


def test_a_camera_that_looks_straight_down_looks_along_no_heading() -> None:
    rejection = the_rejection(detect(FLOOR, pose=pose_looking((0, 0, 1.0), down=np.pi / 2)), "headings")
    assert (rejection.measured, rejection.limit) == (0, 1)


def test_an_empty_floor_has_no_steps() -> None:
    rejection = the_rejection(detect(FLOOR, pose=pose_looking((0, 0, 1.0), down=0.9)), "min_steps")
    assert (rejection.measured, rejection.limit) == (0, 3)


def test_a_wall_has_no_steps() -> None:
    wall = make_wall((2.0, -5), (2.0, 5), -3, 5)
    rejection = the_rejection(detect(FLOOR, wall, pose=pose_looking((0, 0, 1.0))), "min_steps")
    assert rejection.measured < 3


def upright_boards(thickness: float) -> TriangleMesh:
    """Six boards that stand where the risers of stairs would be, with nothing between them."""
    return joined(
        make_block([0.28 * k, -0.6, 0.17 * k], [0.28 * k + thickness, 0.6, 0.17 * (k + 1)]) for k in range(6)
    )


def test_boards_that_let_one_look_through_where_treads_should_be_are_rejected() -> None:
    pose = pose_towards((0.6, 0.0, 0.5), distance=1.6, height=1.6)
    rejection = the_rejection(detect(upright_boards(0.08), room(), pose=pose), "max_see_through")
    assert 0 < rejection.limit < rejection.measured <= 1


@pytest.mark.parametrize("height", [0.9, 1.2])
def test_thin_boards_without_treads_are_rejected_from_any_height(height: float) -> None:
    pose = pose_towards((0.6, 0.0, 0.5), distance=1.6, height=height)
    assert not detect(upright_boards(0.01), room(), pose=pose)


@pytest.mark.parametrize("turn_deg", [11.25, 15.0])
def test_winders_are_no_straight_flight(turn_deg: float) -> None:
    # Wedges about a post to the left: each riser is turned against the one before it.
    post = np.array([0.0, 0.45, 0.0])
    wedges = []
    for k in range(6):
        turn = np.eye(4)
        turn[:3, :3] = rotation_from_vector([0.0, 0.0, np.radians(turn_deg) * k])
        turn[:3, 3] = post
        wedges.append(make_block([0.0, -1.3, 0.0], [0.9, 0.0, 0.17 * (k + 1)]).transformed(turn))
    pose = pose_towards((0.2, -0.2, 0.3), distance=1.8, height=1.0)
    detection = detect(joined(wedges), room(), pose=pose)
    assert not detection
    assert detection.rejections


def test_a_rejection_of_a_rule_that_min_steps_did_not_break_measures_what_breaks_it() -> None:
    for rejection in detect_stairs(max_rise=0.16).rejections:
        if rejection.rule.startswith("max"):
            assert rejection.measured > rejection.limit
        else:
            assert rejection.measured < rejection.limit


def test_four_low_steps_that_few_rows_show_are_not_rejected_for_the_steps_they_have() -> None:
    # Four steps 2 m away, all in view.
    stairs = AnalyticStairs(rise=0.18494, run=0.36701, width=2.5784, num_risers=4)
    pose = pose_towards(
        (0.734, 0.0, 0.37), distance=1.976, height=0.8528,
        azimuth=np.radians(4.112), roll=np.radians(-1.429), turn=-0.0589,
    )  # fmt: skip
    detection = detect(stairs_solid(stairs), room(ahead=2.468), pose=pose)
    assert detection or all(rejection.measured < rejection.limit for rejection in detection.rejections)
    assert detection


@pytest.mark.parametrize(
    ("num", "rise", "run", "distance", "height", "azimuth", "ahead"),
    [
        (8, 0.1686, 0.2802, 2.6, 1.224, -0.219, 4.671),
        (6, 0.194, 0.32, 2.0, 0.7, -0.12, 4.35),
        (5, 0.17, 0.28, 1.1, 1.05, 0.1, 2.9),
    ],
    ids=["a tenth of the rays through risers", "three tenths", "a fiftieth past the last slab"],
)
def test_slabs_that_let_one_look_through_where_risers_should_be_are_stairs_of_all_their_steps(
    num: int, rise: float, run: float, distance: float, height: float, azimuth: float, ahead: float
) -> None:
    slabs = [
        make_block([run * k - 0.02, -0.6, rise * (k + 1) - 0.04], [run * (k + 1), 0.6, rise * (k + 1)])
        for k in range(num)
    ]
    pose = pose_towards((0.6, 0.0, 0.5), distance=distance, height=height, azimuth=azimuth)
    detection = detect(*slabs, room(ahead=ahead), pose=pose)
    assert [observation.num_steps for observation in detection.observations] == [num]
    assert detection.observations[0].rise == pytest.approx(rise, abs=0.003)


def steps_turned_by(angles_deg: list[float]) -> list[TriangleMesh]:
    """Steps of 0.17 m by 0.28 m, the front of each turned about its middle."""
    steps = []
    for k, angle in enumerate(np.radians(angles_deg)):
        height = 0.17 * (k + 1)
        center = (0.28 * k + np.cos(angle), np.sin(angle), height / 2)
        steps.append(make_turned_block(center, (2.0, 1.2, height), angle))
    return steps


def detect_turned(angles_deg: list[float], *, height: float = 1.2) -> Detection:
    pose = pose_towards((0.5, 0.0, 0.4), distance=1.8, height=height)
    return detect(*steps_turned_by(angles_deg), FLOOR, pose=pose)


def test_steps_that_are_not_turned_are_a_flight() -> None:
    detection = detect_turned([0.0] * 6)
    assert [observation.num_steps for observation in detection.observations] == [6]


@pytest.mark.parametrize("growth_deg", [6.0, 9.0, -9.0, 13.0])
@pytest.mark.parametrize("height", [0.6, 1.2])
def test_winders_are_none(growth_deg: float, height: float) -> None:
    detection = detect_turned([growth_deg * (k - 2.5) for k in range(6)], height=height)
    assert not detection.observations


def test_a_single_turned_step_is_left_out() -> None:
    detection = detect_turned([0.0, 0.0, 0.0, 0.0, 0.0, 20.0])
    assert [observation.num_steps for observation in detection.observations] == [5]


def test_a_candidate_that_no_profile_fits_has_no_ends() -> None:
    nothing = Candidate(observation=None, rejections=(), score=0.0, scene=None, lattice=None)  # type: ignore[arg-type]
    assert nothing.ends().shape == (0, 3)


@pytest.mark.parametrize(("distance", "num_risers", "row_step"), [(0.6, 3, 2), (0.9, 3, 1), (1.1, 6, 1)])
def test_of_near_steps_as_few_rows_are_fitted_as_leave_the_farthest_one_12(
    distance: float, num_risers: int, row_step: int
) -> None:
    # Of the third step 24.2 and 22.9 rows show, of the fifth from farther away 16.
    stairs = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=num_risers)
    pose = pose_towards((0.3, 0.0, 0.3), distance=distance, height=0.9)
    frame = frame_of([stairs_solid(stairs), room()], pose)
    trace = StairEdgeDetector(Config()).detect(frame, trace=True).trace
    assert trace is not None and trace.steps is not None and trace.steps.case is not None
    rows = np.unique(trace.steps.case.rays.row)
    assert set(np.diff(rows)) == {row_step}
