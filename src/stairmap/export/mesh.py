"""The clean stair surface as a PLY mesh, to look at or to repair a map with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stairmap.errors import OutputError
from stairmap.stairway import Stairway

_SURFACE_COLOR = (160, 174, 186)
_NOSING_COLOR = (213, 94, 0)

_VERTEX = np.dtype([("position", "<f8", 3), ("color", "u1", 3)])
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
_EDGE = np.dtype([("ends", "<i4", 2), ("color", "u1", 3)])

_HEADER = """\
ply
format binary_little_endian 1.0
comment stairways, metres, map coordinates, z up; edges are the nosings
element vertex {num_vertices}
property double x
property double y
property double z
property uchar red
property uchar green
property uchar blue
element face {num_faces}
property list uchar int vertex_indices
element edge {num_edges}
property int vertex1
property int vertex2
property uchar red
property uchar green
property uchar blue
end_header
"""


def ply_from_stairways(stairways: Sequence[Stairway]) -> bytes:
    """Return a binary little-endian PLY file of the surfaces and nosings of stairways.

    Positions are doubles, because maps in UTM coordinates lose centimetres as floats. Vertices
    of surfaces come first, then two for each nosing. Without a stairway all elements are empty.

    Parameters
    ----------
    stairways
        What to write, in map coordinates, m.
    """
    surface_vertices, faces = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)]
    count = 0
    for stairway in stairways:
        vertices, triangles = stairway.surface()
        surface_vertices.append(vertices)
        faces.append(triangles + count)
        count += len(vertices)
    nosings = np.concatenate([np.empty((0, 2, 3)), *(stairway.edges() for stairway in stairways)])

    vertex_table = np.zeros(count + 2 * len(nosings), dtype=_VERTEX)
    vertex_table["position"] = np.concatenate([*surface_vertices, nosings.reshape(-1, 3)])
    vertex_table["color"][:count] = _SURFACE_COLOR
    vertex_table["color"][count:] = _NOSING_COLOR
    face_table = np.zeros(sum(len(part) for part in faces), dtype=_FACE)
    face_table["count"] = 3
    face_table["corners"] = np.concatenate(faces)
    edge_table = np.zeros(len(nosings), dtype=_EDGE)
    edge_table["ends"] = count + np.arange(2 * len(nosings)).reshape(-1, 2)
    edge_table["color"] = _NOSING_COLOR

    header = _HEADER.format(
        num_vertices=len(vertex_table), num_faces=len(face_table), num_edges=len(edge_table)
    )
    return b"".join([header.encode("ascii"), *(t.tobytes() for t in (vertex_table, face_table, edge_table))])


def dump_ply(stairways: Sequence[Stairway], path: Path) -> None:
    """Write the surfaces and nosings of stairways to a PLY file; see ``ply_from_stairways``.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    try:
        path.write_bytes(ply_from_stairways(stairways))
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error


def obj_from_stairways(stairways: Sequence[Stairway]) -> str:
    """Return a Wavefront OBJ file of the surfaces and nosings of stairways, an object each.

    Numbers have micrometres. Faces and lines count vertices from 1 over the whole file.

    Parameters
    ----------
    stairways
        What to write, in map coordinates, m, z up.
    """
    lines = ["# stairways, metres, map coordinates, z up; lines are the nosings"]
    count = 0
    for stairway in stairways:
        vertices, triangles = stairway.surface()
        nosings = stairway.edges().reshape(-1, 3)
        lines.append(f"o stairway_{stairway.id}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in np.concatenate([vertices, nosings])]
        lines += [f"f {a} {b} {c}" for a, b, c in triangles + count + 1]
        first = count + len(vertices) + 1
        lines += [f"l {first + index} {first + index + 1}" for index in range(0, len(nosings), 2)]
        count += len(vertices) + len(nosings)
    return "\n".join(lines) + "\n"


def dump_obj(stairways: Sequence[Stairway], path: Path) -> None:
    """Write the surfaces and nosings of stairways to a Wavefront OBJ file; see ``obj_from_stairways``.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    try:
        path.write_text(obj_from_stairways(stairways), encoding="ascii")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error
