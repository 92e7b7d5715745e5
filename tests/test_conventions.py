"""What holds for the code of every folder."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import pkgutil

import pytest

PACKAGES = (
    "stairmap.clouds",
    "stairmap.detection",
    "stairmap.modeling",
    "stairmap.navigation",
    "stairmap.export",
)
MODULES = ("stairmap.camera", "stairmap.frame", "stairmap.stairway", "stairmap.trajectory")


def value_types() -> list[type]:
    """Return all dataclasses of the packages and modules."""
    names = list(MODULES)
    for package in PACKAGES:
        path = importlib.import_module(package).__path__
        names += [module.name for module in pkgutil.iter_modules(path, f"{package}.")]
    return [
        member
        for name in names
        for _, member in inspect.getmembers(importlib.import_module(name), inspect.isclass)
        if member.__module__ == name and dataclasses.is_dataclass(member)
    ]


@pytest.mark.parametrize("value_type", value_types(), ids=lambda value_type: value_type.__name__)
def test_a_value_is_frozen_slim_and_made_by_keyword(value_type: type) -> None:
    parameters = value_type.__dataclass_params__  # type: ignore[attr-defined]

    assert parameters.frozen
    assert "__slots__" in vars(value_type)
    assert all(field.kw_only for field in dataclasses.fields(value_type))
