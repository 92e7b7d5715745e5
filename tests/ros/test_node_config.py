"""Parameters: config/stairmap.yaml and docs/ros2.md say what the code says."""

from __future__ import annotations

from pathlib import Path

import yaml

from stairmap.config import Config
from stairmap_ros.node_config import NodeConfig, parameters_table, parameters_yaml

ROOT = Path(__file__).resolve().parents[2]


def test_the_parameter_file_is_up_to_date() -> None:
    file = ROOT / "ros/stairmap_ros/config/stairmap.yaml"
    assert file.read_text(encoding="utf-8") == parameters_yaml(), "run: make docs"


def test_the_parameter_file_holds_every_default() -> None:
    values = yaml.safe_load(parameters_yaml())["/**"]["ros__parameters"]
    sections = {name: values.pop(name) for name in Config.model_fields}
    assert NodeConfig.model_validate(values) == NodeConfig()
    assert Config.model_validate(sections) == Config()


def test_the_page_lists_the_parameters_as_they_are() -> None:
    page = (ROOT / "docs/ros2.md").read_text(encoding="utf-8")
    assert parameters_table() in page, "run: make docs"
