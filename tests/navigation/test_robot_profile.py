"""Profiles: figures with sources, and a clear line for each that cannot be."""

from __future__ import annotations

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
        ({"name": None}, "name must be a text"),
        ({"max_continuous_rise": -0.1}, "max_continuous_rise must be above zero, got -0.1"),
        ({"min_run": 0}, "min_run must be above zero"),
        ({"body_width": "wide"}, "body_width must be a number or null, got 'wide'"),
        ({"body_width": float("nan")}, "body_width must be a number"),
        ({"max_continuous_rise": 0.4}, "max_continuous_rise 0.4 m is above max_single_rise 0.3 m"),
        ({"max_pitch_deg": 100}, "max_pitch_deg must be from 2 to 90 degrees"),
        ({"max_stair_rise": 0.1}, "unknown key max_stair_rise; did you mean max_"),
        ({"floor_speed": None}, "floor_speed must be a number; leave it out"),
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
