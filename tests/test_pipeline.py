"""The pipeline runs every method through one protocol."""

from __future__ import annotations

import json

import numpy as np
import pytest

from analytic_stairs import AnalyticStairs, pose_looking
from solid_scenes import frame_of, room, stairs_solid
from stairmap.config import Config
from stairmap.errors import ConfigError, TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.pipeline import METHODS, StairwayPipeline
from stairmap.simulation.triangle_mesh import joined
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory

MS = 1_000_000
STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
SCENE = joined([stairs_solid(STAIRS), room()])
# Below the nosings, so that the report's method sees them too.
POSES = [pose_looking((-1.9 + 0.04 * index, 0.1, 0.35), yaw=-0.02, down=-0.05) for index in range(12)]


@pytest.fixture(scope="module")
def frames() -> list[DepthFrame]:
    return [
        frame_of([SCENE], pose, stamp_ns=index * 100 * MS, has_up=False) for index, pose in enumerate(POSES)
    ]


def run(frames: list[DepthFrame], method: str = "stairmap") -> StairwayPipeline:
    pipeline = StairwayPipeline(Config(), method=method)
    for frame, pose in zip(frames, POSES, strict=True):
        pipeline.process(frame, pose)
    return pipeline


@pytest.mark.parametrize("method", sorted(METHODS))
def test_every_method_models_the_stairway_through_the_same_protocol(
    method: str, frames: list[DepthFrame]
) -> None:
    pipeline = run(frames, method)
    stairways = pipeline.stairways()
    assert len(stairways) == 1
    assert isinstance(stairways[0], Stairway)
    flight = stairways[0].flights[0]
    assert flight.rise == pytest.approx(0.17, abs=0.03)
    assert flight.run == pytest.approx(0.28, abs=0.03)
    assert abs(flight.heading) < 0.1
    again = Stairway.from_dict(json.loads(json.dumps(stairways[0].to_dict(), allow_nan=False)))
    assert again.flights[0].rise == pytest.approx(flight.rise, abs=1e-6)
    assert again.num_observations == stairways[0].num_observations


def test_the_default_method_models_it_to_millimetres(frames: list[DepthFrame]) -> None:
    (stairway,) = run(frames).stairways()
    flight = stairway.flights[0]
    assert (flight.rise, flight.run) == pytest.approx((0.17, 0.28), abs=0.003)
    assert flight.width == pytest.approx(1.2, abs=0.02)
    np.testing.assert_allclose(flight.base, 0.0, atol=0.02)
    assert flight.heading == pytest.approx(0.0, abs=0.01)
    assert flight.num_risers == 8


def test_an_unknown_method_is_a_config_error_that_names_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"nonsense.*delmerico2013.*stairmap"):
        StairwayPipeline(method="nonsense")


@pytest.mark.parametrize("method", sorted(METHODS))
def test_frames_without_up_take_it_from_the_pose(method: str, frames: list[DepthFrame]) -> None:
    pipeline = StairwayPipeline(method=method)
    with_up = StairwayPipeline(method=method)
    for frame, pose in zip(frames[:6], POSES, strict=False):
        assert frame.up is None
        own = DepthFrame(stamp_ns=frame.stamp_ns, depth=frame.depth, camera=frame.camera, up=pose[2, :3])
        taken, given = pipeline.process(frame, pose), with_up.process(own, pose)
        assert taken.to_dict() == given.to_dict()


def test_up_of_a_frame_is_kept_where_the_pose_says_otherwise(frames: list[DepthFrame]) -> None:
    # A map that is not level: +z of the map is the camera's right.
    frame = frames[-1]
    own = DepthFrame(stamp_ns=0, depth=frame.depth, camera=frame.camera, up=POSES[-1][2, :3])
    lying = np.eye(4)
    lying[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    (observation,) = StairwayPipeline().process(own, lying @ POSES[-1]).observations
    assert np.degrees(np.arccos(observation.up @ POSES[-1][2, :3])) < 1.0


def test_a_corrected_trajectory_moves_the_stairway(frames: list[DepthFrame]) -> None:
    pipeline = run(frames)
    shift = np.eye(4)
    shift[:3, 3] = [5.0, -3.0, 0.5]
    moved = Trajectory(
        stamps_ns=pipeline.trajectory().stamps_ns, map_from_camera=[shift @ pose for pose in POSES]
    )
    (here,), (there,) = pipeline.stairways(), pipeline.stairways(moved)
    np.testing.assert_allclose(there.flights[0].base, here.flights[0].base + shift[:3, 3], atol=1e-9)
    assert there.id == here.id


@pytest.mark.parametrize("method", sorted(METHODS))
def test_the_same_frames_twice_give_the_same_json_bit_for_bit(method: str, frames: list[DepthFrame]) -> None:
    def text() -> str:
        return json.dumps([stairway.to_dict() for stairway in run(frames, method).stairways()])

    assert text() == text()


def test_detections_are_returned_frame_by_frame(frames: list[DepthFrame]) -> None:
    pipeline = StairwayPipeline()
    for frame, pose in zip(frames, POSES, strict=True):
        detection = pipeline.process(frame, pose, trace=True)
        assert detection.stamp_ns == frame.stamp_ns
        assert detection.trace is not None
    assert len(pipeline.trajectory()) == len(frames)


def test_before_the_first_frame_there_are_no_stairways_and_no_trajectory() -> None:
    pipeline = StairwayPipeline()
    assert pipeline.stairways() == ()
    with pytest.raises(TrajectoryError, match="at least one"):
        pipeline.trajectory()


def test_rotating_the_map_moves_the_stairways_likewise(frames: list[DepthFrame]) -> None:
    (here,) = run(frames).stairways()
    yaw = 2.0
    other_from_map = np.eye(4)
    other_from_map[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    other_from_map[:3, 3] = [12.0, 7.0, -2.0]
    pipeline = StairwayPipeline()
    for frame, pose in zip(frames, POSES, strict=True):
        pipeline.process(frame, other_from_map @ pose)
    (there,) = pipeline.stairways()
    expected = other_from_map[:3, :3] @ here.flights[0].base + other_from_map[:3, 3]
    np.testing.assert_allclose(there.flights[0].base, expected, atol=1e-4)
    assert there.flights[0].heading == pytest.approx(here.flights[0].heading + yaw, abs=1e-5)
    assert there.flights[0].rise == pytest.approx(here.flights[0].rise, abs=1e-6)
