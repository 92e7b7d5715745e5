"""A map file that a disk or a program has spoilt: the node says so in a line, or goes on and answers."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_stairway_map import asked, new_map, shown_map

from corruptions import NUM_NIGHTLY, NUM_QUICK, check_corruptions
from stairmap.stairway import Stairway
from stairmap_ros.map_file import load_map, save_map
from stairmap_ros.map_file_lock import MapFileError

Arrays = dict[str, NDArray[Any]]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("maps") / "map.npz"
    stairway_map = shown_map()
    assert len(stairway_map.stairways()) == 1
    save_map(path, stairway_map.snapshot(), map_frame="map")
    return path.read_bytes()


def answer(path: Path) -> tuple[Stairway, ...]:
    """What a new map says of the file."""
    restored = new_map()
    load_map(path, restored, map_frame="map")
    return asked(restored)


def check_told_or_answered(path: Path) -> str:
    try:
        for stairway in answer(path):
            stairway.to_dict()
    except MapFileError as error:
        assert "\n" not in str(error) and "map_file" in str(error)
        return str(error)
    return ""


def check_often(path: Path, whole: bytes, number: int) -> None:
    path.write_bytes(whole)
    assert len(answer(path)) == 1

    def check(corrupt: Callable[[bytes], bytes]) -> None:
        path.write_bytes(corrupt(whole))
        check_told_or_answered(path)

    check_corruptions(check, number)


def test_corrupt_map_file_is_told_or_read(whole: bytes, tmp_path: Path) -> None:
    check_often(tmp_path / "map.npz", whole, 10 * NUM_QUICK)


@pytest.mark.nightly
def test_corrupt_map_file_is_told_or_read_two_thousand_times(whole: bytes, tmp_path: Path) -> None:
    check_often(tmp_path / "map.npz", whole, NUM_NIGHTLY)


def with_numbers(array: NDArray[Any], value: float) -> NDArray[Any]:
    """All numbers, also those of records, are one."""
    changed = array.copy()
    parts = [changed[field] for field in array.dtype.names] if array.dtype.names else [changed]
    for part in parts:
        if part.dtype.kind in "if":
            part[...] = value if part.dtype.kind == "f" else int(np.nan_to_num(value))
    return changed


CHANGES: dict[str, Callable[[NDArray[Any]], NDArray[Any]]] = {
    "empty": lambda array: np.atleast_1d(array)[:0],
    "half": lambda array: np.atleast_1d(array)[::2],
    "twice": lambda array: np.repeat(np.atleast_1d(array), 2, axis=0),
    "a level more": lambda array: array[None],
    "text": lambda _: np.array("text"),
    "not a number": lambda array: with_numbers(array, np.nan),
    "far": lambda array: with_numbers(array, 2.0**30),
    "negative": lambda array: with_numbers(array, -1.0),
    "zero": lambda array: with_numbers(array, 0.0),
}
NAMES = (
    "schema", "map_frame", "observations", "edges", "ids", "next_id", "looks", "ground_views", "ground_edges",
    "stamps_ns", "map_from_camera",
)  # fmt: skip


def save_changed(path: Path, whole: bytes, change: Callable[[Arrays], object]) -> None:
    path.write_bytes(whole)
    with np.load(path) as saved:
        arrays = dict(saved)
    assert set(arrays) == set(NAMES)
    change(arrays)
    np.savez(path, **arrays)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", NAMES)
def test_other_arrays_are_told_or_read(name: str, whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "map.npz"
    for change in CHANGES.values():
        save_changed(path, whole, lambda arrays, change=change: arrays.update({name: change(arrays[name])}))
        check_told_or_answered(path)
    for other in NAMES:
        save_changed(path, whole, lambda arrays, other=other: arrays.update({name: arrays[other]}))
        check_told_or_answered(path)


def spoil(name: str, field: str, value: object) -> Callable[[Arrays], None]:
    def change(arrays: Arrays) -> None:
        arrays[name][field][3] = value

    return change


TOLD = {
    "array gone": (lambda arrays: arrays.pop("edges"), "it lacks the array 'edges'"),
    "no records": (lambda arrays: arrays.update(looks=np.zeros(3)), "looks are no records with a stamp"),
    "not a number": (spoil("observations", "origin", np.nan), "observations: origin is not finite"),
    "without end": (spoil("edges", "left", np.inf), "edges: left is not finite in one of"),
    "rise of nothing": (spoil("observations", "rise", 0.0), "expected a rise above 0, but 1 of 12 differ"),
    "variance": (spoil("observations", "up_variance", -1.0), "expected a up_variance above 0"),
    "sides": (spoil("observations", "left", -3.0), "expected a left side left of the right"),
    "step": (spoil("edges", "index", 1001), "expected an index within 1000"),
    "no edges": (lambda arrays: arrays.update(edges=arrays["edges"][-3:]), "expected an edge, but 11 of 12"),
    "id": (lambda arrays: arrays["ids"].fill(2), "expected ids from 0 to 1"),
    "last id": (lambda arrays: arrays.update(next_id=np.array(10**8)), "below 10,000,000"),
    "pose": (lambda arrays: arrays["map_from_camera"].fill(np.nan), "images without a pose"),
    "ground": (
        lambda arrays: arrays.update(
            ground_views=with_numbers(np.zeros(1, arrays["ground_views"].dtype), np.nan)
        ),
        "ground's views: height is not finite",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", TOLD)
def test_what_cannot_be_is_named(name: str, whole: bytes, tmp_path: Path) -> None:
    change, words = TOLD[name]
    save_changed(tmp_path / "map.npz", whole, change)
    with pytest.raises(MapFileError, match="move it away to start anew") as told:
        answer(tmp_path / "map.npz")
    assert words in str(told.value)


def test_values_that_may_be_unknown_or_at_their_limits_are_read(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "map.npz"
    for change in (spoil("observations", "overhang", np.nan), spoil("edges", "forward_std", np.nan),
                   spoil("edges", "index", 1000)):  # fmt: skip
        save_changed(path, whole, change)
        assert check_told_or_answered(path) == ""


def test_pipe_and_device_are_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.npz")
    (tmp_path / "device.npz").symlink_to("/dev/zero")
    for name in ("pipe.npz", "device.npz"):
        with pytest.raises(MapFileError, match="it is a pipe or device"):
            answer(tmp_path / name)
