"""Depth of every encoding that drivers publish becomes metres with NaN; anything else is refused by name."""

from __future__ import annotations

import array
import struct
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from rvl_encoder import encode_rvl
from stairmap.errors import RecordingError
from stairmap.recordings.depth_message import depth_from_message
from stairmap.recordings.depth_png import DamagedImageError

MILLIMETRES = np.array([[0, 1, 1000, 65535], [2500, 65534, 30, 4000], [1, 2, 3, 4]], dtype=np.uint16)
METRES = np.array([[np.nan, 0.5, np.inf, -np.inf], [0.0, -1.0, 2.25, 4.0]], dtype=np.float32)
NAN = np.nan


def image(values: np.ndarray, encoding: str, *, is_bigendian: int = 0, padding: int = 0) -> SimpleNamespace:
    ordered = values.astype(values.dtype.newbyteorder(">" if is_bigendian else "<"))
    rows = ordered.view(np.uint8).reshape(len(values), -1)
    padded = np.hstack([rows, np.full((len(rows), padding), 171, dtype=np.uint8)])
    return SimpleNamespace(
        height=values.shape[0],
        width=values.shape[1],
        encoding=encoding,
        is_bigendian=is_bigendian,
        step=padded.shape[1],
        data=padded.tobytes(),
    )


def compressed(data: bytes, text: str) -> SimpleNamespace:
    return SimpleNamespace(format=text, data=np.frombuffer(data, dtype=np.uint8))


def png(values: np.ndarray) -> bytes:
    return bytes(cv2.imencode(".png", values)[1].tobytes())


def expected_metres() -> np.ndarray:
    depth = MILLIMETRES.astype(np.float32) / np.float32(1000)
    depth[0, [0, 3]] = np.nan
    return depth


@pytest.mark.parametrize("encoding", ["16UC1", "mono16"])
@pytest.mark.parametrize("is_bigendian", [0, 1])
@pytest.mark.parametrize("padding", [0, 3, 8])
def test_millimetres_become_metres(encoding: str, is_bigendian: int, padding: int) -> None:
    depth = depth_from_message(image(MILLIMETRES, encoding, is_bigendian=is_bigendian, padding=padding))
    assert depth.dtype == np.float32
    np.testing.assert_array_equal(depth, expected_metres())


@pytest.mark.parametrize("is_bigendian", [0, 1])
@pytest.mark.parametrize("padding", [0, 5])
def test_metres_keep_what_was_measured_and_nothing_else(is_bigendian: int, padding: int) -> None:
    depth = depth_from_message(image(METRES, "32FC1", is_bigendian=is_bigendian, padding=padding))
    np.testing.assert_array_equal(depth, [[NAN, 0.5, NAN, NAN], [NAN, NAN, 2.25, 4.0]])
    assert depth.dtype == np.float32


@pytest.mark.parametrize("make", [bytes, bytearray, memoryview, lambda data: array.array("B", data)])
def test_data_may_be_any_bytes(make: Any) -> None:
    message = image(MILLIMETRES, "16UC1")
    message.data = make(message.data)
    np.testing.assert_array_equal(depth_from_message(message), expected_metres())


def test_last_row_may_lack_its_padding() -> None:
    message = image(MILLIMETRES, "16UC1", padding=4)
    message.data = message.data[:-4]
    np.testing.assert_array_equal(depth_from_message(message), expected_metres())


def test_other_units_of_a_sensor_are_scaled() -> None:
    depth = depth_from_message(image(MILLIMETRES, "16UC1"), values_per_metre=10000.0)
    assert depth[0, 2] == pytest.approx(0.1)


def test_image_with_less_data_than_it_says_is_damaged() -> None:
    message = image(MILLIMETRES, "16UC1")
    message.data = message.data[:-1]
    with pytest.raises(DamagedImageError, match="4x3 16UC1 with rows of 8 bytes cannot have 23 bytes"):
        depth_from_message(message)


def test_colour_is_refused_with_its_encoding() -> None:
    with pytest.raises(RecordingError, match=r"16UC1 .* or 32FC1 .*, got 'rgb8'; is it a colour image"):
        depth_from_message(image(np.zeros((2, 6), dtype=np.uint8), "rgb8"))


def test_compressed_millimetres_are_those_of_the_image() -> None:
    data = struct.pack("<iff", 0, 0.0, 0.0) + png(MILLIMETRES)
    depth = depth_from_message(compressed(data, "16UC1; compressedDepth png"))
    np.testing.assert_array_equal(depth, expected_metres())


def test_png_without_the_header_of_12_bytes_is_read() -> None:
    depth = depth_from_message(compressed(png(MILLIMETRES), "16UC1; png compressed "))
    np.testing.assert_array_equal(depth, expected_metres())


def test_quantised_metres_are_undone_within_their_step() -> None:
    true = np.array([[0.6, 1.0, 2.0], [4.0, 8.0, NAN]], dtype=np.float32)
    quantisation, max_depth = 100.0, 10.0
    factor = quantisation * (quantisation + 1.0)
    offset = 1.0 - factor / max_depth
    values = np.where(np.isnan(true), 0, np.nan_to_num(factor / true + offset)).astype(np.uint16)
    data = struct.pack("<iff", 0, factor, offset) + png(values)
    depth = depth_from_message(compressed(data, "32FC1; compressedDepth"))
    assert np.isnan(depth[1, 2])
    # One step of the inverse is depth squared over the factor.
    np.testing.assert_array_less(np.abs(depth - true)[~np.isnan(true)], (true**2 / factor)[~np.isnan(true)])


def test_compressed_image_that_is_cut_off_is_damaged() -> None:
    data = struct.pack("<iff", 0, 0.0, 0.0) + png(MILLIMETRES)
    for text in ("16UC1; compressedDepth", "32FC1; compressedDepth"):
        for end in (5, 12, len(data) - 8):
            with pytest.raises(DamagedImageError):
                depth_from_message(compressed(data[:end], text))


@pytest.mark.parametrize("text", ["bgr8; jpeg compressed bgr8", "jpeg"])
def test_compressed_colour_is_refused_with_its_format(text: str) -> None:
    with pytest.raises(RecordingError, match=text):
        depth_from_message(compressed(b"\xff\xd8\xff\xe0", text))


def test_rvl_of_whole_millimetres_is_read() -> None:
    message = compressed(bytes(12) + encode_rvl(MILLIMETRES), "16UC1; compressedDepth rvl")
    np.testing.assert_array_equal(depth_from_message(message), expected_metres())


def test_rvl_of_the_quantised_inverse_is_read() -> None:
    values = np.array([[0, 100, 2000]], dtype=np.uint16)
    header = struct.pack("<iff", 0, 300.0, -50.0)
    message = compressed(header + encode_rvl(values), "32FC1; compressedDepth rvl")
    np.testing.assert_allclose(depth_from_message(message), [[NAN, 300 / 150, 300 / 2050]], rtol=1e-6)
