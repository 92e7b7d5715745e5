"""Write files that are whole or not at all, and logs whose lines are.

Every file that stairmap leaves behind is written here, so that a full disk, a signal or a pulled plug never
leaves half of one.
"""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
import time
from pathlib import Path
from typing import IO

from stairmap.errors import OutputError

MAX_NAME_LENGTH = 60
"""Characters of a name that a folder is called by: file names have 255 bytes at most."""

MIN_ROOM = 32 * 1024
"""Space that the shortest results need, bytes; a disk with less is full."""

SYNC_PERIOD = 10.0
"""Time between two orders to put a log's lines on the disk itself, s: what a pulled plug may cost."""


def write_whole(path: Path, content: bytes, *, durable: bool = True) -> Path:
    """Write a file so that at any moment the old content or the new one is there, whole; return its path.

    Parameters
    ----------
    path
        The file. A device or pipe is written to as it is.
    content
        All of it.
    durable
        Whether it is to be on the disk, not only in memory, before it takes its name. It costs milliseconds;
        pictures of single frames can do without.

    Raises
    ------
    OutputError
        If it cannot be written; nothing is left of it then.
    """
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            path.write_bytes(content)
            return path
        # A link stays a link.
        target = path.resolve() if path.is_symlink() else path
        _write_and_replace(target, content, durable=durable)
    except OSError as error:
        raise output_error(path, error) from error
    return path


def write_whole_text(path: Path, text: str, *, durable: bool = True) -> Path:
    """Write a text file in UTF-8, whole or not at all; see ``write_whole``.

    What UTF-8 cannot hold, such as a piece of a file name in another encoding, is written as ``\\udcff``.
    """
    return write_whole(path, text.encode("utf-8", "backslashreplace"), durable=durable)


def check_new_file(path: Path, *, option: str) -> None:
    """Refuse to write over a file: the one rule for all outputs. Devices and pipes can be written to.

    Raises
    ------
    OutputError
        If there is such a file or folder.
    """
    try:
        is_there = path.is_file() or path.is_dir()
    except OSError as error:
        raise output_error(path, error) from error
    if is_there:
        raise OutputError(f"{option} {path} is there already and nothing is overwritten; name another")


def check_new_folder(path: Path, *, option: str = "--output") -> None:
    """Refuse a folder that holds something, or a file in its place.

    Raises
    ------
    OutputError
        If it is so.
    """
    try:
        if path.exists() and not path.is_dir():
            raise OutputError(f"{option} {path} is a file; name a folder that is new or empty")
        if path.is_dir() and any(path.iterdir()):
            raise OutputError(
                f"{option} {path} is not empty and results are never overwritten; name another folder"
            )
    except OSError as error:
        raise output_error(path, error) from error


def next_folder(parent: Path, name: str) -> Path:
    """Make the first free folder ``<parent>/<name>_<n>`` and return it.

    Parameters
    ----------
    parent
        Made if it is not there.
    name
        What a file name cannot hold is replaced.

    Raises
    ------
    OutputError
        If it cannot be made.
    """
    name = re.sub(r"[^\w.-]+", "_", name)[:MAX_NAME_LENGTH].strip("._") or "recording"
    try:
        parent.mkdir(parents=True, exist_ok=True)
        taken = [re.fullmatch(rf"{re.escape(name)}_(\d+)", entry.name) for entry in parent.iterdir()]
        number = 1 + max((int(match[1]) for match in taken if match), default=0)
        while True:
            path = parent / f"{name}_{number}"
            try:
                path.mkdir()
            except FileExistsError:  # another process took the number in the meantime
                number += 1
            else:
                return path
    except OSError as error:
        raise OutputError(
            f"{output_error(parent / name, error)}; choose another folder with --output"
        ) from error


