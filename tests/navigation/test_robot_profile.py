"""Profiles: figures with sources, and a clear line for each that cannot be."""

from __future__ import annotations

import math

import pytest
import yaml

from stairmap.errors import ConfigError
from stairmap.navigation.robot_profile import load_robot, robot_from_values, robot_names

GOOD = {
    "name": "mine", "max_continuous_rise": 0.2, "max_single_rise": 0.3, "min_run": None, "max_pitch_deg": 40,
    "max_slope_deg": None, "body_width": 0.4, "side_clearance": 0.0, "min_landing_length": None,
}  # fmt: skip


@pytest.mark.parametrize("name", robot_names())
def test_every_figure_of_a_profile_names_its_source(name):
    robot = load_robot(name)
    limits = [limit for limit in robot.limits() if limit.value is not None]
    assert all(limit.source for limit in limits)


@pytest.mark.parametrize("name", ["anymal", "vision60", "packbot"])
def test_unpublished_rises_stay_unknown(name):
    assert load_robot(name).max_continuous_rise is None


def test_a_file_gives_the_same_profile_as_its_values(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(GOOD))
    assert load_robot(path) == robot_from_values(GOOD, origin="values")
    assert load_robot(path).min_width == pytest.approx(0.4)


def test_a_figure_may_carry_its_source():
    robot = robot_from_values({**GOOD, "body_width": {"value": 0.5, "source": "tape"}}, origin="x")
    assert (robot.body_width, robot.sources["body_width"]) == (0.5, "tape")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"max_continuous_rise": 178, "max_single_rise": 300}, "in metres"),
        ({"max_pitch_deg": 0.6}, "2 to 90 degrees"),
        ({"name": None}, "name: should be a valid string, got None"),
        ({"max_continuous_rise": -0.1}, "max_continuous_rise: should be greater than 0, got -0.1"),
        ({"min_run": 0}, "min_run: should be greater than 0, got 0"),
        ({"body_width": "wide"}, "body_width: should be a valid number, got 'wide'"),
        ({"body_width": float("nan")}, "body_width: should be a finite number, got nan"),
        ({"max_continuous_rise": 0.4}, "max_continuous_rise 0.4 m is above max_single_rise 0.3 m"),
        ({"max_pitch_deg": 100}, "max_pitch_deg: must be from 2 to 90 degrees"),
        ({"max_stair_rise": 0.1}, "unknown key max_stair_rise; did you mean max_"),
        ({"floor_speed": None}, "floor_speed: should be a valid number, got None"),
        ({"min_run": {"val": 1}}, "min_run must be a number or {value, source}"),
    ],
)
def test_a_profile_that_cannot_be_is_refused_in_one_line(change, words):
    with pytest.raises(ConfigError) as refusal:
        robot_from_values({**GOOD, **change}, origin="mine.yaml")
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_missing_limit_is_named():
    values = {key: value for key, value in GOOD.items() if key != "min_run"}
    with pytest.raises(ConfigError, match="lacks min_run; write null"):
        robot_from_values(values, origin="mine.yaml")


def test_an_unknown_robot_is_told_the_known_ones():
    with pytest.raises(ConfigError, match=r"no robot 'sport'; choose one of .*spot"):
        load_robot("sport")


def test_a_file_that_is_not_there_or_no_yaml_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="cannot read"):
        load_robot(tmp_path / "none.yaml")
    (tmp_path / "bad.yaml").write_text("a: [")
    with pytest.raises(ConfigError, match="not a YAML file"):
        load_robot(tmp_path / "bad.yaml")
    (tmp_path / "list.yaml").write_text("- 1")
    with pytest.raises(ConfigError, match="must hold keys"):
        load_robot(tmp_path / "list.yaml")


FULL = {
    "name": "full", "max_continuous_rise": {"value": 0.2, "source": "a"}, "max_single_rise": 0.3,
    "min_run": {"value": 0.25, "source": "b"}, "max_pitch_deg": {"value": 36, "source": "c"},
    "max_slope_deg": {"value": 30, "source": "d"}, "body_width": {"value": 0.5, "source": "e"},
    "side_clearance": 0.05, "min_landing_length": {"value": 1.2, "source": "f"},
}  # fmt: skip


def limits_of(**changes):
    limits = robot_from_values({**FULL, **changes}, origin="x").limits()
    return {limit.measure: limit for limit in limits}


