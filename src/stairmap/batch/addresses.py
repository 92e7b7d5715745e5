"""Addresses of object stores and other file systems (fsspec), such as ``s3://bucket/recordings``.

fsspec is imported here only; it comes with the extra ``cluster``, and each store has a package of its own
(s3fs, gcsfs, adlfs).
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from stairmap.errors import BatchError, MissingPackageError, OutputError, RecordingError, StairmapError

_ADDRESS = re.compile(r"^[a-z][a-z0-9+.-]*(::[a-z][a-z0-9+.-]*)*://", re.IGNORECASE)

RecordingFolders = Callable[[str, Sequence[str]], list[str]]


def is_address(text: str) -> bool:
    """Tell whether a text is an address, not a path."""
    return bool(_ADDRESS.match(text))


def find_at_address(address: str, *, recording_folders: RecordingFolders) -> Iterator[str]:
    """Yield the recordings at an address, as addresses; the address itself where it holds none.

    Parameters
    ----------
    address
        Of a recording, a folder or bucket of recordings, or a glob.
    recording_folders
        Tells which recordings a folder with certain files holds.

    Raises
    ------
    BatchError
        If the store does not answer, or there is no package for it.
    """
    files, root = _open(address, BatchError)
    with _told(f"cannot list {address}", BatchError):
        roots = sorted(files.glob(root)) if any(mark in root for mark in "*?[") else [root]
        for path in roots or [root]:
            found = False
            done: list[str] = []
            for folder, _, names in files.walk(path):
                if any(folder == above or folder.startswith(f"{above}/") for above in done):
                    continue
                here = recording_folders(folder, list(names))
                done += [folder] if here == [folder] else []
                found = found or bool(here)
                yield from (files.unstrip_protocol(item) for item in here)
            if not found:
                yield files.unstrip_protocol(path)


def fetch_recording(address: str, scratch: Path) -> Path:
    """Copy a recording from an address into a folder of this machine; return where it is.

    Raises
    ------
    RecordingError
        If it is not there or cannot be read.
    """
    files, path = _open(address, RecordingError)
    target = scratch / path.rstrip("/").rpartition("/")[2]
    with _told(f"cannot read {address}", RecordingError):
        if not files.exists(path):
            raise RecordingError(f"expected a recording, but there is no {address}; check the address")
        files.get(path, str(target), recursive=True)
    return target


class AddressStore:
    """The files of a batch at an address.

    Parameters
    ----------
    address
        Of the folder.

    Raises
    ------
    OutputError
        If there is no package for it.
    """

    def __init__(self, address: str) -> None:
        self._files, self._root = _open(address.rstrip("/"), OutputError)
        self._address = address

    def read(self, name: str) -> bytes | None:
        """Return what a file holds; ``None`` where there is none."""
        content: bytes | None = None
        with (
            _told(f"cannot read {self._address}/{name}", OutputError),
            contextlib.suppress(FileNotFoundError),
        ):
            content = self._files.cat_file(f"{self._root}/{name}")
        return content

    def write(self, name: str, content: bytes) -> None:
        """Write a file; object stores show it whole or not at all."""
        path = f"{self._root}/{name}"
        with _told(f"cannot write {self._address}/{name}", OutputError):
            self._files.makedirs(path.rpartition("/")[0], exist_ok=True)
            self._files.pipe_file(path, content)

    def names(self, folder: str = "") -> list[str]:
        """Return the names in a folder, sorted; none where there is no such folder."""
        path = f"{self._root}/{folder}".rstrip("/")
        entries: list[str] = []
        with _told(f"cannot list {self._address}", OutputError), contextlib.suppress(FileNotFoundError):
            self._files.invalidate_cache()
            entries = self._files.ls(path, detail=False)
        return sorted(entry.rstrip("/").rpartition("/")[2] for entry in entries)

    def put_folder(self, source: Path, name: str, *, last: str) -> None:
        """Copy a folder there; the file ``last`` comes after all others, and says so that all are there."""
        for file in sorted(source.rglob("*"), key=lambda file: file.name == last):
            if file.is_file():
                self.write(f"{name}/{file.relative_to(source).as_posix()}", file.read_bytes())


def _open(address: str, error_type: type[BatchError | OutputError | RecordingError]) -> tuple[Any, str]:
    try:
        import fsspec  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("fsspec", "cluster", f"reading {address}") from error
    with _told(f"cannot reach {address}", error_type):
        files, path = fsspec.core.url_to_fs(address)
    return files, path.rstrip("/")


@contextmanager
def _told(what: str, error_type: type[StairmapError]) -> Iterator[None]:
    """Tell in a line whatever a store raises: each package has errors of its own, of no common kind."""
    try:
        yield
    except StairmapError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise error_type(f"{what}: {reason}") from error
