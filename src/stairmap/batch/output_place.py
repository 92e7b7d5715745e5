"""Where a batch leaves its files: a folder of this machine, or an address (``stairmap.batch.addresses``)."""

from __future__ import annotations

import io
import os
import shutil
import socket
import zipfile
from pathlib import Path
from typing import Protocol

from stairmap.batch.addresses import AddressStore, is_address
from stairmap.errors import OutputError
from stairmap.output_files import output_error, write_whole

TASK_FILE = "task.json"
"""The last file of a run folder: it is all there, and this came of it."""

TOKEN_FILE = ".batch-token"
"""By its content a worker knows that it sees the batch's own disk."""

PARTIAL_FOLDER = ".partial"
"""Where run folders are made before they take their names."""


class OutputPlace(Protocol):
    """A folder of a batch."""

    def read(self, name: str) -> bytes | None:
        """Return what a file holds; ``None`` where there is none."""
        ...

    def write(self, name: str, content: bytes) -> None:
        """Write a file, whole or not at all."""
        ...

    def names(self, folder: str = "") -> list[str]:
        """Return the names in a folder, sorted."""
        ...

    def put_folder(self, source: Path, name: str, *, last: str) -> None:
        """Put a run folder there, whole or recognisably unfinished: without ``last``."""
        ...


class LocalPlace:
    """A folder of this machine.

    Parameters
    ----------
    folder
        Its absolute path.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def read(self, name: str) -> bytes | None:
        """Return what a file holds; ``None`` where there is none."""
        try:
            return (self.folder / name).read_bytes()
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise OutputError(f"cannot read {self.folder / name}: {error.strerror}") from error

    def write(self, name: str, content: bytes) -> None:
        """Write a file, whole or not at all."""
        write_whole(self.folder / name, content)

    def names(self, folder: str = "") -> list[str]:
        """Return the names in a folder, sorted; none where there is no such folder."""
        path = self.folder / folder
        return sorted(entry.name for entry in path.iterdir()) if path.is_dir() else []

    def put_folder(self, source: Path, name: str, *, last: str) -> None:
        """Rename a folder to its place, on the same disk; one that is there already stays.

        Raises
        ------
        OutputError
            If it cannot be put there.
        """
        target = self.folder / name
        try:
            source.rename(target)
        except OSError as error:
            if not (target / last).is_file():
                raise output_error(target, error) from error
            # Another worker was thought lost, and was not: its folder is as good.
            shutil.rmtree(source, ignore_errors=True)


def open_place(output: str) -> OutputPlace:
    """Return the place that a path or an address names.

    Raises
    ------
    OutputError
        If there is no package for the address.
    """
    return AddressStore(output) if is_address(output) else LocalPlace(Path(output))


def partial_folder(output: Path, folder: str, process_id: int) -> Path:
    """Return where a process makes a run folder of a batch on its disk."""
    return output / PARTIAL_FOLDER / f"{folder}-{socket.gethostname()}-{process_id}"


def remove_abandoned(output: Path) -> None:
    """Remove what processes of this machine left half done that are not there any more."""
    partial = output / PARTIAL_FOLDER
    if not partial.is_dir():
        return
    for entry in partial.iterdir():
        head, _, process_id = entry.name.rpartition("-")
        if (
            head.endswith(f"-{socket.gethostname()}")
            and process_id.isdigit()
            and not _is_alive(int(process_id))
        ):
            shutil.rmtree(entry, ignore_errors=True)


def pack_folder(folder: Path) -> bytes:
    """Return a folder as a ZIP archive."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(folder.rglob("*")):
            if file.is_file():
                archive.write(file, file.relative_to(folder).as_posix())
    return content.getvalue()


def unpack_folder(content: bytes, folder: Path) -> None:
    """Make a folder of what ``pack_folder`` returned.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    try:
        folder.mkdir(parents=True)
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            archive.extractall(folder)
    except OSError as error:
        raise output_error(folder, error) from error


def _is_alive(process_id: int) -> bool:
    try:
        os.kill(process_id, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
