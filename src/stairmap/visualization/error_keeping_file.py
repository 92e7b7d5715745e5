"""A file for writers that cannot pass an error on: it keeps the error until somebody asks."""

from __future__ import annotations

import os
from pathlib import Path

from stairmap.output_files import discard_partial, output_error, partial_path


class ErrorKeepingFile:
    """A binary file that takes everything and keeps the first error, such as a full disk.

    foxglove-sdk writes from other threads and from destructors, where an exception would be lost or end the
    program.

    Parameters
    ----------
    path
        The file; it takes its name when it is closed without an error. A device is written to as it is.

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
            is_device = path.exists() and not path.is_file()
            self._written = path if is_device else partial_path(path)
            self._file = self._written.open("wb", buffering=0)
        except OSError as error:
            raise output_error(path, error) from error

    def check(self) -> None:
        """Raise what went wrong so far.

        Raises
        ------
        OutputError
            If something could not be written.
        """
        if self._error is not None:
            raise output_error(self._path, self._error) from self._error

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
        """Close the file and give it its name; after an error, remove it."""
        try:
            self._file.close()
            if self._error is None and self._written != self._path:
                self._written.replace(self._path)
        except OSError as error:
            self._error = self._error or error
        if self._error is not None:
            discard_partial(self._path)
