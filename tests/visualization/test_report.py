from __future__ import annotations

import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from flight_views import View

from stairmap.config import Config, dump_config
from stairmap.detection.observation import Detection
from stairmap.errors import MissingPackageError
from stairmap.frame import DepthFrame
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap.visualization.collecting import (
    MAX_FRAMES_KEPT,
    MAX_NOSINGS_KEPT,
    ReportCollector,
    ThinnedSequence,
)
from stairmap.visualization.report import ReportData, render_report, report_data

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")


@pytest.fixture
def collector(views: list[View], rejected: Detection, stairway: Stairway) -> ReportCollector:
    collector = ReportCollector()
    for view in views:
        collector.add(view.frame, view.detection, view.map_from_camera)
        if collector.convergence.is_due(collector.num_observations):
            count = collector.num_observations
            collector.convergence.add([replace(stairway, num_observations=count)], count)
    for _ in range(3):
        collector.add(views[0].frame, rejected, views[0].map_from_camera)
    return collector


def gather(
    collector: ReportCollector, stairways: list[Stairway], trajectory: Trajectory | None, **more: object
) -> ReportData:
    return report_data(
        collector, recording_name="hall <1>", method="stairmap", stairways=stairways, trajectory=trajectory,
        config_yaml=dump_config(Config()), **more,  # type: ignore[arg-type]
    )  # fmt: skip


def test_the_report_is_self_contained(
    collector: ReportCollector, stairway: Stairway, turning_stairway: Stairway, trajectory: Trajectory
) -> None:
    html = render_report(gather(collector, [stairway, turning_stairway], trajectory))
    assert not re.search(r"https?:|file:|<script|<link|@import|url\(", html)
    sources = re.findall(r'src="([^"]*)"', html)
    assert len(sources) >= 8
    assert all(source.startswith("data:image/png;base64,iVBOR") for source in sources)


def test_the_report_shows_measures_problems_reasons_config_and_version(
    collector: ReportCollector, stairway: Stairway, trajectory: Trajectory
) -> None:
    problems = ["depth/12.png is truncated & skipped"]
    html = render_report(gather(collector, [stairway], trajectory, problems=problems))
    for text in (
        "165 ± 2", "hall &lt;1&gt;", "is truncated &amp; skipped", "min_steps", "max_depth: 6.0",
        "stairmap 0.", "frame 0, 0.000 s", "frame 11, 1.100 s", "How its measures settled",
    ):  # fmt: skip
        assert text in html


def test_a_report_without_stairways_says_so_and_why(views: list[View], rejected: Detection) -> None:
    collector = ReportCollector()
    for view in views[:5]:
        collector.add(view.frame, replace(rejected, rejections=rejected.rejections[:1]))
    collector.add(views[0].frame, rejected)
    html = render_report(gather(collector, [], None))
    assert "No stairway was found." in html
    assert re.search(r"Most frequent reason: <b>min_steps</b> in 6 of 6 frames", html)
    assert "typically 2, the limit is 3" in html
    assert "Frames without" in html


def test_a_report_of_nothing_at_all_still_renders() -> None:
    html = render_report(gather(ReportCollector(), [], None))
    assert "has no frame that could be used" in html


def test_edges_without_a_confirmed_stairway_are_told_apart_from_no_edges(collector: ReportCollector) -> None:
    assert "Stair edges were seen in 12 of 15 frames" in render_report(gather(collector, [], None))


def test_the_report_is_the_same_bit_for_bit(
    collector: ReportCollector, stairway: Stairway, trajectory: Trajectory
) -> None:
    data = gather(collector, [stairway], trajectory)
    assert render_report(data) == render_report(data)


def test_missing_jinja2_names_the_extra(collector: ReportCollector, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(MissingPackageError, match=r"stairmap\[report\]"):
        render_report(gather(collector, [], None))


def test_rules_are_counted_once_per_frame_without_edges(views: list[View], rejected: Detection) -> None:
    collector = ReportCollector()
    twice = replace(rejected, rejections=rejected.rejections[:1] * 2 + rejected.rejections[3:])
    for _ in range(4):
        collector.add(views[0].frame, twice)
    collector.add(views[0].frame, replace(views[0].detection, rejections=rejected.rejections))
    first, second = collector.rule_statistics()
    assert (first.rule, first.num_frames, first.measured, first.limit) == ("min_steps", 4, 2, 3)
    assert (second.rule, second.num_frames) == ("up", 4)
    assert np.isnan(second.measured)
    assert str(first) == "4 frames: min_steps: 2, limit 3 (median)"


def test_the_collector_keeps_a_bounded_number_of_everything(views: list[View]) -> None:
    collector = ReportCollector()
    for _ in range(100):
        for view in views:
            collector.add(view.frame, view.detection, view.map_from_camera)
    assert collector.num_frames == collector.num_detections == 1200
    assert len(collector.observed_nosings()) <= MAX_NOSINGS_KEPT
    examples = collector.example_frames()
    assert [example.frame_index for example in examples][:: len(examples) - 1] == [0, 1199]
    assert len(examples) == 3


def test_examples_look_again_only_at_frames_without_a_trace(views: list[View]) -> None:
    seen: list[DepthFrame] = []

    class Detector:
        def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
            assert trace
            seen.append(frame)
            return views[0].detection

    collector = ReportCollector()
    bare = DepthFrame(stamp_ns=0, depth=views[0].frame.depth, camera=views[0].frame.camera)
    collector.add(bare, replace(views[0].detection, trace=None), views[0].map_from_camera)
    (example,) = collector.example_frames(Detector())
    assert example.trace_png is not None
    assert seen[0].up is not None
    assert collector.example_frames()[0].trace_png is None


def test_a_thinned_sequence_is_evenly_spread_and_bounded() -> None:
    sequence: ThinnedSequence[int] = ThinnedSequence(MAX_FRAMES_KEPT)
    for number in range(1000):
        sequence.append(number)
    kept = sequence.items()
    assert MAX_FRAMES_KEPT // 2 <= len(kept) <= MAX_FRAMES_KEPT
    assert kept[0] == 0
    assert len(set(np.diff(kept).tolist())) == 1
    assert kept[-1] >= 800
