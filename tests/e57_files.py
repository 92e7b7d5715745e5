"""Write small E57 files (ASTM E2807): pages with checksums around a vector of points and an XML section."""

from __future__ import annotations

import struct
from pathlib import Path

from stairmap.arrays import Points

PAGE = 1024
"""Bytes of a page with its checksum."""

_CHECKSUM = 4
_DATA = PAGE - _CHECKSUM
_HEADER = 48
_SECTION_HEADER = 32
_POLYNOMIAL = 0x82F63B78
"""CRC-32C, the lowest bit first."""


def _crc_table() -> list[int]:
    table = []
    for value in range(256):
        for _ in range(8):
            value = value >> 1 ^ (_POLYNOMIAL if value & 1 else 0)  # noqa: PLW2901
        table.append(value)
    return table


_TABLE = _crc_table()


def crc32c(content: bytes) -> int:
    """Return the checksum of a page's data."""
    value = 0xFFFFFFFF
    for byte in content:
        value = _TABLE[(value ^ byte) & 0xFF] ^ value >> 8
    return value ^ 0xFFFFFFFF


def paged(content: bytes) -> bytes:
    """Put the content of a file into pages, each with its checksum."""
    pages = (content[start : start + _DATA].ljust(_DATA, b"\0") for start in range(0, len(content), _DATA))
    return b"".join(page + struct.pack(">I", crc32c(page)) for page in pages)


def _physical(offset: int) -> int:
    """Return where in the file a byte of the content stands."""
    return offset // _DATA * PAGE + offset % _DATA


SCAN = """<vectorChild type="Structure">
<guid type="String"><![CDATA[scan]]></guid>
<points type="CompressedVector" fileOffset="{offset}" recordCount="{count}">
<prototype type="Structure">
<cartesianX type="Float"/>
<cartesianY type="Float"/>
<cartesianZ type="Float"/>
</prototype>
<codecs type="Vector" allowHeterogeneousChildren="1"></codecs>
</points>
</vectorChild>
"""
"""A scan without a pose."""

_POSE = """<pose type="Structure">
<rotation type="Structure">
<w type="Float">0.7071067811865476</w>
<x type="Float">0</x>
<y type="Float">0</y>
<z type="Float">0.7071067811865476</z>
</rotation>
<translation type="Structure">
<x type="Float">0</x>
<y type="Float">0</y>
<z type="Float">1</z>
</translation>
</pose>
"""

_XML = """<?xml version="1.0" encoding="UTF-8"?>
<e57Root type="Structure" xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0">
<formatName type="String"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>
<guid type="String"><![CDATA[file]]></guid>
<versionMajor type="Integer">1</versionMajor>
<versionMinor type="Integer">0</versionMinor>
<data3D type="Vector" allowHeterogeneousChildren="1">
{scans}</data3D>
</e57Root>
"""


def posed(scan: str) -> str:
    """Turn a scan by a quarter about z and lift it by 1 m."""
    return scan.replace("<points", f"{_POSE}<points")


def e57_content(points: Points, scans: str = SCAN) -> bytes:
    """Return an E57 file, without its checksums, of scans that all have these points, in metres."""
    streams = [points[:, column].astype("<f8").tobytes() for column in range(3)]
    lengths = struct.pack("<3H", *map(len, streams))
    packet = lengths + b"".join(streams)
    packet += bytes(-(6 + len(packet)) % 4)
    packet = struct.pack("<BBHH", 1, 0, 6 + len(packet) - 1, len(streams)) + packet
    length = _SECTION_HEADER + len(packet)
    section = struct.pack("<B7xQQQ", 1, length, _physical(_HEADER + _SECTION_HEADER), 0) + packet
    xml = _XML.format(scans=scans.format(offset=_HEADER, count=len(points))).encode()
    at = _HEADER + len(section)
    num_pages = -(-(at + len(xml)) // _DATA)
    header = b"ASTM-E57" + struct.pack("<IIQQQQ", 1, 0, num_pages * PAGE, _physical(at), len(xml), PAGE)
    return header + section + xml


def write_e57(path: Path, points: Points, scans: str = SCAN) -> None:
    """Write an E57 file."""
    path.write_bytes(paged(e57_content(points, scans)))
