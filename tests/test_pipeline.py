"""Methods by name, one image without a session, and images that show nothing."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, pose_looking, render_frame
from stairmap import detect
from stairmap.arrays import Float64Array
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.errors import ConfigError
from stairmap.pipeline import METHODS, MIN_IMAGE_SIDE, make_detector, make_modeler

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
POSE = pose_looking((-1.6, 0.05, 0.9), yaw=0.0, down=0.3)
UP = POSE[2, :3]


@pytest.fixture(scope="module")
def depth() -> Float64Array:
    return np.asarray(render_frame(STAIRS, POSE, stamp_ns=0, wall_at=4.5).depth, dtype=np.float64)


def camera_of(height: int, width: int) -> PinholeCamera:
    return PinholeCamera(
        width=width, height=height, fx=float(width), fy=float(width), cx=(width - 1) / 2, cy=(height - 1) / 2
    )


def test_one_image_is_measured(depth: Float64Array) -> None:
    (observation,) = detect(depth, KINECT_CAMERA, up=UP).observations
    assert (observation.rise, observation.run) == pytest.approx((0.17, 0.28), abs=0.003)


def test_without_up_the_floor_in_view_tells_it(depth: Float64Array) -> None:
    (observation,) = detect(depth, KINECT_CAMERA).observations
    assert np.degrees(np.arccos(observation.up @ UP)) < 1.0
    assert observation.rise == pytest.approx(0.17, abs=0.005)


@pytest.mark.parametrize("length", [9.81, 1e-6])
def test_up_may_have_any_length(length: float, depth: Float64Array) -> None:
    expected = detect(depth, KINECT_CAMERA, up=UP).to_dict()
    assert detect(depth, KINECT_CAMERA, up=length * UP).to_dict() == expected


@pytest.mark.parametrize("method", sorted(METHODS))
@pytest.mark.parametrize("nothing", [0.0, -1.0, np.inf])
def test_what_cameras_write_for_nothing_is_nothing(method: str, nothing: float, depth: Float64Array) -> None:
    holes = np.random.default_rng(1).random(depth.shape) < 0.05
    known = detect(np.where(holes, np.nan, depth), KINECT_CAMERA, up=UP, method=method)
    filled = detect(np.where(holes, nothing, depth), KINECT_CAMERA, up=UP, method=method)
    assert filled.to_dict() == known.to_dict()


def test_millimetres_are_refused(depth: Float64Array) -> None:
    millimetres = np.nan_to_num(1e3 * depth).astype(np.uint16)
    with pytest.raises(ValueError, match=r"metres as floating-point numbers, got uint16; .* 1000 for mil"):
        detect(millimetres, KINECT_CAMERA)


@pytest.mark.parametrize(
    ("shape", "message"),
    [((240, 320, 1), r"shape \(240, 320, 1\)"), ((320, 240), "its camera says"), ((0, 0), "its camera says")],
)
def test_an_image_of_another_shape_is_refused(shape: tuple[int, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        detect(np.ones(shape), KINECT_CAMERA)


@pytest.mark.parametrize(
    ("up", "message"),
    [
        ((0.0, 0.0, 0.0), "finite length above zero"),
        ((0.0, np.nan, 1.0), "finite length above zero"),
        ((0.0, -np.inf, 0.0), "finite length above zero"),
        ((0.0, -1.0), "three numbers"),
        ([[0.0, -1.0, 0.0]], "three numbers"),
    ],
)
def test_an_up_that_is_no_direction_is_refused(up: Float64Array, message: str, depth: Float64Array) -> None:
    with pytest.raises(ValueError, match=message):
        detect(depth, KINECT_CAMERA, up=up)


@pytest.mark.parametrize("method", sorted(METHODS))
@pytest.mark.parametrize("shape", [(1, 1), (1, 320), (240, 1), (MIN_IMAGE_SIDE - 1, 320), (8, 4000)])
def test_an_image_too_small_for_steps_says_so(method: str, shape: tuple[int, int]) -> None:
    detection = detect(np.full(shape, 2.0), camera_of(*shape), method=method)
    assert not detection
    (rejection,) = detection.rejections
    assert (rejection.rule, rejection.limit, rejection.unit) == ("min_image_side", MIN_IMAGE_SIDE, "px")
    assert rejection.measured < MIN_IMAGE_SIDE


def test_the_smallest_image_is_looked_at() -> None:
    detection = detect(np.full((MIN_IMAGE_SIDE, 320), 2.0), camera_of(MIN_IMAGE_SIDE, 320))
    assert detection.rejections
    assert "min_image_side" not in {rejection.rule for rejection in detection.rejections}


@pytest.mark.parametrize("method", sorted(METHODS))
@pytest.mark.parametrize("up", [None, (0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
@pytest.mark.parametrize("kind", ["nothing", "one pixel", "one row", "all equal", "noise", "tiny", "huge"])
def test_an_image_without_a_scene_says_why_there_are_no_stairs(
    method: str, up: tuple[float, float, float] | None, kind: str
) -> None:
    image = np.full((240, 320), np.nan)
    if kind == "one pixel":
        image[100, 100] = 2.0
    elif kind == "one row":
        image[100] = 2.0
    elif kind == "noise":
        image = np.random.default_rng(0).uniform(0.3, 5.0, image.shape)
    elif kind != "nothing":
        image[:] = {"all equal": 2.0, "tiny": 1e-30, "huge": 1e30}[kind]
    detection = detect(image, KINECT_CAMERA, up=up, method=method)
    assert not detection
    assert detection.rejections


def test_an_unknown_method_is_a_config_error_that_names_the_known_ones() -> None:
    for make in (make_detector, make_modeler):
        with pytest.raises(ConfigError, match=r"nonsense.*delmerico2013.*stairmap"):
            make(method="nonsense")


def test_the_configuration_reaches_the_detector(depth: Float64Array) -> None:
    config = Config.model_validate({"detection": {"min_steps": 9}})
    assert detect(depth, KINECT_CAMERA, up=UP)
    assert not detect(depth, KINECT_CAMERA, up=UP, config=config)


def test_a_method_is_imported_when_it_is_used() -> None:
    script = "import sys, stairmap.pipeline\nprint(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert "stairmap.detection.detector" not in loaded.split()
    assert "stairmap.delmerico2013.detector" not in loaded.split()
    assert "stairmap.modeling.mapper" not in loaded.split()
