"""A file that keeps its error until somebody asks."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from stairmap.errors import OutputError
from stairmap.visualization.error_keeping_file import ErrorKeepingFile


def test_without_an_error_it_is_a_file(tmp_path):
    file = ErrorKeepingFile(tmp_path / "new" / "file")
    assert file.write(b"hello world") == 11
    assert file.seek(6) == 6
    assert file.write(b"there") == 5
    assert file.seek(-5, os.SEEK_CUR) == 6
    assert file.seek(0, os.SEEK_END) == 11
    file.write(b"!")
    file.flush()
    file.close()
    file.check()
    assert (tmp_path / "new" / "file").read_bytes() == b"hello there!"


def test_after_an_error_it_counts_on_and_tells_when_asked():
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    file = ErrorKeepingFile(Path("/dev/full"))
    assert file.write(b"hello") == 5
    assert file.write(b"world") == 5
    assert file.seek(0, os.SEEK_CUR) == 10
    with pytest.raises(OutputError, match="cannot write /dev/full: No space left on device"):
        file.check()
    file.close()


def test_folder_is_no_file(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        ErrorKeepingFile(tmp_path)
