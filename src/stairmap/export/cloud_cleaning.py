"""Put the exact surfaces of stairs in the place of the smeared ones of a map of points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from stairmap.arrays import Mask, Points, Transform
from stairmap.errors import OutputError
from stairmap.export.stair_points import points_from_stairways
from stairmap.input_files import shown
from stairmap.output_files import discard_partial, output_error, partial_path
from stairmap.recordings.clouds.cloud import Cloud, is_measured
from stairmap.stairway import Flight, Stairway
from stairmap.transforms import invert_transform, transform_points

SMEAR_BELOW, SMEAR_ABOVE = 1.0, 0.7
"""Points from so many rises below the treads to so many above them are the smeared stairs: a handrail is
higher."""

SIDE_MARGIN = 0.02
"""Points this far beyond the sides of the steps are theirs too, m."""

BEYOND = 0.3
"""Points so many runs before the first riser and behind the last are smeared stairs too, above the floor."""

MAX_PCD_COORDINATE = 10_000.0
"""Farther from the origin a float is off by half a millimetre, m."""

SUFFIXES = (".ply", ".pcd")
"""Endings of files that are written."""


def are_on_stairs(points: Points, stairways: Sequence[Stairway]) -> Mask:
    """Tell which of (N, 3) points of the map belong to the steps of stairways."""
    on = np.zeros(len(points), dtype=bool)
    for stairway in stairways:
        for flight in stairway.flights:
            on |= _are_on_flight(points, flight)
    return on


def _are_on_flight(points: Points, flight: Flight) -> Mask:
    box = flight.box
    reach = float(np.hypot(box.depth, box.width)) / 2 + flight.run
    near = np.all(np.abs(points[:, :2] - box.center[:2]) < reach, axis=1)
    on = np.zeros(len(points), dtype=bool)
    s, t, z = transform_points(invert_transform(flight.map_from_flight), points[near]).T
    step = np.floor(s / flight.run).clip(0, flight.num_risers - 1)
    over = z - (step + 1) * flight.rise
    margin = BEYOND * flight.run
    end = (flight.num_risers - 1) * flight.run
    inside = (np.abs(t) < flight.width / 2 + SIDE_MARGIN) & (s > 0) & (s < end)
    inside &= (over > -SMEAR_BELOW * flight.rise) & (over < SMEAR_ABOVE * flight.rise)
    # Before the first riser and behind the last nosing only what stands off the floors goes.
    before = (s > -margin) & (s <= 0) & (z > 0.2 * flight.rise) & (z < (1 + SMEAR_ABOVE) * flight.rise)
    top = flight.num_risers * flight.rise
    behind = (s >= end) & (s < end + margin) & (z < top - 0.2 * flight.rise) & (z > top - flight.rise)
    on[near] = inside | ((np.abs(t) < flight.width / 2) & (before | behind))
    return on


def write_clean_cloud(
    path: Path,
    clouds: Sequence[Cloud],
    map_from_file: Transform,
    stairways: Sequence[Stairway],
    *,
    on_points: Callable[[int], None] = lambda _: None,
) -> tuple[int, int]:
    """Write the points of a map with exact stairs; return how many were taken away and how many put there.

    Parameters
    ----------
    path
        New file; its ending says PLY or PCD.
    clouds
        The files of the map.
    map_from_file
        (4, 4) their coordinates in the stairways' map; points are written in the map.
    stairways
        The stairways.
    on_points
        Told how many more points were read.

    Raises
    ------
    OutputError
        If the file has another ending or cannot be written.
    RecordingError
        If a file of the map cannot be read.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise OutputError(f"expected a file that ends in {' or '.join(SUFFIXES)}, got {shown(path)}")
    added = points_from_stairways(stairways).points
    partial = partial_path(path)
    num_removed = 0

    def kept() -> Iterator[Points]:
        nonlocal num_removed
        for cloud in clouds:
            for chunk in cloud.chunks():
                on_points(len(chunk))
                points = chunk[is_measured(chunk)]
                points = transform_points(map_from_file, points)
                on = are_on_stairs(points, stairways)
                num_removed += int(np.count_nonzero(on))
                yield points[~on]
        yield added

    try:
        write = _write_ply if path.suffix.lower() == ".ply" else _write_pcd
        write(partial, kept())
        partial.replace(path)
    except OSError as error:
        raise output_error(path, error) from error
    finally:
        discard_partial(path)
    return num_removed, len(added)


_COUNT_DIGITS = 12
"""Digits of the number of points in a header, which is known only at the end."""


def _write_ply(path: Path, chunks: Iterator[Points]) -> None:
    def header(count: int) -> bytes:
        return (
            "ply\nformat binary_little_endian 1.0\ncomment stairmap clean, metres, z up\n"
            f"element vertex {count:0{_COUNT_DIGITS}d}\n"
            "property double x\nproperty double y\nproperty double z\nend_header\n"
        ).encode("ascii")

    _write(path, chunks, header, "<f8")


def _write_pcd(path: Path, chunks: Iterator[Points]) -> None:
    def header(count: int) -> bytes:
        number = f"{count:0{_COUNT_DIGITS}d}"
        return (
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n"
            f"COUNT 1 1 1\nWIDTH {number}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {number}\nDATA binary\n"
        ).encode("ascii")

    def near(chunks: Iterator[Points]) -> Iterator[Points]:
        for points in chunks:
            if len(points) and np.abs(points).max() > MAX_PCD_COORDINATE:
                raise OutputError(
                    f"PCD holds floats, which lose millimetres beyond {MAX_PCD_COORDINATE:g} m from the "
                    "origin; name a file that ends in .ply"
                )
            yield points

    _write(path, near(chunks), header, "<f4")


def _write(path: Path, chunks: Iterator[Points], header: Callable[[int], bytes], kind: str) -> None:
    """Write points behind a header whose count is filled in at the end."""
    count = 0
    with path.open("wb") as file:
        file.write(header(0))
        for points in chunks:
            file.write(points.astype(kind).tobytes())
            count += len(points)
        file.seek(0)
        file.write(header(count))
