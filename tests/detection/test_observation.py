"""What one frame says, and how it stands in detections.jsonl."""

from __future__ import annotations

import json
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from stairmap.detection.drops import DropEdge
from stairmap.detection.ground import GroundView
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


def test_lines_hold_rise_and_run_to_a_hundredth_and_places_to_a_tenth_of_a_millimetre() -> None:
    odd = np.array([[-0.123456, 0.234567, 1.345678], [0.456789, 0.567891, 1.678912]])
    observation = replace(
        make_observation(), rise=0.1234567, run=0.2345678, width=1.3456789, edges=(make_edge(0, nosing=odd),)
    )
    view = GroundView(
        height=0.7654321, up=[0, -1, 0], forward=[0, 0, 1], bearing=[0.5, -0.5],
        is_seen=np.zeros((2, 32), dtype=bool),
    )  # fmt: skip
    drops = DropEdge(edge=odd, depth=0.3456789, num_rays=7), DropEdge(edge=odd, depth=np.nan, num_rays=7)
    detection = Detection(
        stamp_ns=1, observations=(observation,), rejections=(), ground=view, drops=drops[:1], voids=drops[1:]
    )
    line = detection.to_dict()
    (values,) = line["observations"]
    assert (values["rise"], values["run"], values["width"]) == (0.12346, 0.23457, 1.34568)
    assert values["edges"] == [[[-0.1235, 0.2346, 1.3457], [0.4568, 0.5679, 1.6789]]]
    assert line["camera_height"] == 0.7654
    assert line["drops"] == [
        {"edge": [[-0.1235, 0.2346, 1.3457], [0.4568, 0.5679, 1.6789]], "depth": depth}
        for depth in (0.3457, None)
    ]


def test_what_a_method_does_not_tell_is_empty_unseen_or_unknown() -> None:
    observation = make_observation()
    assert observation.rise_information.shape == (0, 0)
    assert not observation.floor_seen
    assert not observation.top_seen
    assert observation.overhang == 0.0
    assert np.isnan(observation.overhang_std)
    assert np.isnan(observation.edges[0].std).tolist() == [True, True]
    detection = Detection(stamp_ns=1, observations=(), rejections=())
    assert (detection.trace, detection.ground, detection.drops, detection.voids) == (None, None, (), ())


@pytest.mark.parametrize(
    ("measured", "unit", "text"),
    [(0.123456, "m", "max_rise: 0.1235 m, limit 0.25 m"), (np.nan, "1", "max_rise: nothing, limit 0.25")],
)
def test_a_rejection_is_told_with_four_digits(measured: float, unit: str, text: str) -> None:
    rejection = Rejection(rule="max_rise", measured=measured, limit=0.25, unit=unit)
    assert str(rejection) == text
    assert Rejection(rule="a", measured=1 / 3, limit=1, unit="1").to_dict()["measured"] == 0.333333


@pytest.mark.parametrize(
    ("edge", "distance"),
    [
        ([[1.0, 0.5, 0.0], [1.0, -0.5, 0.0]], 1.0),
        ([[1.0, 0.5, 0.0], [1.0, 0.25, 0.0]], np.hypot(1.0, 0.25)),
        ([[3.0, -0.5, 4.0], [3.0, -2.5, 4.0]], np.sqrt(25.25)),
        ([[3.0, 0.0, 4.0], [3.0, 0.0, 4.0]], 5.0),
    ],
    ids=["its middle", "its right end", "its left end", "a point"],
)
def test_an_edge_is_as_far_as_its_nearest_point(edge: list[list[float]], distance: float) -> None:
    assert DropEdge(edge=np.array(edge), depth=0.5, num_rays=5).distance == pytest.approx(distance)
