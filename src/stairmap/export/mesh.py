"""The clean stair surface as PLY and OBJ meshes, to look at or to repair a map with.

The PLY file has vertices and faces alone. PLY knows edges, too, but of common readers meshio refuses a
file that holds them and trimesh fails on coloured ones; so the colour of vertices tells the nosings.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stairmap.arrays import Mask, Points
from stairmap.output_files import write_whole, write_whole_text
from stairmap.stairway import Stairway

_SURFACE_COLOR = (160, 174, 186)
_NOSING_COLOR = (213, 94, 0)

_VERTEX = np.dtype([("position", "<f8", 3), ("color", "u1", 3)])
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])

_HEADER = """\
ply
format binary_little_endian 1.0
comment stairways, metres, map coordinates, z up; orange vertices are the nosings
element vertex {num_vertices}
property double x
property double y
property double z
property uchar red
property uchar green
property uchar blue
element face {num_faces}
property list uchar int vertex_indices
end_header
"""


def ply_from_stairways(stairways: Sequence[Stairway]) -> bytes:
    """Return a binary little-endian PLY file of the surfaces of stairways, with coloured nosings.

    Positions are doubles, because maps in UTM coordinates lose centimetres as floats. The orange
    vertices are the ends of the nosings, lowest first, left end first. Without a stairway all
    elements are empty.

    Parameters
    ----------
    stairways
        What to write, in map coordinates, m.
    """
    vertex_parts, faces = [np.zeros(0, dtype=_VERTEX)], [np.empty((0, 3), dtype=np.int64)]
    count = 0
    for stairway in stairways:
        vertices, triangles = stairway.surface()
        part = np.zeros(len(vertices), dtype=_VERTEX)
        part["position"] = vertices
        part["color"] = np.where(_are_nosings(stairway, vertices)[:, None], _NOSING_COLOR, _SURFACE_COLOR)
        vertex_parts.append(part)
        faces.append(triangles + count)
        count += len(vertices)
    vertex_table = np.concatenate(vertex_parts)
    face_table = np.zeros(sum(len(part) for part in faces), dtype=_FACE)
    face_table["count"] = 3
    face_table["corners"] = np.concatenate(faces)
    header = _HEADER.format(num_vertices=len(vertex_table), num_faces=len(face_table))
    return header.encode("ascii") + vertex_table.tobytes() + face_table.tobytes()


def _are_nosings(stairway: Stairway, vertices: Points) -> Mask:
    """Tell which (N, 3) vertices of a stairway's surface are ends of nosings."""
    ends = stairway.edges().reshape(-1, 3)
    is_end = np.all(np.abs(vertices[:, None] - ends) < 1e-9, axis=2)
    return np.asarray(np.any(is_end, axis=1))


def dump_ply(stairways: Sequence[Stairway], path: Path) -> None:
    """Write the surfaces of stairways to a PLY file; see ``ply_from_stairways``.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_whole(path, ply_from_stairways(stairways))


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
    write_whole_text(path, obj_from_stairways(stairways))
