"""Flights of stairs in points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sampled_clouds import sampled_scene
from stairmap.clouds.axes import StairAxes
from stairmap.clouds.detector import detect_flights, detect_points
from stairmap.clouds.flight import lies_on
from stairmap.clouds.judgement import alternation, judge
from stairmap.clouds.section import EXTENSION, fit_section
from stairmap.config import Config
from stairmap.detection.profile import StairProfile
from stairmap.transforms import rotation_from_vector

UP = np.array([0.0, 0.0, 1.0])


def test_a_flight_is_measured_to_millimetres() -> None:
    points, (truth,) = sampled_scene("free_standing")

    (seen,) = detect_points(points, up=UP).observations

    assert seen.rise == pytest.approx(truth.rise, abs=0.002)
    assert seen.run == pytest.approx(truth.run, abs=0.002)
    assert seen.width == pytest.approx(truth.width, abs=0.02)
    assert seen.num_steps == truth.num_risers
    assert seen.forward == pytest.approx(truth.forward, abs=0.01)
    assert seen.floor_seen


def test_edges_lie_on_the_nosings() -> None:
    points, (truth,) = sampled_scene("free_standing")

    (seen,) = detect_points(points, up=UP).observations

    edges = np.array([edge.nosing for edge in seen.edges])
    middles, true_middles = edges.mean(axis=1), truth.edges().mean(axis=1)
    assert middles[:, [0, 2]] == pytest.approx(true_middles[:, [0, 2]], abs=0.01)
    # 14 points of each 40 mm of a step tell its own end to 20 mm.
    assert middles[:, 1] == pytest.approx(true_middles[:, 1], abs=0.05)
    assert [edge.step_index for edge in seen.edges] == list(range(truth.num_risers))


def test_the_answer_turns_with_the_points() -> None:
    points, _ = sampled_scene("free_standing")
    turn = rotation_from_vector(np.array([1.2, -0.4, 0.3]))
    shift = np.array([3.0, -2.0, 40.0])
    (level,) = detect_points(points, up=UP).observations

    (turned,) = detect_points(points @ turn.T + shift, up=turn @ UP).observations

    assert turned.rise == pytest.approx(level.rise, abs=0.001)
    assert turned.run == pytest.approx(level.run, abs=0.001)
    assert turned.up == pytest.approx(turn @ UP)
    expected = np.array([edge.nosing.mean(axis=0) for edge in level.edges]) @ turn.T + shift
    assert np.array([edge.nosing.mean(axis=0) for edge in turned.edges]) == pytest.approx(expected, abs=0.015)


@pytest.mark.parametrize("name", ["bookshelf", "ramp", "pallets", "railing", "ladder"])
def test_look_alikes_are_no_stairs(name: str) -> None:
    points, _ = sampled_scene(name, density=800.0)

    assert not detect_points(points, up=UP).observations


@pytest.mark.parametrize("name", ["pallets", "stacked_boxes"])
def test_what_is_stepped_like_stairs_is_judged_and_refused_with_reasons(name: str) -> None:
    points, _ = sampled_scene(name)

    detection = detect_points(points, up=UP)

    assert not detection.observations
    assert detection.rejections


def test_few_points_are_refused_with_the_reason() -> None:
    detection = detect_points(np.zeros((10, 3)), up=UP)

    assert not detection
    assert str(detection.rejections[0]) == "min_points: 10, limit 100"


def test_equal_points_are_no_stairs() -> None:
    assert not detect_points(np.ones((500, 3)), up=UP)


def test_steps_of_which_every_second_was_seen_are_refused() -> None:
    points, _ = sampled_scene("free_standing")
    (flight,), _ = detect_flights(points.astype(np.float32), noise=0.003, config=Config())
    risers, treads = flight.section.risers, flight.section.treads
    hidden = np.arange(len(risers.cover)) % 2 == 1
    section = replace(
        flight.section,
        risers=replace(risers, cover=np.where(hidden, 0.0, risers.cover)),
        treads=replace(treads, cover=np.where(np.append(False, hidden), 0.0, treads.cover)),
    )
    rules = [
        {item.rule for item in judge(some, flight.sides, flight.points, 0.003, Config())[1]}
        for some in (flight.section, section)
    ]

    assert rules[0] == set()
    assert "max_alternation" in rules[1]


def test_a_flight_is_followed_from_two_of_its_steps_to_both_ends() -> None:
    points, (truth,) = sampled_scene("free_standing")
    first = truth.edges().mean(axis=1)[0]
    profile = StairProfile(distance=0.0, height=0.0, run=truth.run, rise=truth.rise, num_steps=2)

    section = fit_section(points, StairAxes(origin=first, heading=truth.heading), profile, (-0.4, 0.4), 0.003)

    assert section is not None
    assert section.profile.num_steps == truth.num_risers > 2 + EXTENSION


def test_where_every_second_step_is_missing_the_lattice_is_half_of_one() -> None:
    assert alternation(np.array([True, False, True, False, True])) == 1.0
    assert alternation(np.array([True, True, False, True, True, True])) < 0.4
    assert alternation(np.array([True])) == 0.0


@pytest.mark.parametrize("turn_deg", [0.0, 35.0])
def test_two_lattices_on_the_same_steps_are_one_flight(turn_deg: float) -> None:
    points, _ = sampled_scene("wide")
    (flight,), _ = detect_flights(points.astype(np.float32), noise=0.003, config=Config())
    axes, profile = flight.section.axes, flight.section.profile
    turn = np.radians(turn_deg)
    # Aslant over the same treads: the same rise, a longer run.
    start = np.array([profile.distance, flight.sides.middle - 0.4, profile.height])
    aslant = replace(
        flight,
        section=replace(
            flight.section,
            axes=StairAxes(origin=axes.to_cloud(start[None])[0], heading=axes.heading + turn),
            profile=StairProfile(
                distance=0.0, height=0.0, run=profile.run / np.cos(turn), rise=profile.rise, num_steps=4
            ),
        ),
        sides=replace(flight.sides, right=-0.3, left=0.3),
    )
    above = replace(
        aslant,
        section=replace(
            aslant.section,
            axes=replace(aslant.section.axes, origin=aslant.section.axes.origin + 2.0 * UP),
        ),
    )

    assert lies_on(aslant, flight)
    assert not lies_on(above, flight)
