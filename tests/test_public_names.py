"""The public names of ``stairmap``."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import stairmap
from stairmap import frame


def test_every_public_name_can_be_imported():
    for name in stairmap.__all__:
        assert getattr(stairmap, name) is not None
    assert set(stairmap.__all__) <= set(dir(stairmap))


def test_public_names_are_sorted():
    assert stairmap.__all__ == sorted(stairmap.__all__)


def test_public_name_is_the_thing_itself():
    assert stairmap.DepthFrame is frame.DepthFrame


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'Stairs'"):
        _ = stairmap.Stairs


def test_what_a_user_needs_is_there_without_deep_imports():
    wanted = {"MapSession", "assess", "detect", "find_floors", "load_camera", "load_robot", "make_portals"}
    assert wanted <= set(stairmap.__all__)


def test_a_type_checker_sees_the_names_that_are_public():
    tree = ast.parse(Path(stairmap.__file__).read_text())
    (block,) = [
        node
        for node in tree.body
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
    ]
    seen = {alias.name for node in block.body for alias in node.names}
    assert seen == set(stairmap.__all__) - {"__version__"}
