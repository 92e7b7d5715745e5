"""Write small files of points in every format."""

from __future__ import annotations

import struct
from pathlib import Path

import laspy
import numpy as np

from stairmap.arrays import Points

POINTS = np.round(np.random.default_rng(5).uniform(-4.0, 4.0, (40, 3)), 3)
"""(40, 3) points, m."""


def _pcd_header(num_points: int, data: str) -> bytes:
    return (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n"
        f"COUNT 1 1 1\nVIEWPOINT 0 0 0 1 0 0 0\nWIDTH {num_points}\nHEIGHT 1\nPOINTS {num_points}\n"
        f"DATA {data}\n"
    ).encode()


def write_ascii_pcd(path: Path, points: Points) -> None:
    """Write a PCD file of text."""
    lines = "".join(" ".join(f"{value:.4f}" for value in point) + "\n" for point in points)
    path.write_bytes(_pcd_header(len(points), "ascii") + lines.encode())


def write_binary_pcd(path: Path, points: Points) -> None:
    """Write a binary PCD file."""
    path.write_bytes(_pcd_header(len(points), "binary") + points.astype("<f4").tobytes())


def write_organised_pcd(path: Path, points: Points) -> None:
    """Write (height, width, 3) points as the image of a depth camera, NaN where nothing was measured."""
    height, width = points.shape[:2]
    header = _pcd_header(height * width, "binary").decode()
    header = header.replace(f"WIDTH {height * width}", f"WIDTH {width}").replace(
        "HEIGHT 1", f"HEIGHT {height}"
    )
    path.write_bytes(header.encode() + points.reshape(-1, 3).astype("<f4").tobytes())


def write_compressed_pcd(path: Path, points: Points) -> None:
    """Write a compressed PCD file: LZF that only copies, in which each axis stands by itself."""
    data = points.astype("<f4").T.tobytes()
    packed = b"".join(
        bytes([len(part) - 1]) + part for part in (data[i : i + 32] for i in range(0, len(data), 32))
    )
    sizes = struct.pack("<II", len(packed), len(data))
    path.write_bytes(_pcd_header(len(points), "binary_compressed") + sizes + packed)


def _ply_header(num_points: int, data: str, kind: str) -> bytes:
    return (
        f"ply\nformat {data} 1.0\ncomment made for a test\nelement vertex {num_points}\nproperty uchar red\n"
        f"property {kind} x\nproperty {kind} y\nproperty {kind} z\nelement face 0\n"
        "property list uchar int vertex_indices\nend_header\n"
    ).encode()


def write_ascii_ply(path: Path, points: Points) -> None:
    """Write a PLY file of text, with a colour before the coordinates."""
    lines = "".join("7 " + " ".join(f"{value:.4f}" for value in point) + "\n" for point in points)
    path.write_bytes(_ply_header(len(points), "ascii", "double") + lines.encode())


def write_binary_ply(path: Path, points: Points, *, order: str) -> None:
    """Write a binary PLY file of a byte order, < or >, with a colour before the coordinates."""
    records = np.zeros(len(points), dtype=[("red", "u1"), *((axis, f"{order}f4") for axis in "xyz")])
    for column, axis in enumerate("xyz"):
        records[axis] = points[:, column]
    data = "binary_little_endian" if order == "<" else "binary_big_endian"
    path.write_bytes(_ply_header(len(points), data, "float") + records.tobytes())


def write_las(path: Path, points: Points) -> None:
    """Write a LAS or, by the name's ending, a LAZ file with millimetres."""
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.offsets, header.scales = np.floor(points.min(axis=0)), np.full(3, 0.001)
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.write(path)


def write_xyz(path: Path, points: Points) -> None:
    """Write plain text."""
    path.write_text("".join(" ".join(f"{value:.4f}" for value in point) + "\n" for point in points))
