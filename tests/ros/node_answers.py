"""What the node's answers must be."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.stairway import Flight


def assert_is_the_stairway(outcome: dict[str, Any], true: Flight) -> dict[str, Any]:
    """The one stairway of an outcome is the true one; return its flight."""
    (stairway,) = outcome["stairways"]
    assert (stairway["id"], stairway["frame_id"]) == (1, "map")
    (flight,) = stairway["flights"]
    assert abs(flight["rise"] - true.rise) < 0.005
    assert abs(flight["run"] - true.run) < 0.006
    assert abs(flight["width"] - true.width) < 0.04
    assert flight["num_risers"] == flight["num_steps"] == true.num_risers
    assert abs(flight["heading"] - true.heading) < np.radians(1.5)
    np.testing.assert_allclose(flight["base"], true.base, atol=0.04)
    covariance = np.reshape(flight["covariance"], (4, 4))
    assert 0.0005 < np.sqrt(covariance[0, 0]) < 0.01
    assert (np.linalg.eigvalsh(covariance) > -1e-12).all()
    position_std = np.sqrt(np.diag(np.reshape(flight["pose_covariance"], (6, 6))))
    assert (position_std[:3] > 0).all()
    assert 0 < position_std[5] < np.radians(3.0)
    return dict(flight)


def assert_markers_show(markers: list[dict[str, Any]], flight: dict[str, Any], num_risers: int) -> None:
    """Nosings, box and label are there once each, where the flight is."""
    assert sorted(marker["ns"] for marker in markers) == ["box", "label", "nosings"]
    assert {marker["frame_id"] for marker in markers} == {"map"}
    by_name = {marker["ns"]: marker for marker in markers}
    points = np.array(by_name["nosings"]["points"]).reshape(-1, 2, 3)
    assert len(points) == num_risers
    np.testing.assert_allclose(np.linalg.norm(points[:, 0] - points[:, 1], axis=1), flight["width"])
    np.testing.assert_allclose(points[0, :, 2], flight["base"][2] + flight["rise"])
    np.testing.assert_allclose(by_name["box"]["position"], flight["box_center"])
    np.testing.assert_allclose(by_name["box"]["scale"], flight["box_size"])
    assert f"rise {flight['rise'] * 1e3:.0f} ± " in by_name["label"]["text"]


def num_observations_in(file: Path) -> int:
    """Number of observations of the first stairway in a map file's JSON."""
    if not file.exists():
        return 0
    stairways = json.loads(file.read_text())["stairways"]
    return int(stairways[0]["num_observations"]) if stairways else 0


def assert_planner_knows(heard: dict[str, Any], true: Flight) -> None:
    """A Spot may climb the stairs: they are a portal, and neither obstacle nor forbidden."""
    assert heard["robot"]
    (portal,) = heard["portals"]
    assert portal["stairway"] == 1
    assert portal["verdict"] == 1, portal
    assert portal["limiting"].startswith("flight 1: ")
    assert all(cost > 10.0 for cost in portal["costs"])
    lower = true.base - 0.6 * true.forward
    np.testing.assert_allclose(portal["lower"], lower, atol=0.06)
    np.testing.assert_allclose(heard["staging"][0], portal["lower"])
    assert [floor["id"] for floor in heard["floors"]] == [0, 1]
    assert portal["floors"] == [0, 1]
    assert abs(heard["floors"][0]["height"]) < 0.03
    assert heard["current_floor"] == 0
    assert heard["obstacles"] == []
    assert len(heard["first_obstacles"]) > 10
    assert heard["masks"]["current"]["forbidden"] == []
