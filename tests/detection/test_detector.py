"""The default detector as a whole: one frame in, observations or reasons out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, nosings, pose_looking, render_frame
from solid_scenes import frame_of, pose_towards, room, stairs_solid
from stairmap.arrays import Transform
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.detection import detector
from stairmap.detection.candidate import Candidate, examine
from stairmap.detection.detector import StairEdgeDetector
from stairmap.detection.observation import Detection, Rejection, StairObservation
from stairmap.frame import DepthFrame
from stairmap.simulation.rooms import make_railing
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.stair_shapes import FlightShape
from stairmap.simulation.stairs import build_flight
from stairmap.simulation.triangle_mesh import TriangleMesh, make_block, make_rectangle
from stairmap.transforms import transform_points

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
MIDDLE = (0.7, 0.0, 0.45)
FROM_ABOVE = pose_towards(MIDDLE, distance=2.0, height=1.2)
FROM_BELOW = pose_towards(MIDDLE, distance=1.6, height=0.3)


def detect(frame: DepthFrame, *, trace: bool = False, config: Config | None = None) -> Detection:
    return StairEdgeDetector(Config() if config is None else config).detect(frame, trace=trace)


def the_observation(detection: Detection) -> StairObservation:
    assert len(detection.observations) == 1, [str(rejection) for rejection in detection.rejections]
    return detection.observations[0]


def frame_before(pose: Transform, *others: TriangleMesh, **how: object) -> DepthFrame:
    return frame_of([stairs_solid(STAIRS), room(), *others], pose, **how)  # type: ignore[arg-type]


def down_the_stairs(*, back: float = 0.3, height: float = 1.3, down_deg: float = 42.0) -> DepthFrame:
    """A frame taken on the upper floor, looking down the stairs."""
    top = nosings(STAIRS)[-1].mean(axis=0)
    pose = pose_looking((top[0] + back, 0.0, top[2] + height), yaw=np.pi, down=np.radians(down_deg))
    return frame_of([stairs_solid(STAIRS), make_rectangle((-9, -9), (9, 9), 0.0)], pose)


@pytest.mark.parametrize("pose", [FROM_ABOVE, FROM_BELOW], ids=["above all steps", "below most steps"])
def test_stairs_seen_from_the_lower_floor_are_ascending(pose: Transform) -> None:
    observation = the_observation(detect(frame_before(pose)))
    assert observation.view == "ascending"
    assert (observation.rise, observation.run) == pytest.approx((0.17, 0.28), abs=0.003)
    assert observation.num_steps >= 7
    assert observation.floor_seen
    np.testing.assert_allclose(pose[:3, :3] @ observation.forward, [1, 0, 0], atol=0.01)
    np.testing.assert_allclose(pose[:3, :3] @ observation.up, [0, 0, 1], atol=0.01)


def test_creases_are_below_the_camera_and_jumps_above_it() -> None:
    observation = the_observation(detect(frame_before(FROM_BELOW)))
    for edge in observation.edges:
        height = transform_points(FROM_BELOW, edge.nosing)[:, 2].mean()
        if abs(height - 0.3) > 0.1:
            assert edge.cue == ("crease" if height < 0.3 else "jump")


def test_stairs_seen_from_the_upper_floor_are_descending_and_still_head_up() -> None:
    frame = down_the_stairs()
    observation = the_observation(detect(frame))
    assert observation.view == "descending"
    assert (observation.rise, observation.run) == pytest.approx((0.17, 0.28), abs=0.006)
    assert frame.up is not None
    # Up the stairs is towards the camera, and the first edge is the lowest.
    assert observation.forward[2] < 0
    heights = [edge.nosing.mean(axis=0) @ frame.up for edge in observation.edges]
    assert heights == sorted(heights)
    # Left seen up the stairs is to the right of a camera that looks down them.
    for edge in observation.edges:
        assert edge.nosing[0, 0] > edge.nosing[1, 0]


def test_nosings_of_a_descending_view_lie_on_the_stairs() -> None:
    frame = down_the_stairs()
    observation = the_observation(detect(frame))
    top = nosings(STAIRS)[-1].mean(axis=0)
    pose = pose_looking((top[0] + 0.3, 0.0, top[2] + 1.3), yaw=np.pi, down=np.radians(42.0))
    true = nosings(STAIRS).mean(axis=1)
    for edge in observation.edges:
        middle = transform_points(pose, edge.nosing).mean(axis=0)
        assert np.abs(true - middle).max(axis=1).min() < 0.05


def test_an_observations_lattice_passes_through_its_edges() -> None:
    observation = the_observation(detect(frame_before(FROM_ABOVE)))
    for edge in observation.edges:
        step = observation.run * observation.forward + observation.rise * observation.up
        offset = edge.nosing.mean(axis=0) - observation.origin - edge.step_index * step
        assert abs(offset @ observation.forward) < 0.01
        assert abs(offset @ observation.up) < 0.02


def test_edges_come_from_the_lowest_up_and_are_numbered_from_0() -> None:
    observation = the_observation(detect(frame_before(FROM_ABOVE)))
    indices = [edge.step_index for edge in observation.edges]
    assert indices[0] == 0
    assert indices == sorted(set(indices))


def test_a_landing_in_view_ends_the_steps() -> None:
    short = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=4)
    frame = frame_of([stairs_solid(short), room()], pose_towards(MIDDLE, distance=2.0, height=1.2))
    observation = the_observation(detect(frame))
    assert observation.num_steps == 4
    assert observation.top_seen
    assert observation.floor_seen


def test_without_up_it_comes_from_the_floor() -> None:
    frame = frame_before(FROM_ABOVE, has_up=False)
    assert frame.up is None
    observation = the_observation(detect(frame))
    assert (observation.rise, observation.run) == pytest.approx((0.17, 0.28), abs=0.003)


def test_an_up_that_is_4_degrees_off_is_corrected() -> None:
    frame = frame_before(FROM_ABOVE)
    sine, cosine = np.sin(np.radians(4)), np.cos(np.radians(4))
    tilted = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]]) @ frame.up
    observation = the_observation(detect(replace(frame, up=tilted)))
    assert (observation.rise, observation.run) == pytest.approx((0.17, 0.28), abs=0.003)


def observe_open_risers(*, run: float, rise: float, distance: float) -> StairObservation:
    shape = FlightShape(rise=rise, run=run, width=1.2, num_risers=9, open_risers=True)
    mesh, _ = build_flight(shape, base=np.zeros(3), heading=0.0, random=np.random.default_rng(0))
    frame = frame_of([mesh, room()], pose_towards(MIDDLE, distance=distance, height=1.2))
    return the_observation(detect(frame))


NO_RISERS = "the back edges of slabs are searched, not their fronts: the lattice lies a run too far"


@pytest.mark.parametrize(("rise", "run"), [(0.19, 0.26), (0.17, 0.28)])
def test_open_risers_are_stairs_too(rise: float, run: float) -> None:
    observation = observe_open_risers(rise=rise, run=run, distance=1.0)
    assert (observation.rise, observation.run) == pytest.approx((rise, run), abs=0.008)


@pytest.mark.parametrize(
    ("rise", "run", "distance"),
    [
        pytest.param(0.19, 0.26, 1.5, marks=pytest.mark.xfail(reason=NO_RISERS)),
        pytest.param(0.19, 0.26, 2.2, marks=pytest.mark.xfail(reason=NO_RISERS)),
        pytest.param(0.17, 0.28, 2.2, marks=pytest.mark.xfail(reason=NO_RISERS)),
    ],
)
def test_open_risers_farther_away_are_measured_to_a_centimetre(
    rise: float, run: float, distance: float
) -> None:
    observation = observe_open_risers(rise=rise, run=run, distance=distance)
    assert (observation.rise, observation.run) == pytest.approx((rise, run), abs=0.01)


def test_a_railing_and_a_box_beside_the_stairs_do_not_disturb() -> None:
    others = [make_railing((-0.5, 0.75), (2.0, 0.75), 0.0), make_block([-0.4, -1.2, 0], [0.1, -0.75, 0.6])]
    observation = the_observation(detect(frame_before(FROM_ABOVE, *others)))
    assert (observation.rise, observation.run) == pytest.approx((0.17, 0.28), abs=0.003)


def test_two_different_stairs_in_one_frame_are_two_observations() -> None:
    other = AnalyticStairs(rise=0.20, run=0.25, width=0.9, num_risers=6)
    shift = np.eye(4)
    shift[:2, 3] = [0.4, -1.9]
    pose = pose_towards((0.8, -0.9, 0.4), distance=2.4, height=1.2, turn=-0.1)
    frame = frame_of([stairs_solid(STAIRS), stairs_solid(other).transformed(shift), room()], pose)
    detection = detect(frame)
    found = sorted((item.rise, item.run) for item in detection.observations)
    assert found == [pytest.approx((0.17, 0.28), abs=0.004), pytest.approx((0.20, 0.25), abs=0.004)]


@pytest.mark.parametrize("seed", range(4))
def test_noise_of_a_kinect_costs_a_few_millimetres(seed: int) -> None:
    frame = render_frame(STAIRS, FROM_ABOVE, wall_at=4.5, noise_seed=seed)
    observation = the_observation(detect(frame))
    assert (observation.rise, observation.run) == pytest.approx((0.17, 0.28), abs=0.006)


def test_a_tenth_of_the_pixels_missing_at_random_costs_nothing() -> None:
    frame = frame_before(FROM_ABOVE)
    depth = frame.depth.copy()
    depth[np.random.default_rng(2).random(depth.shape) < 0.1] = np.nan
    observation = the_observation(detect(replace(frame, depth=depth)))
    assert (observation.rise, observation.run) == pytest.approx((0.17, 0.28), abs=0.003)


def test_a_frame_without_noise_and_with_nothing_above_the_stairs_is_looked_at() -> None:
    frame = render_frame(STAIRS, FROM_ABOVE)
    assert np.isnan(frame.depth).any()
    the_observation(detect(frame))


@pytest.mark.parametrize("value", [np.nan, 0.0, np.inf])
def test_a_frame_of_nothing_is_rejected(value: float) -> None:
    depth = np.full((240, 320), value, np.float32)
    detection = detect(DepthFrame(stamp_ns=7, depth=depth, camera=KINECT_CAMERA, up=[0.0, -1.0, 0.0]))
    assert not detection
    assert detection.stamp_ns == 7
    assert [rejection.rule for rejection in detection.rejections] == ["valid_pixels"]


def test_the_same_frame_twice_gives_the_same_line_bit_for_bit() -> None:
    frame = render_frame(STAIRS, FROM_ABOVE, noise_seed=1)
    detector = StairEdgeDetector(Config())
    first = detector.detect(frame).to_dict()
    detector.detect(frame_before(FROM_BELOW))
    assert detector.detect(frame).to_dict() == first


def test_a_detector_does_not_write_into_the_frame() -> None:
    frame = render_frame(STAIRS, FROM_ABOVE, noise_seed=1)
    before = frame.depth.copy()
    detect(frame, trace=True)
    np.testing.assert_array_equal(frame.depth, before)


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_a_trace_shows_nosings_treads_and_risers_where_they_are_in_the_frame(factor: float) -> None:
    camera = KINECT_CAMERA.scaled(factor)
    frame = frame_before(FROM_ABOVE, camera=camera)
    detection = detect(frame, trace=True)
    trace = detection.trace
    assert trace is not None
    for mask in (trace.edge_pixels, trace.tread_pixels, trace.riser_pixels):
        assert mask.shape == frame.depth.shape
        assert mask.any()
    assert len(trace.accepted_lines) == len(detection.observations[0].edges)
    edges = np.array([edge.nosing for edge in detection.observations[0].edges])
    np.testing.assert_allclose(trace.accepted_lines.reshape(-1, 2, 2), camera.project(edges), atol=1e-6)
    # Edges are where both surfaces are within three pixels of the working image, each ``factor`` wide.
    near = [
        maximum_filter(mask, 2 * 3 * round(factor) + 1, mode="constant")
        for mask in (trace.tread_pixels, trace.riser_pixels)
    ]
    np.testing.assert_array_equal(trace.edge_pixels, near[0] & near[1])
    points = transform_points(FROM_ABOVE, frame.points())
    height = points[trace.tread_pixels][:, 2] / 0.17
    assert np.nanmean(np.abs(height - np.rint(height)) < 0.1) > 0.8
    distance = points[trace.riser_pixels][:, 0] / 0.28
    assert np.nanmean(np.abs(distance - np.rint(distance)) < 0.1) > 0.8


def test_without_a_trace_none_is_kept() -> None:
    assert detect(frame_before(FROM_ABOVE)).trace is None


def test_what_is_beyond_max_depth_is_not_used() -> None:
    config = Config.model_validate({"detection": {"max_depth": 1.5}})
    assert not detect(frame_before(FROM_ABOVE), config=config)


def test_a_wall_in_a_room_is_no_stairway() -> None:
    scene = make_scene("empty_room", 0)
    detection = detect(frame_of([scene.mesh], pose_looking((-3.0, 0.0, 0.6), yaw=0.4)))
    assert not detection
    assert detection.rejections


def slabs(num: int) -> list[TriangleMesh]:
    """Treads 30 mm thick and nothing between them, in free space."""
    return [
        make_block((0.23 * k, -0.6, 0.2 * k + 0.17), (0.23 * k + 0.23, 0.6, 0.2 * k + 0.2))
        for k in range(1, num + 1)
    ]


def slab_frame(num: int, *, distance: float = 1.6, **how: object) -> DepthFrame:
    """Slabs seen from a camera 0.15 m up, lower than all of them: only their fronts show."""
    pose = pose_looking((-distance, 0.2, 0.15), yaw=np.radians(-8), down=np.radians(-10))
    return frame_of([*slabs(num), make_rectangle((-9, -9), (9, 9), 0.0)], pose, **how)  # type: ignore[arg-type]


@pytest.mark.parametrize("distance", [1.4, 1.8, 2.2])
def test_fronts_of_slabs_above_the_camera_are_stairs(distance: float) -> None:
    observation = the_observation(detect(slab_frame(5, distance=distance)))
    assert (observation.rise, observation.run) == pytest.approx((0.2, 0.23), abs=0.003)
    assert observation.num_steps == 5
    assert observation.width == pytest.approx(1.2, abs=0.03)


def test_three_bars_are_no_stairs() -> None:
    detection = detect(slab_frame(3))
    assert not detection.observations
    assert "min_steps" in {rejection.rule for rejection in detection.rejections}


def test_holes_in_the_floor_do_not_hide_slabs() -> None:
    frame = slab_frame(5)
    depth = frame.depth.copy()
    rows = np.arange(len(depth))[:, None]
    is_far_floor = (rows > 0.55 * len(depth)) & (rows < 0.75 * len(depth))
    depth[is_far_floor & (np.random.default_rng(0).random(depth.shape) < 0.4)] = np.nan
    observation = the_observation(detect(replace(frame, depth=depth)))
    assert (observation.rise, observation.run) == pytest.approx((0.2, 0.23), abs=0.003)
    assert observation.num_steps == 5


@pytest.mark.parametrize("off_deg", [10.0, 20.0])
def test_an_up_that_is_too_far_off_is_said(off_deg: float) -> None:
    frame = frame_of([room()], pose_looking((-2.0, 0.0, 0.6), yaw=0.3, down=np.radians(20)))
    sine, cosine = np.sin(np.radians(off_deg)), np.cos(np.radians(off_deg))
    tilted = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]]) @ frame.up
    rejection = detect(replace(frame, up=tilted)).rejections[0]
    assert rejection.rule == "max_up_error"
    assert rejection.measured == pytest.approx(off_deg, abs=1.0)
    assert (rejection.limit, rejection.unit) == (pytest.approx(6.0), "deg")


@pytest.mark.parametrize("off_deg", [0.0, 4.0])
def test_of_an_up_that_can_be_corrected_nothing_is_said(off_deg: float) -> None:
    frame = frame_of([room()], pose_looking((-2.0, 0.0, 0.6), yaw=0.3, down=np.radians(20)))
    sine, cosine = np.sin(np.radians(off_deg)), np.cos(np.radians(off_deg))
    tilted = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]]) @ frame.up
    assert "max_up_error" not in {reason.rule for reason in detect(replace(frame, up=tilted)).rejections}


def test_an_up_without_length_is_refused() -> None:
    with pytest.raises(ValueError, match="length above zero"):
        DepthFrame(
            stamp_ns=0, depth=np.ones((240, 320), np.float32), camera=KINECT_CAMERA, up=[0.0, 0.0, 0.0]
        )


@pytest.mark.parametrize("size", [(1, 1), (320, 1), (1, 240), (2, 2), (17, 21), (40, 30)])
@pytest.mark.parametrize("value", [np.nan, 1.5])
@pytest.mark.parametrize("has_up", [True, False])
def test_images_of_any_size_and_content_get_a_clear_answer(
    size: tuple[int, int], value: float, has_up: bool
) -> None:
    width, height = size
    camera = PinholeCamera(width=width, height=height, fx=200.0, fy=200.0, cx=width / 2, cy=height / 2)
    depth = np.full((height, width), value, np.float32)
    up = [0.0, -1.0, 0.0] if has_up else None
    detection = detect(DepthFrame(stamp_ns=0, depth=depth, camera=camera, up=up), trace=True)
    assert not detection
    assert detection.rejections
    assert detection.trace is not None
    assert detection.trace.tread_pixels.shape == (height, width)


@pytest.mark.parametrize(("share", "is_looked_at"), [(0.015, False), (0.025, True)])
def test_a_frame_of_which_two_percent_are_measured_is_looked_at(share: float, is_looked_at: bool) -> None:
    frame = frame_before(FROM_ABOVE)
    depth = np.full_like(frame.depth, np.nan)
    num = round(share * depth.size / depth.shape[1])
    depth[100 : 100 + num] = 1.5
    rules = {rejection.rule for rejection in detect(replace(frame, depth=depth)).rejections}
    assert ("valid_pixels" not in rules) == is_looked_at
    assert rules


def test_stairs_that_look_alike_from_two_headings_are_one_observation() -> None:
    pose = pose_towards(MIDDLE, distance=1.8, height=1.0, azimuth=np.radians(30))
    assert len(detect(frame_before(pose)).observations) == 1


def test_an_observation_knows_its_stamp_and_its_frames_up() -> None:
    frame = replace(frame_before(FROM_ABOVE), stamp_ns=123)
    observation = the_observation(detect(frame))
    assert observation.stamp_ns == 123
    assert observation.forward @ observation.up == pytest.approx(0.0, abs=1e-9)
    assert observation.points.shape == (2 * len(observation.edges), 3)


def test_an_observations_covariance_is_that_of_its_lowest_step() -> None:
    # Where the origin lies farther up, its place along the stairs is less sure by the run's.
    ascending = the_observation(detect(frame_before(FROM_ABOVE)))
    descending = the_observation(detect(down_the_stairs()))
    for observation in (ascending, descending):
        covariance = observation.covariance
        assert covariance.shape == (6, 6)
        assert np.linalg.eigvalsh(covariance).min() > 0
        std = np.sqrt(np.diag(covariance))
        assert 0.0003 < std[0] < 0.005
        assert 0.0003 < std[1] < 0.006
        assert observation.rise_information.shape == (2, 3)
        # Run counts positive either way: who takes the steps for higher takes them for shorter.
        assert covariance[0, 1] < 0
    # The origin of stairs that descend is the far end: a longer run brings it nearer to the camera's side.
    assert descending.covariance[1, 2] < 0


def test_every_edge_says_how_sure_its_own_place_is() -> None:
    observation = the_observation(detect(frame_before(FROM_ABOVE)))
    stds = np.array([edge.std for edge in observation.edges])
    assert stds.shape == (len(observation.edges), 2)
    assert (stds > 0).all()
    assert (stds < 0.006).all()
    assert all(edge.num_pixels >= 16 for edge in observation.edges)


def rejected(*rules: tuple[str, float]) -> tuple[Rejection, ...]:
    return tuple(Rejection(rule=rule, measured=measured, limit=3.0, unit="1") for rule, measured in rules)


WINDS = rejected(("min_steps", 0), ("max_turn", 25.0))


@pytest.mark.parametrize(
    ("rejections", "more_steps", "is_kept"),
    [
        (WINDS, 1, False),
        (WINDS, -1, True),
        (rejected(("min_steps", 2), ("max_turn", 25.0)), 1, True),
        (rejected(("min_steps", 0), ("max_see_through", 0.4)), 1, True),
        (rejected(("max_turn", 25.0)), 1, True),
    ],
    ids=["all steps turned", "fewer steps", "some steps turned", "no steps for another reason", "turned"],
)
def test_what_winds_keeps_its_part_of_the_image_before_stairs_of_fewer_steps(
    monkeypatch: pytest.MonkeyPatch, rejections: tuple[Rejection, ...], more_steps: int, is_kept: bool
) -> None:
    # The same stairs once more, rejected for some reason.
    def examine_twice(*what: Any) -> Candidate:
        candidate = examine(*what)
        others.append(
            replace(candidate, observation=None, rejections=rejections, score=candidate.score + more_steps)
        )
        return candidate

    def along(look: Any, angle: float) -> list[Candidate]:
        return [*plain(look, angle), *others]

    others: list[Candidate] = []
    plain = detector._Look.along
    monkeypatch.setattr(detector, "examine", examine_twice)
    monkeypatch.setattr(detector._Look, "along", along)
    detection = detect(frame_before(FROM_ABOVE))
    assert others
    assert len(detection.observations) == is_kept
    if not is_kept:
        assert detection.rejections == rejections


@pytest.mark.parametrize("is_sharpened", [True, False])
def test_narrow_treads_that_a_phone_blends_are_found_by_sharpened_scans(
    monkeypatch: pytest.MonkeyPatch, is_sharpened: bool
) -> None:
    stairs = AnalyticStairs(rise=0.17, run=0.28, width=1.4, num_risers=9)
    top = nosings(stairs)[-1].mean(axis=0)
    pose = pose_looking((top[0] + 1.0, 0.1, top[2] + 0.95), yaw=np.pi - 0.05, down=np.radians(38.0))
    phone = PinholeCamera(width=256, height=192, fx=212, fy=212, cx=127.5, cy=95.5)
    frame = frame_of([stairs_solid(stairs), make_rectangle((-9, -9), (9, 9), 0.0)], pose, camera=phone)
    depth = 1.0 / cv2.GaussianBlur(1.0 / np.nan_to_num(frame.depth, nan=20.0), (0, 0), 2.0)
    if not is_sharpened:
        monkeypatch.setattr(detector, "MIN_SHARPENED", np.inf)
    found = detect(replace(frame, depth=depth.astype(np.float32)))
    assert len(found.observations) == is_sharpened
    if is_sharpened:
        assert found.observations[0].rise == pytest.approx(0.17, abs=0.004)
        assert found.observations[0].run == pytest.approx(0.28, abs=0.005)


@pytest.mark.parametrize(
    ("first", "second", "part"),
    [
        (([10, 20], [30, 60]), ([10, 20], [30, 60]), 1.0),
        (([10, 20], [30, 60]), ([0, 0], [100, 100]), 1.0),
        (([0, 0], [100, 100]), ([10, 20], [30, 60]), 1.0),
        (([10, 20], [30, 60]), ([20, 40], [60, 90]), 0.25),
        (([20, 40], [60, 90]), ([10, 20], [30, 60]), 0.25),
        (([10, 20], [30, 60]), ([30, 20], [50, 60]), 0.0),
        (([10, 20], [30, 60]), ([40, 70], [50, 80]), 0.0),
        (([10, 20], [30, 60]), ([10, 61], [30, 80]), 0.0),
        (([10, 20], [10.5, 21]), ([0, 0], [50, 50]), 0.5),
    ],
)
def test_of_two_areas_the_smaller_one_tells_which_part_they_share(
    first: tuple[list[float], list[float]], second: tuple[list[float], list[float]], part: float
) -> None:
    # Less than a pixel counts as one.
    assert detector.shared_part(np.array(first), np.array(second)) == pytest.approx(part)
