"""A disk that becomes full, without one: writing fails when a budget of bytes is used up."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from stairmap import output_files


class FullDisk:
    """Lets the writers of stairmap write so many bytes and no more; what is removed comes back.

    Parameters
    ----------
    monkeypatch
        Of the test.
    folder
        What counts: the files in it.
    size
        Bytes.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, folder: Path, size: int) -> None:
        self._folder, self.size = folder, size
        self.reserved = 0
        monkeypatch.setattr(output_files, "_write_all", self._write_all)
        monkeypatch.setattr(output_files, "_free_space", lambda _: self.free)
        monkeypatch.setattr(os, "posix_fallocate", self._reserve)
        release = output_files.ReservedSpace.release

        def release_all(space: output_files.ReservedSpace) -> None:
            self.reserved = 0
            release(space)

        monkeypatch.setattr(output_files.ReservedSpace, "release", release_all)

    @property
    def free(self) -> int:
        used = sum(path.stat().st_size for path in self._folder.rglob("*") if path.is_file())
        return max(0, self.size - used - self.reserved)

    def _reserve(self, descriptor: int, offset: int, size: int) -> None:
        if size > self.free:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.reserved = size

    def _write_all(self, descriptor: int, content: bytes) -> None:
        part = content[: self.free]
        os.write(descriptor, part)
        if len(part) < len(content):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
