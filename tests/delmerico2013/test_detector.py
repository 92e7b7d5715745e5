from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, nosings, pose_looking, render_frame
from stairmap.camera import PinholeCamera
from stairmap.config import Config, load_config
from stairmap.delmerico2013.detector import Delmerico2013Detector, uphill_direction
from stairmap.detection.observation import Detection, StairObservation
from stairmap.frame import DepthFrame
from stairmap.geometry import fit_plane
from stairmap.transforms import transform_points

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=7)
POSE = pose_looking((-1.5, 0.1, 0.4), yaw=-0.05, down=-0.1)
"""A low robot before the stairs, looking slightly up: all nosings but the lowest are above the camera."""


@pytest.fixture(scope="module")
def detector() -> Delmerico2013Detector:
    return Delmerico2013Detector(Config())


def observe(detector: Delmerico2013Detector, frame: DepthFrame) -> StairObservation:
    (observation,) = detector.detect(frame).observations
    return observation


def rules(detection: Detection) -> list[str]:
    assert not detection.observations
    return [rejection.rule for rejection in detection.rejections]


def test_stairs_before_a_low_robot_are_detected_with_their_dimensions(
    detector: Delmerico2013Detector,
) -> None:
    observation = observe(detector, render_frame(STAIRS, POSE, stamp_ns=5, wall_at=6, floor=False))
    assert observation.stamp_ns == 5
    assert observation.view == "ascending"
    assert observation.rise == pytest.approx(STAIRS.rise, abs=0.01)
    assert observation.run == pytest.approx(STAIRS.run, abs=0.02)
    assert observation.num_steps >= 5
    assert 0.4 < observation.width < STAIRS.width
    assert observation.covariance.shape == (0, 0)


def test_edges_lie_on_nosings_of_the_stairs_in_order_from_left_to_right(
    detector: Delmerico2013Detector,
) -> None:
    observation = observe(detector, render_frame(STAIRS, POSE, wall_at=6, floor=False))
    edges = transform_points(POSE, np.array([edge.nosing for edge in observation.edges]))
    truth = nosings(STAIRS)[:, 0]
    distances = np.linalg.norm(edges.mean(axis=1)[:, None, [0, 2]] - truth[None, :, [0, 2]], axis=2)
    assert distances.min(axis=1).max() < 0.03
    nearest = distances.argmin(axis=1)
    assert (np.diff(nearest) == 1).all()
    assert [edge.step_index for edge in observation.edges] == list(range(len(edges)))
    assert (edges[:, 0, 1] > edges[:, 1, 1]).all()
    assert np.abs(edges[..., 1]).max() < STAIRS.width / 2 + 0.02


def test_no_end_is_called_bounded_and_all_edges_are_jumps(detector: Delmerico2013Detector) -> None:
    observation = observe(detector, render_frame(STAIRS, POSE, wall_at=6, floor=False))
    assert not any(edge.left_bounded or edge.right_bounded for edge in observation.edges)
    assert {edge.cue for edge in observation.edges} == {"jump"}
    assert sum(edge.num_pixels for edge in observation.edges) == len(observation.points)


def test_nearly_all_points_lie_in_the_plane_of_the_nosings(detector: Delmerico2013Detector) -> None:
    observation = observe(detector, render_frame(STAIRS, POSE, wall_at=6, floor=False))
    points = transform_points(POSE, observation.points)
    height = points[:, 2] - STAIRS.rise - points[:, 0] * STAIRS.rise / STAIRS.run
    assert np.mean(np.abs(height) < 0.02) > 0.95


