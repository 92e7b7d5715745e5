"""The configuration as text for people: YAML with comments, and docs/configuration.md."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from stairmap.config import Config

_BOUNDS = (("gt", "> {}"), ("ge", "≥ {}"), ("lt", "< {}"), ("le", "≤ {}"))

_PAGE_START = """\
# Configuration

Made by `make docs` from `src/stairmap/config.py`; do not edit it here.

Later wins: the defaults below, then a YAML file (`--config FILE`), then single values
(`--set detection.max_depth=4`). An unknown key is an error that names the nearest known one.
`stairmap config` prints all values as YAML with these explanations; `config.yaml` in a run folder holds those
of that run. What can be read from the data (intrinsics, up, noise at a depth) is no parameter.
"""


def commented_yaml(config: Config) -> str:
    """Return a configuration as YAML that ``load_config`` reads back equal, with comments."""
    return "\n".join(_section_lines(config, indent="")) + "\n"


def configuration_page() -> str:
    """Return the content of docs/configuration.md."""
    parts = [_PAGE_START]
    for name, field in Config.model_fields.items():
        section = field.annotation
        assert isinstance(section, type) and issubclass(section, BaseModel)
        rows = [
            f"| `{name}.{key}` | {_yaml_value(info.default)} | {_bounds(info)} | {_description(info)} |"
            for key, info in section.model_fields.items()
        ]
        table = "\n".join(["| key | default | range | what and why |", "|---|---|---|---|", *rows])
        parts.append(f"## {name}\n\n{_first_paragraph(section)}\n\n{table}\n")
    return "\n".join(parts)


def _section_lines(section: BaseModel, *, indent: str) -> Iterator[str]:
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        if isinstance(value, BaseModel):
            yield f"{indent}# {_first_paragraph(type(value))}"
            yield f"{indent}{name}:"
            yield from _section_lines(value, indent=indent + "  ")
        else:
            yield f"{indent}# {_description(field)} ({_bounds(field)})"
            yield f"{indent}{name}: {_yaml_value(value)}"


def _description(field: FieldInfo) -> str:
    return " ".join((field.description or "").split())


def _first_paragraph(section: type[BaseModel]) -> str:
    return " ".join((section.__doc__ or "").split("\n\n")[0].split())


def _bounds(field: FieldInfo) -> str:
    limits = {
        name: getattr(item, name) for item in field.metadata for name, _ in _BOUNDS if hasattr(item, name)
    }
    return ", ".join(text.format(f"{limits[name]:g}") for name, text in _BOUNDS if name in limits)


def _yaml_value(value: Any) -> str:
    # safe_dump ends a bare scalar with a document end mark.
    return re.sub(r"\n\.\.\.\n?$", "", yaml.safe_dump(value)).strip()
