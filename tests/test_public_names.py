"""The public names of ``stairmap``."""

from __future__ import annotations

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