@settings(deadline=None, max_examples=25)
@given(
    st.floats(0.15, 0.20),
    st.floats(0.26, 0.32),
    st.floats(-0.3, 0.3),
    st.floats(-0.1, 0.1),
    st.integers(0, 10**6),
)
def test_any_detection_agrees_with_itself_and_with_the_gate(
    rise: float, run: float, yaw: float, roll: float, seed: int
) -> None:
    stairs = AnalyticStairs(rise=rise, run=run, num_risers=10)
    pose = pose_looking((-1.5, 0.0, 0.4), yaw=yaw, down=-0.15, roll=roll)
    detection = Delmerico2013Detector(Config()).detect(render_frame(stairs, pose, wall_at=6, noise_seed=seed))
    assert bool(detection.observations) != bool(detection.rejections)
    for observation in detection.observations:
        plane = fit_plane(observation.points)
        assert plane is not None
        assert abs(plane[:3] @ observation.up) >= np.cos(np.radians(45)) - 1e-9
        assert np.linalg.norm(observation.forward) == pytest.approx(1)
        assert observation.forward @ observation.up == pytest.approx(0, abs=1e-9)
        middles = np.array([edge.nosing.mean(axis=0) for edge in observation.edges])
        assert (np.diff(middles @ observation.up) >= 0).all()
        assert (middles[-1] - middles[0]) @ observation.up == pytest.approx(
            (observation.num_steps - 1) * observation.rise
        )
        assert observation.num_steps >= 3


def test_planes_found_in_noise_have_the_pitch_and_heading_of_the_stairs_on_average(
    detector: Delmerico2013Detector,
) -> None:
    random = np.random.default_rng(0)
    pitches, headings = [], []
    for seed in range(25):
        pose = pose_looking((-1.5, 0.0, 0.4), yaw=random.uniform(-0.15, 0.15), down=-0.15)
        for observation in detector.detect(
            render_frame(STAIRS, pose, wall_at=6, noise_seed=seed)
        ).observations:
            plane = fit_plane(observation.points)
            assert plane is not None
            pitches.append(np.arccos(abs(plane[:3] @ observation.up)))
            forward = pose[:3, :3] @ observation.forward
            headings.append(np.arctan2(forward[1], forward[0]))
    assert len(pitches) >= 15
    assert np.median(pitches) == pytest.approx(np.arctan2(STAIRS.rise, STAIRS.run), abs=np.radians(2))
    assert np.median(headings) == pytest.approx(0, abs=np.radians(4))


def test_most_frames_of_a_noisy_approach_are_detections(detector: Delmerico2013Detector) -> None:
    frames = [
        render_frame(STAIRS, pose_looking((-x, 0.1, 0.4), down=-0.1), wall_at=6, noise_seed=seed)
        for seed, x in enumerate(np.linspace(2.5, 1.0, 12))
    ]
    assert sum(bool(detector.detect(frame)) for frame in frames) >= 9


@pytest.mark.parametrize("depth", [np.nan, 2.0], ids=["nothing measured", "wall"])
def test_image_without_a_discontinuity_is_rejected_for_want_of_edges(
    detector: Delmerico2013Detector, depth: float
) -> None:
    frame = DepthFrame(stamp_ns=0, depth=np.full((240, 320), depth), camera=KINECT_CAMERA)
    detection = detector.detect(frame, trace=True)
    assert rules(detection) == ["no_edges"]
    assert detection.trace is not None
    assert not detection.trace.edge_pixels.any()


def test_two_steps_are_too_few(detector: Delmerico2013Detector) -> None:
    stairs = AnalyticStairs(num_risers=2)
    detection = detector.detect(render_frame(stairs, pose_looking((-1.0, 0.0, 0.15)), wall_at=4))
    assert "min_lines" in rules(detection)
    rejection = next(item for item in detection.rejections if item.rule == "min_lines")
    assert (rejection.measured < 3, rejection.limit, rejection.unit) == (True, 3, "1")


def staggered_bars() -> DepthFrame:
    """Three bars of 60 px before a wall, each sharing 8 columns with the next."""
    depth = np.full((240, 320), 3.0)
    for number in range(3):
        depth[60 + 50 * number : 85 + 50 * number, 60 + 52 * number : 120 + 52 * number] = 2.0
    return DepthFrame(stamp_ns=0, depth=depth, camera=KINECT_CAMERA)


def test_lines_that_share_fewer_than_10_columns_are_rejected(detector: Delmerico2013Detector) -> None:
    detection = detector.detect(staggered_bars())
    assert rules(detection) == ["min_columns"]
    assert detection.rejections[0].measured < 10
    assert (detection.rejections[0].limit, detection.rejections[0].unit) == (10, "px")


