"""The picture of the default method's steps shows what the detector counted and fitted."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from analytic_stairs import AnalyticStairs, pose_looking
from solid_scenes import frame_of, pose_towards, room, stairs_solid
from stairmap.detection.judgement import Case
from stairmap.detection.observation import Detection
from stairmap.frame import DepthFrame
from stairmap.pipeline import make_detector
from stairmap.simulation.triangle_mesh import make_block
from stairmap.visualization.detection_steps import draw_steps, trace_png
from stairmap.visualization.profile_panels import MAX_RESIDUAL, sort_rays

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=5)
BELOW = pose_towards((0.5, 0.0, 0.4), distance=1.2, height=0.9)
ABOVE = pose_looking((5 * 0.28 + 0.4, 0.0, 5 * 0.17 + 1.2), yaw=np.pi, down=0.8)


def detected(
    *solids: object, pose: np.ndarray = BELOW, method: str = "stairmap"
) -> tuple[DepthFrame, Detection]:
    frame = frame_of([room(), *solids], pose)
    return frame, make_detector(method=method).detect(frame, trace=True)


def case_of(detection: Detection) -> Case:
    assert detection.trace is not None and detection.trace.steps is not None
    assert detection.trace.steps.case is not None
    return detection.trace.steps.case


def texts_of(figure) -> str:
    figures = [figure, *figure.subfigs]
    axes = [axes for part in figures for axes in part.axes]
    texts = [text.get_text() for item in axes for text in (*item.texts, item.title, item.xaxis.label)]
    return "\n".join([figure.get_suptitle(), *texts])


@pytest.mark.parametrize("pose", [BELOW, ABOVE], ids=["below", "above"])
def test_measures_of_the_fit_are_written_on_the_picture(pose: np.ndarray) -> None:
    frame, detection = detected(stairs_solid(STAIRS), pose=pose)
    profile = case_of(detection).fitted.profile
    text = texts_of(draw_steps(frame, detection))
    assert f"rise {profile.rise * 1e3:.1f} ±" in text
    assert f"run {abs(profile.run) * 1e3:.1f} ±" in text
    assert f"width {case_of(detection).width:.3f} m" in text
    assert "rms of the rays on the profile" in text
    assert f"{detection.observations[0].view}, " in text


def test_exact_rays_lie_on_the_profile_and_a_box_before_it_is_nearer() -> None:
    case = case_of(detected(stairs_solid(STAIRS))[1])
    clear = sort_rays(case)
    measured = np.count_nonzero(clear.inverse_distance)
    assert np.count_nonzero(clear.is_on) > 0.8 * measured
    # Rays this flat meet the landing edge on, where a millimetre of height is half a metre of distance.
    is_steep = clear.slope < -0.02
    assert np.count_nonzero(is_steep) > 0.9 * measured
    assert not clear.is_nearer[is_steep].any()
    box = make_block([-0.3, -0.1, 0.0], [-0.2, 0.1, 0.5])
    hidden = sort_rays(case_of(detected(stairs_solid(STAIRS), box)[1]))
    assert np.count_nonzero(hidden.is_nearer) > 20
    # What hides a step lies before it: less far along the surface's normal than predicted.
    assert (hidden.residual[hidden.is_nearer] < 0).all()


def test_each_measured_ray_is_of_one_class_and_the_others_of_none() -> None:
    rays = sort_rays(case_of(detected(stairs_solid(STAIRS))[1]))
    count = sum(chosen.astype(int) for chosen, *_ in rays.classes)
    np.testing.assert_array_equal(count, rays.inverse_distance > 0)


def test_what_is_far_behind_stands_at_the_border_of_the_residuals() -> None:
    frame, detection = detected(stairs_solid(STAIRS))
    figure = draw_steps(frame, detection)
    (residuals,) = (item for item in figure.subfigs[1].axes if "measured − predicted" in item.get_ylabel())
    values = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in residuals.lines[:4]])
    assert np.abs(values).max() <= 1e3 * MAX_RESIDUAL


def test_each_step_has_a_bar_and_a_verdict() -> None:
    frame, detection = detected(stairs_solid(STAIRS))
    evidence = case_of(detection).evidence
    text = texts_of(draw_steps(frame, detection))
    for total in evidence.on + evidence.nearer + evidence.farther + evidence.unmeasured:
        assert f"seen\n{total} rays" in text


def test_a_frame_without_corners_that_repeat_shows_its_scans_and_says_so() -> None:
    frame, detection = detected()
    assert not detection
    text = texts_of(draw_steps(frame, detection))
    assert "no stairway; min_steps: 0, limit 3" in text
    assert "no profile" in text
    assert "scans along the heading" in text


def test_the_reports_method_keeps_its_panels(tmp_path) -> None:
    frame, detection = detected(stairs_solid(STAIRS), method="delmerico2013")
    with pytest.raises(ValueError, match="no steps of the default method"):
        draw_steps(frame, detection)
    picture = cv2.imdecode(np.frombuffer(trace_png(frame, detection), dtype=np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape[1] > 4 * 480


def test_without_a_trace_there_is_nothing_to_draw() -> None:
    frame, detection = detected(stairs_solid(STAIRS))
    with pytest.raises(ValueError, match="trace=True"):
        trace_png(frame, replace(detection, trace=None))


def test_the_same_frame_gives_the_same_picture() -> None:
    frame, detection = detected(stairs_solid(STAIRS))
    assert trace_png(frame, detection) == trace_png(frame, detection)
