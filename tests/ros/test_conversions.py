"""Stairways as messages and markers; each test runs in the environment of the wheels."""

from __future__ import annotations

import json
import os
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ros_environment import ENVIRONMENT

from ideal_observations import make_flight
from stairmap.modeling.landings import make_landing
from stairmap.stairway import Stairway, Step

pytestmark = pytest.mark.usefixtures("wheels")

LOWER = make_flight(overhang=0.025, bottom_seen=True, top_seen=False)
LOWER = replace(
    LOWER,
    std=replace(LOWER.std, overhang=0.004),
    steps=(
        Step(nosing=LOWER.edges()[0], num_observations=5, std=(0.004, 0.002)),
        Step(nosing=LOWER.edges()[1], num_observations=0),
    ),
)
UPPER = make_flight(base=np.array([2.0, 3.0, 1.5]), heading=np.pi / 2)
STAIRWAY = Stairway(
    id=7,
    flights=(LOWER, UPPER),
    landings=(make_landing(LOWER, UPPER),),
    num_observations=12,
    first_seen_ns=3_000_000_001,
    last_seen_ns=4_500_000_000,
)

PRELUDE = """
import json, sys
from stairmap.stairway import Stairway
from stairmap_ros.markers import make_marker_array
from stairmap_ros.messages import make_header, make_stairway_array
stairway = Stairway.from_dict(json.loads(sys.argv[1]))
header = make_header("map", 4_500_000_000)
"""


