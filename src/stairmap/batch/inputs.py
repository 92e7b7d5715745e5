"""Find the recordings that a batch was asked for: paths, folders of them, globs, lists, addresses."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from stairmap.batch.addresses import find_at_address, is_address
from stairmap.errors import BatchError
from stairmap.input_files import read_lines, shown
from stairmap.recordings.image_folder import DEPTH_LIST

BAG_ENDINGS = (".bag", ".mcap", ".db3")
CLOUD_ENDINGS = (".pcd", ".ply", ".las", ".laz", ".e57", ".xyz")
ROSBAG2_METADATA = "metadata.yaml"

LIST_MARK = "@"
_GLOB_MARKS = ("*", "?", "[")


def find_inputs(arguments: Sequence[str]) -> tuple[str, ...]:
    """Return every recording once, in the order of the arguments, folders and globs in the order of names.

    Parameters
    ----------
    arguments
        Paths of recordings and clouds; folders that hold such at any depth; globs; addresses that fsspec
        knows (``s3://…``); ``@FILE`` for a text file with one of these a line, relative to the working
        directory, ``#`` before comments.

    Returns
    -------
    Absolute paths and addresses. What is not there is returned too: it becomes a row that says so.

    Raises
    ------
    BatchError
        If a list cannot be read, or nothing was asked for.
    """
    found = dict.fromkeys(item for argument in arguments for item in _find(argument, depth=0))
    if not found:
        raise BatchError("expected recordings, but the arguments name none; see: stairmap batch --help")
    return tuple(found)


def _find(argument: str, *, depth: int) -> Iterator[str]:
    if argument.startswith(LIST_MARK):
        if depth:
            raise BatchError(f"the list {argument[1:]} is named in a list; name it on the command line")
        for line in _list_lines(Path(argument[1:])):
            yield from _find(line, depth=1)
    elif is_address(argument):
        yield from find_at_address(argument, recording_folders=recording_folders)
    elif any(mark in argument for mark in _GLOB_MARKS) and not os.path.lexists(argument):
        # ``glob`` keeps names that are no UTF-8, and matches folders and files.
        matches = sorted(glob.glob(argument, recursive=True))  # noqa: PTH207
        for match in matches or [argument]:
            yield from _find_at_path(Path(match))
    else:
        yield from _find_at_path(Path(argument))


def _list_lines(path: Path) -> Iterator[str]:
    for line, _ in read_lines(path, error_type=BatchError):
        text = line.strip()
        if text and not text.startswith("#"):
            yield text


def _find_at_path(path: Path) -> Iterator[str]:
    path = Path(os.path.abspath(path))  # noqa: PTH100 - a link stays what it is called
    if not path.is_dir():
        yield str(path)
        return
    found = False
    for folder, folders, files in os.walk(path, onerror=lambda _: None, followlinks=True):
        here = recording_folders(folder, files)
        if here == [folder]:
            folders.clear()
        folders.sort()
        folders[:] = [name for name in folders if not name.startswith(".")]
        found = found or bool(here)
        yield from here
    if not found:
        yield str(path)


def recording_folders(folder: str, files: Sequence[str]) -> list[str]:
    """Return the recordings in a folder with these files: the folder itself, or single files of it."""
    if DEPTH_LIST in files or ROSBAG2_METADATA in files:
        return [folder]
    endings = (*BAG_ENDINGS, *CLOUD_ENDINGS)
    return [
        f"{folder.rstrip('/')}/{name}"
        for name in sorted(files)
        if name.lower().endswith(endings) and not name.startswith(".")
    ]


def is_cloud(recording: str) -> bool:
    """Tell whether a path or address is that of a point cloud, by its ending."""
    return recording.lower().endswith(CLOUD_ENDINGS)


def describe_missing(recording: str) -> str:
    """Return the reason for a row of a recording that is not there."""
    return f"expected a recording, but there is no {shown(recording)}; check the path"
