from __future__ import annotations

import pytest

from analytic_stairs import render_frame
from delmerico2013.test_detector import POSE, STAIRS, staggered_bars
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.delmerico2013.detector import Delmerico2013Detector


@pytest.fixture(scope="module")
def detector() -> Delmerico2013Detector:
    return Delmerico2013Detector(Config())


@pytest.mark.parametrize(("width", "height"), [(160, 120), (321, 243), (512, 424), (849, 479)])
def test_trace_has_the_size_of_any_frame(detector: Delmerico2013Detector, width: int, height: int) -> None:
    camera = PinholeCamera(
        width=width, height=height, fx=0.82 * width, fy=0.82 * width, cx=width / 2, cy=height / 2
    )
    trace = detector.detect(render_frame(STAIRS, POSE, camera=camera, wall_at=6), trace=True).trace
    assert trace is not None
    assert trace.edge_pixels.any()
    for mask in (trace.edge_pixels, trace.tread_pixels, trace.riser_pixels):
        assert mask.shape == (height, width)
    assert not trace.tread_pixels.any()
    assert not trace.riser_pixels.any()
    assert (trace.candidate_lines[:, [0, 2]] < width).all()
    assert (trace.candidate_lines[:, [1, 3]] < height).all()


def test_trace_is_made_on_demand_only_and_a_rejected_frame_has_no_accepted_lines(
    detector: Delmerico2013Detector,
) -> None:
    frame = staggered_bars()
    assert detector.detect(frame).trace is None
    trace = detector.detect(frame, trace=True).trace
    assert trace is not None
    assert len(trace.candidate_lines) >= 6
    assert trace.accepted_lines.shape == (0, 4)
