"""ROS parameters of the nodes, declared from the configuration's own fields."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from stairmap.config import Config
from stairmap.errors import ConfigError
from stairmap_ros.node_config import ExplorerConfig, NodeConfig
from stairmap_ros.parameter_files import describe_field

PARAMETERS_OF_ROS = ("use_sim_time", "start_type_description_service")
"""Parameters that every node has."""

PREFIX_OF_ROS = "qos_overrides."
"""Parameters that ROS makes for some publishers."""


def declare_parameters(node: Node) -> tuple[NodeConfig, Config]:
    """Declare all parameters of the map's node and return their values; they do not change while it runs.

    Parameters
    ----------
    node
        Made with ``allow_undeclared_parameters`` and ``automatically_declare_parameters_from_overrides``: so
        what it was given under a name that is none is seen.

    Raises
    ------
    ConfigError
        If a parameter is unknown, or its value is not allowed.
    """
    _undeclare_given(node, known_parameters())
    own = _declare_section(node, NodeConfig(), "")
    sections = {name: _declare_section(node, section, f"{name}.") for name, section in Config()}
    return _validate(NodeConfig, own), _validate(Config, sections)


def declare_explorer_parameters(node: Node) -> ExplorerConfig:
    """Do the same for the explorer.

    Raises
    ------
    ConfigError
        If a parameter is unknown, or its value is not allowed.
    """
    _undeclare_given(node, list(ExplorerConfig.model_fields))
    explorer: ExplorerConfig = _validate(ExplorerConfig, _declare_section(node, ExplorerConfig(), ""))
    return explorer


def known_parameters() -> list[str]:
    """Return the names of all parameters of the map's node."""
    names = list(NodeConfig.model_fields)
    for name, section in Config():
        names += [f"{name}.{field}" for field in type(section).model_fields]
    return names


def check_known(given: list[str], known: list[str]) -> None:
    """Check that parameters exist.

    Raises
    ------
    ConfigError
        If one does not; it names the nearest that does.
    """
    for name in given:
        if name in known or name in PARAMETERS_OF_ROS or name.startswith(PREFIX_OF_ROS):
            continue
        nearest = difflib.get_close_matches(name, known, n=1, cutoff=0.0)[0]
        raise ConfigError(
            f"there is no parameter {name}; did you mean {nearest}? The files in config/ list all"
        )


def _undeclare_given(node: Node, known: list[str]) -> None:
    given = list(node.get_parameters_by_prefix(""))
    check_known(given, known)
    for name in given:
        if name not in PARAMETERS_OF_ROS and not name.startswith(PREFIX_OF_ROS):
            node.undeclare_parameter(name)


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