def test_a_profile_limits_each_measure_in_its_sense_and_unit_with_its_source():
    assert [
        (limit.measure, limit.sense, limit.value, limit.source, limit.is_binding)
        for limit in limits_of().values()
    ] == [
        ("rise", "max", 0.2, "a", True), ("single rise", "max", 0.3, "", True),
        ("run", "min", 0.25, "b", True),
        ("pitch", "max", pytest.approx(math.radians(36)), "c", True),
        ("width", "min", pytest.approx(0.6), "e", True), ("landing length", "min", 1.2, "f", True),
    ]  # fmt: skip


def test_a_slope_stands_in_for_a_pitch_that_was_never_published_and_does_not_bind():
    pitch = limits_of(max_pitch_deg=None)["pitch"]
    assert (pitch.value, pitch.source, pitch.is_binding) == (pytest.approx(math.radians(30)), "d", False)
    pitch = limits_of(max_pitch_deg=None, max_slope_deg=None)["pitch"]
    assert (pitch.value, pitch.is_binding) == (None, True)


@pytest.mark.parametrize("name", ["body_width", "side_clearance"])
def test_a_width_is_known_only_with_body_and_clearance(name):
    assert limits_of(**{name: None})["width"].value is None


@pytest.mark.parametrize(
    "change",
    [
        {"max_continuous_rise": 0.3}, {"max_pitch_deg": 2.1, "max_slope_deg": 89.9}, {"body_width": 5.0},
        {"side_clearance": 0}, {"alignment_time": 0}, {"ascent_risk": 0, "descent_risk": 0},
        {"max_slope_deg": 2.1},
        {"floor_speed": 12}, {"min_run": 1}, {"max_single_rise": None}, {"max_continuous_rise": None},
    ],
)  # fmt: skip
def test_a_profile_right_inside_of_what_can_be_is_taken(change):
    robot = robot_from_values({**FULL, **change}, origin="x")
    assert all(getattr(robot, name) == value for name, value in change.items())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"max_continuous_rise": 0.301}, "above max_single_rise"),
        ({"max_pitch_deg": 2.0}, "max_pitch_deg: must be from 2 to 90"),
        ({"max_pitch_deg": 90}, "max_pitch_deg: must be from 2 to 90"),
        ({"max_slope_deg": 2.0}, "max_slope_deg: must be from 2 to 90"),
        ({"body_width": 5.01}, "body_width: is in metres and at most 5, got 5.01"),
        ({"side_clearance": 5.01}, "is in metres"),
        ({"min_landing_length": 5.01}, "is in metres"),
        ({"side_clearance": -0.01}, "side_clearance: should be greater than or equal to 0"),
        ({"floor_speed": 0}, "floor_speed: should be greater than 0"),
        ({"stair_speed": 0}, "stair_speed: should be greater than 0"),
        ({"floor_speed": True}, "floor_speed: should be a valid number, got True"),
        ({"min_run": {"value": 0.2, "sauce": "x"}}, "min_run must be a number or {value, source}"),
        ({"name": "  "}, "name: must be a text"),
    ],
)
def test_a_profile_right_outside_of_what_can_be_is_refused(change, words):
    with pytest.raises(ConfigError, match=words):
        robot_from_values({**FULL, **change}, origin="x")


def test_a_motion_that_is_not_given_takes_its_default():
    robot = robot_from_values(FULL, origin="x")
    assert (robot.floor_speed, robot.stair_speed, robot.alignment_time) == (0.5, 0.2, 5.0)
    assert (robot.ascent_risk, robot.descent_risk) == (10.0, 15.0)


def test_a_source_may_be_missing():
    assert robot_from_values({**FULL, "min_run": {"value": 0.2}}, origin="x").sources["min_run"] == ""


def test_a_profile_that_is_no_text_or_has_no_suffix_is_refused_or_read(tmp_path):
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="to be UTF-8 text"):
        load_robot(tmp_path / "binary.yaml")
    (tmp_path / "mine").write_text(yaml.safe_dump(GOOD))
    assert load_robot(tmp_path / "mine").name == "mine"


def test_the_profiles_that_come_along_are_named_without_their_suffix():
    assert {"spot", "go2", "wheeled"} <= set(robot_names())
    assert list(robot_names()) == sorted(robot_names())
    assert not [name for name in robot_names() if "." in name]
