"""The nodes' parameters as files and tables: config/*.yaml and the tables in the page.

No ROS in here. ``python -m stairmap_ros.parameter_files PACKAGE PAGE`` writes the files in the package and
the tables in the page, as ``make docs`` does.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel

from stairmap.config import Config
from stairmap_ros.node_config import ExplorerConfig, InputConfig, NodeConfig

NODES: dict[str, tuple[str, InputConfig, Config | None]] = {
    "stairmap": ("parameters", NodeConfig(), Config()),
    "explorer": ("explorer parameters", ExplorerConfig(), None),
}
"""By the name of a node and of its launch file: the mark of its table, its own parameters, and those of the
stages."""


def parameters_yaml(name: str) -> str:
    """Return a node's config/NAME.yaml: every parameter with its default, explained."""
    _, own, config = NODES[name]
    lines = [
        f"# Parameters of the {name} node with their defaults, made by `make docs`; copy, then change it:",
        f"# ros2 launch stairmap_ros {name}.launch.py params_file:=/path/to/my.yaml",
        "/**:",
        "  ros__parameters:",
    ]
    lines += _section_lines(own, "    ")
    for section_name, section in config or ():
        lines.append(f"    {section_name}:")
        lines += _section_lines(section, "      ")
    return "\n".join(lines) + "\n"


def parameters_table(name: str) -> str:
    """Return a node's own parameters as a Markdown table, for docs/ros2.md."""
    lines = ["| parameter | default | what and why |", "|---|---|---|"]
    for field_name, field in type(NODES[name][1]).model_fields.items():
        lines.append(f"| `{field_name}` | `{_yaml_value(field.default)}` | {describe_field(field)} |")
    return "\n".join(lines) + "\n"


def describe_field(field: Any) -> str:
    """Return a parameter's description on one line."""
    return " ".join((field.description or "").split())


def _section_lines(section: BaseModel, indent: str) -> list[str]:
    lines = []
    for name, field in type(section).model_fields.items():
        lines.append(f"{indent}# {describe_field(field)}")
        lines.append(f"{indent}{name}: {_yaml_value(getattr(section, name))}")
    return lines


def _yaml_value(value: Any) -> str:
    return yaml.safe_dump(value).partition("\n")[0]


def write_generated(package: Path, page: Path) -> None:
    """Write the files of the package, and the tables in the page between their marks."""
    text = page.read_text(encoding="utf-8")
    for name, (mark, _, _) in NODES.items():
        (package / "config" / f"{name}.yaml").write_text(parameters_yaml(name), encoding="utf-8")
        before, begin, rest = text.partition(f"<!-- {mark}: begin -->")
        _, end, after = rest.partition(f"<!-- {mark}: end -->")
        text = f"{before}{begin}\n\n{parameters_table(name)}\n{end}{after}"
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_generated(Path(sys.argv[1]), Path(sys.argv[2]))
