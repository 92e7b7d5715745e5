"""A map file belongs to one node: two that write it would take each other's stairways away. No ROS in
here."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from stairmap.errors import StairmapError


class MapFileError(StairmapError):
    """The map file cannot be read or written."""


class MapFileLock:
    """Holds a map file until it is released or the process ends, however it ends.

    Parameters
    ----------
    path
        The map file. The lock is on ``NAME.npz.lock`` beside it, which stays.

    Raises
    ------
    MapFileError
        If another node has it.
    """

    def __init__(self, path: Path) -> None:
        lock = path.with_name(f"{path.name}.lock")
        try:
            self._file = lock.open("a+", encoding="utf-8")
        except OSError as error:
            raise MapFileError(f"the lock {lock} of map_file cannot be made: {error.strerror}") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self._file.seek(0)
            holder = self._file.read(100).strip() or "another process"
            self._file.close()
            raise MapFileError(
                f"map_file {path} is in use by {holder}; end that node, or name another map_file"
            ) from error
        self._file.truncate(0)
        self._file.write(f"process {os.getpid()}\n")
        self._file.flush()

    def release(self) -> None:
        """Let another node have the file."""
        self._file.close()
