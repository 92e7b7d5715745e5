"""ROS parameters of the node, declared from the configuration's own fields."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from stairmap.config import Config
from stairmap.errors import ConfigError
from stairmap_ros.node_config import NodeConfig, describe_field


def declare_parameters(node: Node) -> tuple[NodeConfig, Config]:
    """Declare all parameters and return their values; they do not change while the node runs.

    Raises
    ------
    ConfigError
        If a value is not allowed.
    """
    own = _declare_section(node, NodeConfig(), "")
    sections = {name: _declare_section(node, section, f"{name}.") for name, section in Config()}
    return _validate(NodeConfig, own), _validate(Config, sections)


def _declare_section(node: Node, section: BaseModel, prefix: str) -> dict[str, Any]:
    values = {}
    for name, field in type(section).model_fields.items():
        # A whole number is welcome where a float is asked for: ROS would refuse 'max_depth: 4'.
        descriptor = ParameterDescriptor(
            description=describe_field(field), read_only=True, dynamic_typing=True
        )
        values[name] = node.declare_parameter(prefix + name, getattr(section, name), descriptor).value
    return values


def _validate(section: type[Any], values: Mapping[str, Any]) -> Any:
    try:
        return section.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise ConfigError(f"parameter {place}: {first['msg']}, got {first['input']!r}") from error
