"""A lifecycle manager starts and stops the node; services save, load and clear its map."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import pytest
from node_answers import assert_is_the_stairway, num_observations_in
from ros_environment import Drive, RosEnvironment

pytestmark = pytest.mark.usefixtures("wheels")

CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE = 1, 2, 3, 4


def change(transition: int) -> dict[str, Any]:
    """Order a transition, as a lifecycle manager does."""
    return {
        "mode": "call",
        "service": "/stairmap/change_state",
        "type": "ChangeState",
        "request": {"transition": transition},
    }


def call(service: str, kind: str, **request: Any) -> dict[str, Any]:
    return {"mode": "call", "service": f"/stairmap/{service}", "type": kind, "request": request}


def test_a_lifecycle_manager_and_services_rule_the_node(
    ros: RosEnvironment, drive: Drive, tmp_path: Path
) -> None:
    file, kept = str(tmp_path / "kept.npz"), tmp_path / "hall.npz"
    node = ros.start_node(autostart="false", map_file=kept)
    orders = {
        "configure": change(CONFIGURE),
        "inactive": {"mode": "listen", "until": "inactive: a lifecycle manager must activate it"},
        "activate": change(ACTIVATE),
        "drive": {},
        "save": call("save_map", "SaveMap", file=file),
        "clear": call("clear_map", "Trigger"),
        "load nothing": call("load_map", "LoadMap", file=str(tmp_path / "none.npz")),
        "load": call("load_map", "LoadMap", file=file),
        "deactivate": change(DEACTIVATE),
        "clean up": change(CLEANUP),
        "configure again": change(CONFIGURE),
        "activate again": change(ACTIVATE),
        "go on": {"mode": "listen", "until": "1 stairway"},
    }
    outcomes = dict(zip(orders, ros.run_robot(list(orders.values())), strict=True))
    answers = {name: outcome["answer"] for name, outcome in outcomes.items() if "answer" in outcome}
    assert all(answer is not None for answer in answers.values()), answers
    assert outcomes["inactive"]["answered"]
    assert outcomes["inactive"]["stairways"] == []
    assert_is_the_stairway(outcomes["drive"], drive.true_flight)
    assert answers["save"]["message"].endswith(f"images written to {file}")
    assert answers["clear"] == {"success": "True", "message": "the map is empty"}
    assert outcomes["clear"]["stairways"] == []
    assert answers["load nothing"]["success"] == "False"
    assert answers["load nothing"]["message"] == f"there is no map file {tmp_path / 'none.npz'}"
    assert answers["load"]["success"] == "True"
    # The map may have been asked anew between the last image and the save.
    assert_is_the_stairway(outcomes["load"], drive.true_flight)
    for name in ("configure", "activate", "deactivate", "clean up", "configure again", "activate again"):
        assert answers[name] == {"success": "True"}, name
    assert outcomes["go on"]["answered"]
    node.send_signal(signal.SIGINT)
    assert node.wait(timeout=20) == 0
    assert num_observations_in(kept.with_suffix(".json")) >= num_observations_in(tmp_path / "kept.json") > 0
