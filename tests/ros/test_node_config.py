"""Parameters: config/*.yaml and docs/ros2.md say what the code says."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from stairmap.config import Config
from stairmap_ros.node_config import ExplorerConfig, NodeConfig
from stairmap_ros.parameter_files import NODES, parameters_table, parameters_yaml

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("name", NODES)
def test_the_parameter_files_are_up_to_date(name: str) -> None:
    file = ROOT / "ros/stairmap_ros/config" / f"{name}.yaml"
    assert file.read_text(encoding="utf-8") == parameters_yaml(name), "run: make docs"


def test_the_parameter_files_hold_every_default() -> None:
    values = yaml.safe_load(parameters_yaml("stairmap"))["/**"]["ros__parameters"]
    sections = {name: values.pop(name) for name in Config.model_fields}
    assert NodeConfig.model_validate(values) == NodeConfig()
    assert Config.model_validate(sections) == Config()
    values = yaml.safe_load(parameters_yaml("explorer"))["/**"]["ros__parameters"]
    assert ExplorerConfig.model_validate(values) == ExplorerConfig()


@pytest.mark.parametrize("name", NODES)
def test_the_page_lists_the_parameters_as_they_are(name: str) -> None:
    page = (ROOT / "docs/ros2.md").read_text(encoding="utf-8")
    assert parameters_table(name) in page, "run: make docs"
