"""Wavefront OBJ, read back line by line."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.errors import OutputError
from stairmap.export.mesh import dump_obj, obj_from_stairways
from walkable_stairways import make_half_turn, make_stairway


def read_obj(text):
    """Return vertices, and faces and lines as indices from 0."""
    rows = {"v": [], "f": [], "l": [], "o": []}
    for line in text.splitlines():
        key, *values = line.split()
        if key in rows:
            rows[key].append(values)
    vertices = np.array(rows["v"], dtype=float)
    return vertices, np.array(rows["f"], dtype=int) - 1, np.array(rows["l"], dtype=int) - 1, rows["o"]


def test_surfaces_and_nosings_are_read_back_equal():
    stairways = [make_half_turn(), make_stairway(stairway_id=2)]
    vertices, faces, lines, names = read_obj(obj_from_stairways(stairways))
    assert names == [["stairway_1"], ["stairway_2"]]
    expected = [np.concatenate([item.surface()[0][item.surface()[1]] for item in stairways])]
    assert vertices[faces] == pytest.approx(expected[0], abs=1e-6)
    assert vertices[lines] == pytest.approx(np.concatenate([item.edges() for item in stairways]), abs=1e-6)


def test_without_a_stairway_the_file_is_empty():
    assert obj_from_stairways([]).count("\n") == 1


def test_the_file_holds_the_text_and_a_bad_path_is_told(tmp_path):
    dump_obj([make_stairway()], tmp_path / "a.obj")
    assert (tmp_path / "a.obj").read_text() == obj_from_stairways([make_stairway()])
    with pytest.raises(OutputError, match="cannot write"):
        dump_obj([], tmp_path / "none" / "a.obj")
