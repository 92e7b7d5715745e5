"""Views are shown to any detector, once rendered kept on disk, and summed up by kind."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from frame_observations import all_in_view, make_view_of, observe

from stairmap.config import Config
from stairmap.detection.detector import StairEdgeDetector
from stairmap.detection.observation import Detection, Rejection
from stairmap.evaluation import view_running as module
from stairmap.evaluation.frame_judging import ODD_LIMIT, FrameJudgement, judge_frame
from stairmap.evaluation.kind_tables import format_kinds, measure_errors, summarize_kinds, summarize_views
from stairmap.evaluation.view_running import judge_views, load_view, make_view_specs, run_views
from stairmap.frame import DepthFrame
from stairmap.simulation.kinds import KINDS, ViewSpec

SPECS = (ViewSpec(kind="overhang", index=3), ViewSpec(kind="look-alikes", index=9))


class BlindDetector:
    """Sees nothing, and says why."""

    def __init__(self, config: Config) -> None:
        self._limit = config.detection.min_steps

    def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
        rejection = Rejection(rule="min_steps", measured=0, limit=self._limit, unit="1")
        return Detection(stamp_ns=frame.stamp_ns, observations=(), rejections=(rejection,))


def test_all_kinds_have_their_views_and_a_quick_run_a_quarter() -> None:
    specs = make_view_specs()
    assert [spec.kind for spec in specs if spec.index == 0] == list(KINDS)
    assert len(specs) == len(set(specs)) == sum(kind.num_views for kind in KINDS.values())
    quick = make_view_specs(["wide"], is_quick=True, seed=4)
    assert len(quick) == 15 and {(spec.kind, spec.seed) for spec in quick} == {("wide", 4)}
    assert set(make_view_specs(["wide"], is_quick=True)) < set(specs)
    assert len(make_view_specs(["wide", "far"], num_views=3)) == 6
    with pytest.raises(ValueError, match="castle"):
        make_view_specs(["castle"])


def test_a_kept_frame_is_the_rendered_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for spec in SPECS:
        view, fresh, seen = load_view(spec)
        load_view(spec, tmp_path)
        with monkeypatch.context() as patch:
            patch.setattr(module, "take_view", lambda _: pytest.fail("rendered again"))
            _, kept, kept_seen = load_view(spec, tmp_path)
        np.testing.assert_array_equal(kept.depth, fresh.depth)
        np.testing.assert_allclose(kept.up, view.map_from_camera[2, :3], rtol=1e-12)
        assert (seen is None) == (kept_seen is None) == (view.flight is None)
        if seen is not None and kept_seen is not None:
            assert kept_seen.to_dict() == seen.to_dict()
            assert seen.riser_rows.max() > 5


def test_any_detector_is_judged_and_its_reasons_are_kept() -> None:
    seeing = judge_views(SPECS, StairEdgeDetector)
    blind = judge_views(SPECS, BlindDetector)
    assert [judgement.is_found for judgement in seeing] == [True, False]
    assert [judgement.is_missed for judgement in blind] == [True, False]
    assert all("min_steps: 0, limit 3" in judgement.rejections for judgement in blind)
    assert all(judgement.frame_ms > 0 for judgement in seeing)


def test_processes_give_the_same_judgements_in_the_same_order() -> None:
    specs = make_view_specs(["wide"], num_views=12)
    seen: list[FrameJudgement] = []
    several = run_views(specs, StairEdgeDetector, num_workers=2, on_judgements=seen.extend)
    alone = run_views(specs, StairEdgeDetector)
    assert [replace(one, frame_ms=0.0).to_dict() for one in several] == [
        replace(one, frame_ms=0.0).to_dict() for one in alone
    ]
    assert [judgement.index for judgement in seen] == list(range(12))


def judgements() -> list[FrameJudgement]:
    view = make_view_of()
    right = judge_frame(0, view, all_in_view(), [observe(view, rise=0.173)])
    wrong = judge_frame(1, view, all_in_view(), [observe(view, rise=0.161, view="descending")])
    missed = judge_frame(2, view, all_in_view(), [])
    return [right, wrong, missed, replace(missed, index=3, is_clear=False, num_false=1, group="other")]


def test_sums_count_what_the_judgements_say() -> None:
    s = summarize_views(judgements())
    assert (s.num_views, s.num_clear, s.num_found, s.num_right, s.num_missed) == (4, 3, 2, 1, 1)
    assert (s.num_view_wrong, s.num_steps_wrong, s.num_false_frames, s.num_clear_right) == (1, 0, 1, 1)
    assert (s.rise.bias, s.rise.rms) == pytest.approx((-0.003, np.sqrt((0.003**2 + 0.009**2) / 2)))
    assert (s.rise.num_beyond_3, s.overhang.num, s.overhang.rms) == (1, 2, pytest.approx(0.0))
    assert s.calibrated.num_with_std == 6
    assert (s.num_tops_shown, s.num_tops_found) == (2, 0)


def test_a_duplicate_is_false() -> None:
    view = make_view_of()
    twice = judge_frame(0, view, all_in_view(), [observe(view), observe(view)])
    assert summarize_views([twice]).num_false_frames == 1


@pytest.mark.parametrize(("oddness", "is_called_odd"), [(ODD_LIMIT - 1e-4, False), (ODD_LIMIT + 1e-4, True)])
@pytest.mark.parametrize("is_odd", [False, True])
def test_an_odd_riser_is_told_by_its_difference_from_the_median(
    oddness: float, is_called_odd: bool, is_odd: bool
) -> None:
    view = replace(make_view_of(), kind="irregular", group="one riser odd" if is_odd else "regular")
    s = summarize_views([judge_frame(0, view, all_in_view(), [observe(view, lift={4: oddness})])])
    assert (s.num_odd_judged, s.num_odd_told) == (1, int(is_odd == is_called_odd))


@pytest.mark.parametrize(("lift", "num_close"), [(0.0039, 4), (0.0041, 2)])
def test_single_risers_are_close_within_four_millimetres(lift: float, num_close: int) -> None:
    view = make_view_of()
    s = summarize_views([judge_frame(0, view, all_in_view(), [observe(view, lift={2: lift})])])
    assert (s.num_risers_close, s.riser_heights.num, s.riser_heights.num_with_std) == (num_close, 4, 4)


def test_statistics_leave_out_what_was_not_measured() -> None:
    errors = measure_errors([0.003, -0.001, float("nan"), 0.004], [0.001, 0.002, 0.1, float("nan")])
    assert (errors.num, errors.num_with_std, errors.num_beyond_3) == (3, 2, 0)
    assert (errors.worst, errors.mean_abs) == pytest.approx((0.004, 0.008 / 3))
    assert (errors.share_within_1, errors.share_within_2) == pytest.approx((0.5, 0.5))
    assert np.isnan(measure_errors([], []).rms)


def test_tables_have_a_line_for_each_kind_and_group() -> None:
    look_alike = FrameJudgement(
        kind="look-alikes", group="kerb", index=0, sensor="d435", width=320, num_false=1, num_duplicates=0
    )
    quiet = replace(look_alike, group="ramp", num_false=0)
    table = format_kinds("today", [*judgements(), look_alike, quiet])
    names = [line.split("|")[1].strip() for line in table.splitlines()]
    assert names[0] == "today"
    assert names[2:] == ["overhang", "· 30 mm", "· other", "look-alikes", "· kerb"]
    cells = [cell.strip() for cell in table.splitlines()[2].split("|")]
    assert cells[2:9] == ["4", "3", "2", "1", "33 %", "1", "1"]
    data = json.loads(json.dumps(summarize_kinds(judgements()), allow_nan=False))
    assert data["overhang"]["groups"]["other"]["rise"]["rms"] is None
