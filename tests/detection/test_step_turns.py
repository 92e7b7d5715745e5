"""Steps that are turned against each other are no straight flight."""

from __future__ import annotations

import numpy as np
import pytest

from solid_scenes import frame_of, pose_towards
from stairmap.config import Config
from stairmap.detection.detector import StairEdgeDetector
from stairmap.detection.observation import Detection
from stairmap.simulation.triangle_mesh import TriangleMesh, make_rectangle, make_turned_block


def steps_turned_by(angles_deg: list[float]) -> list[TriangleMesh]:
    """Steps of 0.17 m by 0.28 m, the front of each turned about its middle."""
    steps = []
    for k, angle in enumerate(np.radians(angles_deg)):
        height = 0.17 * (k + 1)
        center = (0.28 * k + np.cos(angle), np.sin(angle), height / 2)
        steps.append(make_turned_block(center, (2.0, 1.2, height), angle))
    return steps


def detect(angles_deg: list[float], *, height: float = 1.2) -> Detection:
    floor = make_rectangle((-9, -9), (9, 9), 0.0)
    pose = pose_towards((0.5, 0.0, 0.4), distance=1.8, height=height)
    return StairEdgeDetector(Config()).detect(frame_of([*steps_turned_by(angles_deg), floor], pose))


def test_steps_that_are_not_turned_are_a_flight() -> None:
    detection = detect([0.0] * 6)
    assert [observation.num_steps for observation in detection.observations] == [6]


@pytest.mark.parametrize("growth_deg", [6.0, 9.0, -9.0, 13.0])
@pytest.mark.parametrize("height", [0.6, 1.2])
def test_winders_are_none(growth_deg: float, height: float) -> None:
    detection = detect([growth_deg * (k - 2.5) for k in range(6)], height=height)
    assert not detection.observations


def test_a_single_turned_step_is_left_out() -> None:
    detection = detect([0.0, 0.0, 0.0, 0.0, 0.0, 20.0])
    assert [observation.num_steps for observation in detection.observations] == [5]