def run_with_ros(code: str) -> Any:
    """What some code prints as JSON; it finds a stairway of two flights, and a header."""
    variables = {
        name: value for name, value in os.environ.items() if name != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"
    }
    variables.pop("PYTHONPATH", None)
    ended = subprocess.run(
        [ENVIRONMENT / "bin/python", "-c", PRELUDE + code, json.dumps(STAIRWAY.to_dict())],
        env=variables,
        cwd=Path("/"),
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(ended.stdout)


def test_each_marker_array_first_deletes_what_was_shown_before() -> None:
    shown, empty = run_with_ros("""
rounds = [make_marker_array(stairways, (), header).markers for stairways in ([stairway], [])]
print(json.dumps([[(m.ns, m.id, m.action) for m in r] for r in rounds]))
""")
    assert empty == [["", 0, 3]]
    assert shown[0] == ["", 0, 3]
    keys = {(name, marker_id) for name in ("box", "label", "nosings") for marker_id in (701, 702)}
    assert {(name, marker_id) for name, marker_id, _ in shown[1:]} == keys
    assert len(shown) == 1 + len(keys)
    assert {action for _, _, action in shown[1:]} == {0}


def test_overhang_ends_and_deviations_of_steps_are_in_the_message() -> None:
    lower, upper = run_with_ros("""
from math import isnan
known = lambda value: None if isnan(value) else value
print(json.dumps([
    {"overhang": [known(f.overhang), known(f.overhang_std)], "seen": [f.bottom_seen, f.top_seen],
     "stds": [[known(step.std_along), known(step.std_up)] for step in f.steps]}
    for f in make_stairway_array([stairway], header).stairways[0].flights
]))
""")
    assert lower == {
        "overhang": [0.025, 0.004], "seen": [True, False], "stds": [[0.004, 0.002], [None, None]],
    }  # fmt: skip
    assert upper == {"overhang": [None, None], "seen": [False, False], "stds": []}


def test_a_stairway_of_two_flights_keeps_its_order_landing_and_stamps() -> None:
    message = run_with_ros("""
s = make_stairway_array([stairway], header).stairways[0]
landing = s.landings[0]
print(json.dumps({
    "id": s.id, "num": s.num_observations,
    "first": [s.first_seen.sec, s.first_seen.nanosec], "last": [s.last_seen.sec, s.last_seen.nanosec],
    "bases": [[f.pose.pose.position.x, f.pose.pose.position.y, f.pose.pose.position.z] for f in s.flights],
    "turns": [[f.pose.pose.orientation.z, f.pose.pose.orientation.w] for f in s.flights],
    "planes": [list(f.plane) for f in s.flights],
    "landing": [landing.pose.position.x, landing.pose.position.y, landing.pose.position.z,
                landing.length, landing.width],
}))
""")
    assert (message["id"], message["num"]) == (7, 12)
    assert (message["first"], message["last"]) == ([3, 1], [4, 500_000_000])
    np.testing.assert_allclose(message["bases"], [LOWER.base, UPPER.base], atol=1e-6)
    np.testing.assert_allclose(message["turns"][1], [np.sin(np.pi / 4), np.cos(np.pi / 4)], atol=1e-6)
    np.testing.assert_allclose(message["planes"], [LOWER.plane, UPPER.plane], atol=1e-5)
    landing = STAIRWAY.landings[0]
    np.testing.assert_allclose(message["landing"], [*landing.center, *landing.size], atol=1e-6)


def test_an_explorer_reads_back_what_the_map_says() -> None:
    told = run_with_ros("""
from stairmap_ros.stairway_messages_in import stairways_from_message
(read,) = stairways_from_message(make_stairway_array([stairway], header))
print(json.dumps(read.to_dict()))
""")
    # An end of which nobody knows whether it was seen was not seen, in messages.
    upper = replace(UPPER, bottom_seen=False, top_seen=False)
    assert_same(told, replace(STAIRWAY, flights=(LOWER, upper)).to_dict())


def assert_same(told: Any, wanted: Any) -> None:
    """Nested JSON types are equal but for rounding."""
    if isinstance(wanted, dict):
        assert told.keys() == wanted.keys()
        for key in wanted:
            assert_same(told[key], wanted[key])
    elif isinstance(wanted, list):
        assert len(told) == len(wanted)
        for one, other in zip(told, wanted, strict=True):
            assert_same(one, other)
    else:
        assert told == pytest.approx(wanted, abs=2e-6)


def test_a_climb_goal_has_its_flight_in_the_order_of_the_climb() -> None:
    up, down = run_with_ros("""
from stairmap.exploration.levels import LevelBook
from stairmap.exploration.stair_links import StairBook
from stairmap.navigation.robot_profile import load_robot
from stairmap_ros.climb_goal import make_climb_goal
from stairmap_ros.stairway_messages_in import xyz, yaw_of
levels, book = LevelBook(lambda height: None), StairBook(load_robot("spot"))
levels.enter(stairway.flights[1].base[2])
book.update([stairway], levels)
points = lambda places: [xyz(place).tolist() for place in places]
print(json.dumps([{
    "frame": goal.header.frame_id, "stairway": goal.stairway, "direction": goal.direction,
    "poses": points([goal.staging.position, goal.end.position]),
    "headings": [yaw_of(goal.staging.orientation), yaw_of(goal.end.orientation)],
    "risers": [flight.num_risers for flight in goal.flights], "numbers": list(goal.flight_numbers),
    "tops": points(goal.tops), "way": points(goal.way), "levels": [goal.level_from, goal.level_to],
} for goal in [make_climb_goal(book.links[1], header, is_up=is_up) for is_up in (True, False)]]))
""")
    assert (up["frame"], up["stairway"], up["risers"], up["numbers"]) == ("map", 7, [UPPER.num_risers], [1])
    assert (up["direction"], down["direction"]) == (1, 2)
    assert (up["levels"], down["levels"]) == ([0, -1], [-1, 0])
    staging = UPPER.base - 0.6 * UPPER.forward
    np.testing.assert_allclose(up["poses"][0], staging, atol=1e-6)
    assert up["poses"] == down["poses"][::-1]
    np.testing.assert_allclose(up["headings"], UPPER.heading, atol=1e-6)
    np.testing.assert_allclose(down["headings"], UPPER.heading - np.pi, atol=1e-6)
    np.testing.assert_allclose(up["tops"], [UPPER.edges()[-1].mean(axis=0)], atol=1e-6)
    assert up["way"] == down["way"][::-1]
    assert up["way"][0] == up["poses"][0]
