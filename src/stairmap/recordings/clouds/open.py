"""Open a file of points, whatever its format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from stairmap.errors import RecordingError
from stairmap.input_files import check_is_file, shown
from stairmap.recordings.clouds.cloud import Cloud
from stairmap.recordings.clouds.e57_file import open_e57
from stairmap.recordings.clouds.height_file import open_height_grid
from stairmap.recordings.clouds.las import open_las
from stairmap.recordings.clouds.pcd import open_pcd
from stairmap.recordings.clouds.ply import open_ply
from stairmap.recordings.clouds.text import open_text

MAX_FILE_SIZE = 2**40
"""Largest file, bytes."""

_MAGIC_SIZE = 8

_BY_MAGIC: tuple[tuple[bytes, Callable[[Path], Cloud]], ...] = (
    (b"ply\n", open_ply),
    (b"ply\r", open_ply),
    (b"LASF", open_las),
    (b"ASTM-E57", open_e57),
    (b"# .PCD", open_pcd),
    (b"VERSION", open_pcd),
)

_BY_SUFFIX: dict[str, Callable[[Path], Cloud]] = {
    ".pcd": open_pcd, ".ply": open_ply, ".las": open_las, ".laz": open_las, ".e57": open_e57,
    ".xyz": open_text, ".txt": open_text, ".asc": open_text, ".csv": open_text, ".pts": open_text,
    ".npz": open_height_grid,
}  # fmt: skip

CLOUD_SUFFIXES = tuple(_BY_SUFFIX)
"""Endings of files that are taken for points."""


def open_cloud(path: Path) -> Cloud:
    """Open a file of points; its format is recognised by its first bytes, else by its ending.

    Raises
    ------
    RecordingError
        If it is no regular file, of no known format, empty, or broken.
    MissingPackageError
        If its format needs a package that is not installed.
    """
    check_is_file(path, max_size=MAX_FILE_SIZE, error_type=RecordingError)
    try:
        with path.open("rb") as file:
            magic = file.read(_MAGIC_SIZE)
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error
    if not magic:
        raise RecordingError(f"{shown(path)} is empty")
    for begin, open_format in _BY_MAGIC:
        if magic.startswith(begin):
            return open_format(path)
    open_format_by_suffix = _BY_SUFFIX.get(path.suffix.lower())
    if open_format_by_suffix is None:
        raise RecordingError(
            f"expected a file of points ({', '.join(CLOUD_SUFFIXES)}), but {shown(path)} is not one that "
            "is known"
        )
    return open_format_by_suffix(path)