def check_has_room(folder: Path) -> None:
    """Refuse a folder on a disk that is full already.

    Raises
    ------
    OutputError
        If less than ``MIN_ROOM`` is free.
    """
    free = _free_space(folder)
    if free is not None and free < MIN_ROOM:
        raise OutputError(
            f"cannot write to {folder}: the disk is full ({free // 1024} KiB are free); make room or choose "
            "another folder with --output"
        )


def _free_space(folder: Path) -> int | None:
    """Bytes that a user may still write to the disk of a folder; ``None`` where nothing tells."""
    try:
        status = os.statvfs(folder)
    except (OSError, AttributeError):
        return None
    return status.f_bavail * status.f_frsize if status.f_blocks else None


def partial_path(path: Path) -> Path:
    """Return where a file is written before it takes its name."""
    return path.with_name(f".{path.name}.partial")


def discard_partial(path: Path) -> None:
    """Remove what was written of a file that did not come to its end."""
    with contextlib.suppress(OSError):
        partial_path(path).unlink(missing_ok=True)


def output_error(path: Path, error: OSError) -> OutputError:
    """Return the error for a file that cannot be written."""
    return OutputError(f"cannot write {path}: {error.strerror or error}")


def _write_and_replace(path: Path, content: bytes, *, durable: bool) -> None:
    partial = partial_path(path)
    try:
        with partial.open("wb", buffering=0) as file:
            _write_all(file.fileno(), content)
            if durable:
                os.fsync(file.fileno())
        partial.replace(path)
    except BaseException:
        discard_partial(path)
        raise


def _write_all(descriptor: int, content: bytes) -> None:
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(descriptor, rest) :]


class LineLog:
    """A file that grows line by line; each line is with the operating system at once, whole.

    Parameters
    ----------
    path
        The file; lines are added to what it holds.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        self._size = os.fstat(self._descriptor).st_size
        self._synced = time.monotonic()

    def append(self, line: str) -> None:
        """Add a line.

        Raises
        ------
        OSError
            If it cannot be written; the lines before it stay, and nothing of this one.
        """
        content = (line + "\n").encode("utf-8", "backslashreplace")
        try:
            _write_all(self._descriptor, content)
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self._size)
            raise
        self._size += len(content)
        if time.monotonic() - self._synced > SYNC_PERIOD:
            self._synced = time.monotonic()
            os.fsync(self._descriptor)

    def close(self) -> None:
        """Close the file.

        Raises
        ------
        OSError
            If what was written did not reach the disk.
        """
        os.close(self._descriptor)


def keep_lines(path: Path, num: int) -> None:
    """Cut a file of lines off behind so many of them; a shorter one, or none, stays.

    Raises
    ------
    OutputError
        If it cannot be read or written.
    """
    size = 0
    try:
        with path.open("rb+") as file:
            for _ in range(num):
                line = file.readline()
                if not line.endswith(b"\n"):
                    break
                size += len(line)
            file.truncate(size)
    except FileNotFoundError:
        return
    except OSError as error:
        raise output_error(path, error) from error


class ReservedSpace:
    """Space on a disk that is kept free for what matters most, until it is released or the process ends.

    Parameters
    ----------
    folder
        A folder on the disk. Where nothing can be reserved in it, nothing is.
    size
        Bytes; at most half of what is free.
    """

    def __init__(self, folder: Path, size: int) -> None:
        self._file: IO[bytes] | None = None
        with contextlib.suppress(OSError, AttributeError):  # a limit on file sizes, a full disk, no Linux
            # It has no name, so that a killed process leaves nothing of it.
            file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115
            with contextlib.ExitStack() as on_error:
                on_error.callback(file.close)
                free = _free_space(folder)
                os.posix_fallocate(file.fileno(), 0, size if free is None else max(1, min(size, free // 2)))
                on_error.pop_all()
                self._file = file

    def release(self) -> None:
        """Give the space back."""
        if self._file is not None:
            with contextlib.suppress(OSError):
                self._file.close()
            self._file = None
