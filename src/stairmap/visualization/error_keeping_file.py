"""A file for writers that cannot pass an error on: it keeps the error until somebody asks."""

from __future__ import annotations

import os
from pathlib import Path

from stairmap.errors import OutputError


class ErrorKeepingFile:
    """A binary file that takes everything and keeps the first error, such as a full disk.

    foxglove-sdk writes from other threads and from destructors, where an exception would be lost or end the
    program.

    Parameters
    ----------
    path
        The file; an existing one is replaced.

    Raises
    ------
    OutputError
        If it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._error: OSError | None = None
        self._position = self._end = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror}") from error

    def check(self) -> None:
        """Raise what went wrong so far.

        Raises
        ------
        OutputError
            If something could not be written.
        """
        if self._error is not None:
            raise OutputError(f"cannot write {self._path}: {self._error.strerror}") from self._error

    def write(self, content: bytes) -> int:
        """Write everything; after an error nothing more, but count on, since writers compare positions."""
        size = len(content)
        if self._error is None:
            try:
                self._write_all(content)
            except OSError as error:
                self._error = error
        self._position += size
        self._end = max(self._end, self._position)
        return size

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move as a file does."""
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._end}[whence]
        self._position = start + offset
        if self._error is None:
            self._file.seek(self._position)
        return self._position

    def _write_all(self, content: bytes) -> None:
        rest = memoryview(content)
        while rest:
            rest = rest[self._file.write(rest) :]

    def flush(self) -> None:
        """Do nothing: nothing is held back."""

    def close(self) -> None:
        """Close the file."""
        try:
            self._file.close()
        except OSError as error:
            self._error = self._error or error
