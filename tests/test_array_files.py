"""Arrays that NumPy saved are read whole, or it is said in a line why not."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from stairmap import array_files
from stairmap.array_files import load_arrays
from stairmap.errors import RecordingError


@pytest.fixture
def path(tmp_path: Path) -> Path:
    np.savez_compressed(tmp_path / "arrays.npz", heights=np.arange(600.0).reshape(20, 30), resolution=0.05)
    return tmp_path / "arrays.npz"


def check_told(path: Path, words: str) -> None:
    with pytest.raises(ValueError, match=words) as told:
        load_arrays(path, error_type=RecordingError)
    assert "\n" not in str(told.value) and len(str(told.value)) < 250


def test_arrays_come_back_as_they_were_saved(path: Path) -> None:
    arrays = load_arrays(path, error_type=RecordingError)
    assert set(arrays) == {"heights", "resolution"}
    np.testing.assert_array_equal(arrays["heights"], np.arange(600.0).reshape(20, 30))
    assert float(arrays["resolution"]) == 0.05


def test_other_files_and_folders_are_told(path: Path, tmp_path: Path) -> None:
    np.save(tmp_path / "one.npy", np.zeros(3))
    check_told(tmp_path / "one.npy", "it is no .npz file of NumPy, or it was cut off")
    (tmp_path / "cut.npz").write_bytes(path.read_bytes()[:-30])
    check_told(tmp_path / "cut.npz", "it is no .npz file of NumPy, or it was cut off")
    for name in ("", "nowhere.npz"):
        with pytest.raises(RecordingError, match="cannot read"):
            load_arrays(tmp_path / name, error_type=RecordingError)


def test_objects_are_not_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "objects.npz", things=np.array([{}, None], dtype=object))
    check_told(tmp_path / "objects.npz", "it is damaged: Object arrays cannot be loaded")


@pytest.mark.parametrize("header", [b"{'descr': '<f8', 'shape': (3,\n", b"\0" * 30 + b"\n"])
def test_header_that_no_parser_understands_is_told(header: bytes, tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "odd.npz", "w") as archive:
        archive.writestr("odd.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)
    check_told(tmp_path / "odd.npz", "it is damaged: ")


def test_stream_that_cannot_be_unpacked_is_told(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[60:90] = b"\xff" * 30
    path.write_bytes(content)
    check_told(path, "it is damaged: Error -3 while decompressing data")


def test_arrays_that_fill_the_memory_are_told_before_they_are_read(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with zipfile.ZipFile(path) as archive:
        size = sum(part.file_size for part in archive.infolist())
    monkeypatch.setattr(array_files, "MAX_ARRAYS_SIZE", size)
    assert len(load_arrays(path, error_type=RecordingError)) == 2
    monkeypatch.setattr(array_files, "MAX_ARRAYS_SIZE", size - 1)
    check_told(path, "is it another kind of file")
