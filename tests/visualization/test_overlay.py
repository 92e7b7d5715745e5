from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from flight_views import CAMERA, View

from stairmap.camera import PinholeCamera
from stairmap.detection.drops import DropEdge
from stairmap.detection.ground import GroundView
from stairmap.detection.observation import Detection, StairEdge
from stairmap.frame import DepthFrame
from stairmap.visualization.overlay import (
    MIN_PICTURE_WIDTH,
    OBSERVATION_COLORS,
    TRACE_PANEL_WIDTH,
    colorize_depth,
    describe_detection,
    draw_detection,
    draw_trace,
    picture_scale,
    png_from_image,
)


def with_one_edge(view: View, edge: StairEdge) -> Detection:
    observation = replace(view.detection.observations[0], edges=(edge,))
    return replace(view.detection, observations=(observation,))


def known_edge(*, right_bounded: bool = True) -> StairEdge:
    """A nosing that projects onto pixels (87, 119.5) and (232, 119.5)."""
    nosing = [[-0.5, 0.0, 2.0], [0.5, 0.0, 2.0]]
    return StairEdge(
        nosing=nosing, step_index=0, left_bounded=True, right_bounded=right_bounded, cue="jump", num_pixels=9
    )


def test_a_nosing_is_drawn_where_it_projects(views: list[View]) -> None:
    picture = draw_detection(views[0].frame, with_one_edge(views[0], known_edge()))
    scale = picture_scale(CAMERA)
    (u, v) = (np.array([150.0, 119.5]) + 0.5) * scale - 0.5
    np.testing.assert_array_equal(picture[round(v), round(u)], OBSERVATION_COLORS[0])
    plain = draw_detection(views[0].frame, replace(views[0].detection, observations=()))
    assert not np.array_equal(plain[round(v), round(u)], OBSERVATION_COLORS[0])
    outside = picture[round(v), round((260 + 0.5) * scale)]
    np.testing.assert_array_equal(outside, plain[round(v), round((260 + 0.5) * scale)])


def test_bounded_and_unbounded_ends_look_different(views: list[View]) -> None:
    bounded = draw_detection(views[0].frame, with_one_edge(views[0], known_edge()))
    cut = draw_detection(views[0].frame, with_one_edge(views[0], known_edge(right_bounded=False)))
    changed = np.argwhere((bounded != cut).any(axis=2))
    center = np.array([119.5, 232.0]) * 2
    assert len(changed)
    assert np.abs(changed - center).max() < 16


def test_an_edge_behind_the_camera_or_far_outside_is_no_harm(views: list[View]) -> None:
    for nosing in ([[0, 0, -1], [1, 0, 2]], [[-1e9, 0, 1], [1e9, 0, 1]]):
        draw_detection(views[0].frame, with_one_edge(views[0], replace(known_edge(), nosing=nosing)))


def test_small_frames_are_enlarged_and_large_ones_left(views: list[View]) -> None:
    assert draw_detection(views[0].frame, views[0].detection).shape[1] == MIN_PICTURE_WIDTH
    camera = PinholeCamera(width=848, height=480, fx=400, fy=400, cx=420, cy=240)
    frame = DepthFrame(stamp_ns=0, depth=np.ones((480, 848)), camera=camera)
    assert draw_detection(frame, views[0].detection).shape[1] == 848


def test_invalid_depth_is_black_and_near_differs_from_far() -> None:
    depth = np.array([[1.0, 2.0, np.nan]], dtype=np.float32)
    near, far, invalid = colorize_depth(depth)[0]
    assert not invalid.any()
    assert far.astype(int).sum() > near.astype(int).sum()
    assert not colorize_depth(np.full((2, 2), np.nan, dtype=np.float32)).any()


def test_an_image_without_any_depth_can_be_drawn(rejected: Detection) -> None:
    frame = DepthFrame(stamp_ns=0, depth=np.full((240, 320), np.nan), camera=CAMERA)
    assert draw_detection(frame, rejected).any()


def test_the_measures_are_written_or_the_first_reasons(views: list[View], rejected: Detection) -> None:
    (line,) = describe_detection(views[0].detection)
    assert "9 steps: rise 166 mm, run 289 mm, width 1.15 m, pitch 29.9 deg" in line
    assert describe_detection(rejected) == [
        "no stairway",
        "min_steps: 2, limit 3",
        "max_rise: 0.45 m, limit 0.26 m",
        "min_width: 0.31 m, limit 0.5 m  (and 1 more)",
    ]
    assert describe_detection(replace(rejected, rejections=())) == ["no stairway"]


def test_the_trace_of_the_reports_method_has_four_panels_side_by_side(views: list[View]) -> None:
    picture = draw_trace(views[0].frame, views[0].detection)
    assert 4 * TRACE_PANEL_WIDTH < picture.shape[1] < 4 * TRACE_PANEL_WIDTH + 20


def test_the_trace_of_a_detection_without_one_is_refused(views: list[View]) -> None:
    with pytest.raises(ValueError, match="trace=True"):
        draw_trace(views[0].frame, replace(views[0].detection, trace=None))


def test_png_comes_back_as_the_picture(views: list[View]) -> None:
    picture = draw_detection(views[0].frame, views[0].detection)
    content = np.frombuffer(png_from_image(picture), dtype=np.uint8)
    np.testing.assert_array_equal(cv2.imdecode(content, cv2.IMREAD_COLOR), picture)


def test_an_edge_of_the_ground_is_drawn_where_it_is_and_told() -> None:
    edge = DropEdge(edge=[[-0.5, 0.5, 2.0], [0.5, 0.5, 2.0]], depth=0.4, num_rays=9)
    ground = GroundView(
        height=0.5, up=[0, -1, 0], forward=[0, 0, 1], bearing=np.linspace(0.5, -0.5, 9),
        is_seen=np.zeros((9, 32), dtype=bool),
    )  # fmt: skip
    frame = DepthFrame(
        stamp_ns=0, depth=np.full((CAMERA.height, CAMERA.width), 2.0, np.float32), camera=CAMERA
    )
    nothing = Detection(stamp_ns=0, observations=(), rejections=(), ground=ground)
    found = replace(nothing, drops=(edge,))
    height = CAMERA.height * picture_scale(CAMERA)
    changed = (draw_detection(frame, found)[:height] != draw_detection(frame, nothing)[:height]).any(axis=2)
    rows, columns = np.nonzero(changed)
    ends = CAMERA.scaled(picture_scale(CAMERA)).project(edge.edge)
    assert (columns.min(), columns.max()) == pytest.approx(sorted(ends[:, 0]), abs=6)
    # The teeth point away from the camera, up in the picture.
    assert rows.max() == pytest.approx(ends[0, 1], abs=5)
    assert rows.min() < ends[0, 1] - 5
    assert (
        describe_detection(found)[0] == "the ground ends 2.06 m from the camera, at least 0.40 m deep (red)"
    )
    assert describe_detection(nothing)[0] == "no stairway"
