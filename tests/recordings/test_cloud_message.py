"""Clouds of any layout, and what their points' times mean."""

from __future__ import annotations

import numpy as np
import pytest

from cloud_bags import cloud_message
from stairmap.errors import RecordingError
from stairmap.recordings.cloud_message import sweep_from_cloud

STAMP_NS = 1_700_000_000_123_456_789
POINTS = np.random.default_rng(0).uniform(-5, 5, (60, 3)).astype(np.float32)
XYZ = {axis: POINTS[:, column] for column, axis in enumerate("xyz")}
OFFSETS_NS = np.linspace(0, 99_000_000, len(POINTS)).astype(np.int64)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", ["f4", "f8"])
@pytest.mark.parametrize("padding", [0, 5])
def test_points_are_read_whatever_the_layout(order: str, kind: str, padding: int) -> None:
    columns = {"rgb": np.zeros(60), "z": XYZ["z"], "x": XYZ["x"], "ring": np.arange(60), "y": XYZ["y"]}
    kinds = {"ring": "u2", **dict.fromkeys("xyz", kind)}
    message = cloud_message(columns, order=order, padding=padding, kinds=kinds)
    sweep = sweep_from_cloud(message)
    np.testing.assert_allclose(sweep.points, POINTS, rtol=1e-6)
    assert sweep.offsets_ns is None


def test_an_organised_cloud_with_padded_rows_is_read_row_by_row() -> None:
    message = cloud_message(XYZ, height=4, row_padding=7)
    np.testing.assert_array_equal(sweep_from_cloud(message).points, POINTS)


def test_points_without_a_return_are_left_out_with_their_times() -> None:
    points = POINTS.copy()
    points[3], points[7, 1], points[9, 2], points[11] = 0.0, np.nan, np.inf, (400.0, 0.0, 0.0)
    columns = {axis: points[:, column] for column, axis in enumerate("xyz")}
    sweep = sweep_from_cloud(cloud_message({**columns, "t": OFFSETS_NS}, kinds={"t": "u4"}))
    kept = np.setdiff1d(np.arange(60), [3, 7, 9, 11])
    np.testing.assert_array_equal(sweep.points, POINTS[kept])
    np.testing.assert_array_equal(sweep.offsets_ns, OFFSETS_NS[kept])


@pytest.mark.parametrize(
    ("name", "kind", "values", "tolerance_ns"),
    [
        ("t", "u4", OFFSETS_NS, 0),
        ("time", "f4", OFFSETS_NS * 1e-9, 20),
        ("time", "f4", OFFSETS_NS * 1e-9 - 0.099, 20),
        ("time", "f4", OFFSETS_NS * 1e-3, 20),
        ("time", "f4", OFFSETS_NS * 1e-6, 20),
        ("timestamp", "f8", (STAMP_NS + OFFSETS_NS) * 1e-9, 600),
        ("timestamp", "f8", STAMP_NS + OFFSETS_NS, 300),
        ("offset_time", "u4", OFFSETS_NS, 0),
        ("timestamp", "f8", 77.5 + OFFSETS_NS * 1e-9, 20),
    ],
    ids=["ouster", "velodyne", "velodyne at its end", "microseconds", "milliseconds", "hesai", "livox",
         "livox offset", "another clock"],
)  # fmt: skip
def test_the_unit_and_the_origin_of_times_are_told_by_their_span(
    name: str, kind: str, values: np.ndarray, tolerance_ns: int
) -> None:
    message = cloud_message({**XYZ, name: values}, stamp_ns=STAMP_NS, kinds={name: kind})
    sweep = sweep_from_cloud(message)
    late_ns = -99_000_000 if values.min() < 0 else 0
    assert sweep.stamp_ns == STAMP_NS
    assert sweep.offsets_ns is not None
    assert np.abs(sweep.offsets_ns - (OFFSETS_NS + late_ns)).max() <= tolerance_ns


@pytest.mark.parametrize("values", [np.zeros(60), np.full(60, np.nan), np.arange(60) * 1e-12])
def test_times_that_are_all_the_same_are_none(values: np.ndarray) -> None:
    assert sweep_from_cloud(cloud_message({**XYZ, "time": values})).offsets_ns is None


def test_a_cloud_without_a_coordinate_names_the_fields_that_it_has() -> None:
    message = cloud_message({"x": XYZ["x"], "y": XYZ["y"], "depth": XYZ["z"]})
    with pytest.raises(RecordingError, match=r"but z is not there; the fields are: x, y, depth"):
        sweep_from_cloud(message)


def test_a_cloud_that_is_cut_off_is_refused() -> None:
    message = cloud_message(XYZ)
    message.data = message.data[:-1]
    with pytest.raises(RecordingError, match="1 x 60 points of 12 bytes, but it has 719 bytes"):
        sweep_from_cloud(message)


def test_a_field_that_reaches_beyond_its_point_is_refused() -> None:
    message = cloud_message(XYZ)
    message.fields[2].offset = 10
    with pytest.raises(RecordingError, match="the field z ends at byte 14 of a point"):
        sweep_from_cloud(message)


def test_a_count_that_no_lidar_has_is_refused_before_memory_is_asked_for() -> None:
    message = cloud_message(XYZ)
    message.height = message.width = 2**31
    with pytest.raises(RecordingError, match="that is no sweep"):
        sweep_from_cloud(message)


def test_an_empty_cloud_is_an_empty_sweep() -> None:
    message = cloud_message({axis: np.zeros(0) for axis in "xyz"})
    assert len(sweep_from_cloud(message)) == 0
