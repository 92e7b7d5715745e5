"""What one frame says, and how it stands in detections.jsonl."""

from __future__ import annotations

import json
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from stairmap.detection.observation import Detection, Rejection, StairEdge, StairObservation


def make_edge(step_index: int, **changes: object) -> StairEdge:
    nosing = np.array([[-0.6, 0.4 - 0.17 * step_index, 1.5], [0.6, 0.4 - 0.17 * step_index, 1.5]])
    values = {
        "nosing": nosing,
        "step_index": step_index,
        "left_bounded": True,
        "right_bounded": False,
        "cue": "crease",
        "num_pixels": 200,
    }
    return StairEdge(**{**values, **changes})  # type: ignore[arg-type]


def make_observation(indices: tuple[int, ...] = (0, 1, 2)) -> StairObservation:
    return StairObservation(
        stamp_ns=12,
        view="ascending",
        up=np.array([0.0, -1.0, 0.0]),
        forward=np.array([0.0, 0.0, 1.0]),
        edges=tuple(make_edge(index) for index in indices),
        rise=0.1700001234,
        run=0.28,
        width=1.2,
        origin=np.array([0.0, 0.4, 1.5]),
        covariance=np.eye(6) * 1e-6,
        points=np.zeros((0, 3)),
    )


def test_num_steps_counts_the_missed_ones_between() -> None:
    assert make_observation((0, 1, 2)).num_steps == 3
    assert make_observation((0, 2, 5)).num_steps == 6
    assert make_observation(()).num_steps == 0


def test_pitch_is_that_of_rise_over_run() -> None:
    assert make_observation().pitch == pytest.approx(np.arctan2(0.17, 0.28), abs=1e-6)


def test_arrays_of_an_observation_are_read_only() -> None:
    observation = make_observation()
    for array in (observation.up, observation.origin, observation.edges[0].nosing):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(FrozenInstanceError):
        observation.rise = 0.2  # type: ignore[misc]


def test_the_line_of_a_detection_is_the_contract() -> None:
    detection = Detection(stamp_ns=12, observations=(make_observation((0, 2)),), rejections=())
    line = json.loads(json.dumps(detection.to_dict(), allow_nan=False))
    assert set(line) == {"stamp_ns", "detected", "observations", "rejections", "camera_height", "drops"}
    assert (line["camera_height"], line["drops"]) == (None, [])
    assert (line["stamp_ns"], line["detected"], line["rejections"]) == (12, True, [])
    (observation,) = line["observations"]
    assert set(observation) == {"view", "rise", "run", "width", "num_steps", "edges"}
    assert observation["view"] == "ascending"
    assert (observation["rise"], observation["run"], observation["width"]) == (0.17, 0.28, 1.2)
    assert observation["num_steps"] == 3
    assert np.array(observation["edges"]).shape == (2, 2, 3)
    np.testing.assert_allclose(observation["edges"][1], [[-0.6, 0.06, 1.5], [0.6, 0.06, 1.5]])


def test_the_line_of_a_frame_without_stairs_says_why() -> None:
    rejection = Rejection(rule="min_steps", measured=np.float64(2), limit=3, unit="1")
    detection = Detection(stamp_ns=5, observations=(), rejections=(rejection,))
    assert not detection
    line = json.loads(json.dumps(detection.to_dict(), allow_nan=False))
    assert line["detected"] is False
    assert line["rejections"] == [{"rule": "min_steps", "measured": 2.0, "limit": 3.0, "unit": "1"}]


def test_what_could_not_be_measured_is_null_in_json_and_nothing_in_words() -> None:
    rejection = Rejection(rule="up_from_floor", measured=float("nan"), limit=0.1, unit="1")
    assert json.loads(json.dumps(rejection.to_dict(), allow_nan=False))["measured"] is None
    assert str(rejection) == "up_from_floor: nothing, limit 0.1"


def test_a_rejection_reads_with_its_unit() -> None:
    rejection = Rejection(rule="max_rise", measured=0.31234, limit=0.26, unit="m")
    assert str(rejection) == "max_rise: 0.3123 m, limit 0.26 m"
