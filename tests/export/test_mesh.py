from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from stairmap.errors import OutputError
from stairmap.export.mesh import dump_ply, ply_from_stairways
from stairmap.stairway import Stairway


def read_ply(content: bytes) -> dict[str, list[tuple[object, ...]]]:
    """Read a binary PLY file property by property, as its header says."""
    codes = {"double": "d", "float": "f", "int": "i", "uchar": "B"}
    header, _, body = content.partition(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    elements: list[tuple[str, int, list[list[str]]]] = []
    for words in (line.split() for line in lines[2:]):
        if words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property":
            elements[-1][2].append(words[1:])
    position = 0

    def read(code: str) -> object:
        nonlocal position
        (value,) = struct.unpack_from("<" + code, body, position)
        position += struct.calcsize("<" + code)
        return value

    result: dict[str, list[tuple[object, ...]]] = {}
    for name, count, properties in elements:
        rows = []
        for _ in range(count):
            row: list[object] = []
            for words in properties:
                if words[0] == "list":
                    row.append(tuple(read(codes[words[2]]) for _ in range(int(str(read(codes[words[1]]))))))
                else:
                    row.append(read(codes[words[0]]))
            rows.append(tuple(row))
        result[name] = rows
    assert position == len(body)
    return result


def test_ply_holds_the_surface_and_orange_nosings(stairway: Stairway) -> None:
    ply = read_ply(ply_from_stairways([stairway, stairway]))
    vertices, triangles = stairway.surface()
    positions = np.array([row[:3] for row in ply["vertex"]], dtype=float)
    np.testing.assert_array_equal(positions[: len(vertices)], vertices)
    faces = np.array([row[0] for row in ply["face"]])
    np.testing.assert_array_equal(faces[: len(triangles)], triangles)
    np.testing.assert_array_equal(positions[faces[len(triangles) :]], vertices[triangles])
    ends = np.array([row[:3] for row in ply["vertex"] if row[3:] == (213, 94, 0)], dtype=float)
    assert {row[3:] for row in ply["vertex"]} == {(213, 94, 0), (160, 174, 186)}
    nosings = stairway.edges()
    np.testing.assert_allclose(ends.reshape(-1, 2, 3), np.concatenate([nosings, nosings]), atol=1e-9)


def test_other_programs_read_the_ply(tmp_path: Path, stairway: Stairway) -> None:
    trimesh = pytest.importorskip("trimesh", reason="reads the PLY in this test")
    dump_ply([stairway], tmp_path / "stairs.ply")
    mesh = trimesh.load(tmp_path / "stairs.ply", process=False)
    vertices, triangles = stairway.surface()
    np.testing.assert_allclose(mesh.vertices, vertices, atol=1e-9)
    np.testing.assert_array_equal(mesh.faces, triangles)


def test_without_a_stairway_the_ply_is_empty_but_valid() -> None:
    assert read_ply(ply_from_stairways([])) == {"vertex": [], "face": []}


def test_a_ply_that_cannot_be_written_is_an_output_error(tmp_path: Path, stairway: Stairway) -> None:
    with pytest.raises(OutputError, match="cannot write"):
        dump_ply([stairway], tmp_path / "missing" / "stairs.ply")