def test_plane_steeper_than_45_degrees_is_rejected_unless_the_config_allows_it(
    detector: Delmerico2013Detector,
) -> None:
    steep = AnalyticStairs(rise=0.28, run=0.22, num_risers=10)
    frame = render_frame(steep, pose_looking((-1.5, 0.0, 0.4), down=-0.2), wall_at=5)
    detection = detector.detect(frame)
    assert rules(detection) == ["max_pitch"]
    assert detection.rejections[0].measured == pytest.approx(np.degrees(np.arctan2(0.28, 0.22)), abs=4)
    assert Delmerico2013Detector(load_config(None, ["delmerico2013.max_pitch_deg=60"])).detect(frame)


def test_without_up_the_camera_counts_as_level(detector: Delmerico2013Detector) -> None:
    level = render_frame(STAIRS, pose_looking((-1.5, 0.1, 0.4)), wall_at=6)
    known, assumed = observe(detector, level), observe(detector, replace(level, up=None))
    np.testing.assert_allclose(assumed.up, [0.0, -1.0, 0.0])
    assert assumed.rise == pytest.approx(known.rise, abs=1e-6)
    assert assumed.run == pytest.approx(known.run, abs=1e-6)


def test_larger_image_is_judged_by_every_second_pixel(detector: Delmerico2013Detector) -> None:
    camera = PinholeCamera(width=640, height=480, fx=525.0, fy=525.0, cx=319.5, cy=239.5)
    large = render_frame(STAIRS, POSE, camera=camera, wall_at=6)
    thinned = replace(large, depth=large.depth[::2, ::2], camera=camera.strided(2))
    from_large, from_thinned = detector.detect(large, trace=True), detector.detect(thinned, trace=True)
    np.testing.assert_allclose(from_large.observations[0].points, from_thinned.observations[0].points)
    assert from_large.trace is not None
    assert from_thinned.trace is not None
    np.testing.assert_allclose(from_large.trace.accepted_lines, 2 * from_thinned.trace.accepted_lines)
    assert from_large.trace.edge_pixels.shape == (480, 640)
    np.testing.assert_array_equal(from_large.trace.edge_pixels[::2, ::2], from_thinned.trace.edge_pixels)


def test_same_frame_gives_the_same_detection_whatever_opencvs_seed(detector: Delmerico2013Detector) -> None:
    frame = render_frame(STAIRS, POSE, wall_at=6, noise_seed=1)
    first = detector.detect(frame).to_dict()
    cv2.setRNGSeed(77)
    assert detector.detect(frame).to_dict() == first
    assert json.dumps(first, allow_nan=False)


def test_uphill_is_level_and_climbs_the_plane_whichever_way_its_normal_points() -> None:
    up = np.array([0.0, -1.0, 0.0])
    normal = np.array([0.0, -np.cos(0.5), -np.sin(0.5)])
    for plane in (np.append(normal, 2.0), -np.append(normal, 2.0)):
        np.testing.assert_allclose(uphill_direction(plane, up), [0.0, 0.0, 1.0], atol=1e-12)


def test_uphill_of_a_level_plane_is_the_direction_of_view() -> None:
    up = np.array([0.0, -np.cos(0.3), -np.sin(0.3)])
    expected = [0.0, -np.sin(0.3), np.cos(0.3)]
    np.testing.assert_allclose(uphill_direction(np.append(up, 1.0), up), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "rule"), [("kinect_v2_test_stairs", "min_lines"), ("xtion_two_steps_close", "no_edges")]
)
def test_real_stairs_below_the_camera_are_missed_as_the_report_says(
    detector: Delmerico2013Detector, shared_data: Path, name: str, rule: str
) -> None:
    folder = shared_data / "real" / name
    calibration = json.loads((folder / "camera.json").read_text())
    scale, up = calibration.pop("depth_scale"), calibration.pop("up", None)
    depth = cv2.imread(str(folder / "depth/000000.png"), cv2.IMREAD_UNCHANGED) / scale
    depth[depth == 0] = np.nan
    frame = DepthFrame(stamp_ns=0, depth=depth, camera=PinholeCamera(**calibration), up=up)
    assert rules(detector.detect(frame)) == [rule]
