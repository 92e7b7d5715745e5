"""Depth survives PNG, and a damaged file is never taken for a whole one."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.errors import RecordingError
from stairmap.recordings.depth_png import (
    DamagedImageError,
    check_png_header,
    decode_depth_png,
    encode_depth_png,
)


def _png(image: np.ndarray, extension: str = ".png") -> bytes:
    return bytes(cv2.imencode(extension, image)[1].tobytes())


def _random_png() -> bytes:
    return _png(np.random.default_rng(0).integers(500, 5000, (48, 64)).astype(np.uint16))


@given(st.integers(0, 2**32 - 1), st.sampled_from([1000.0, 5000.0, 256.0, 4000.0]))
def test_depth_survives_to_half_a_unit(seed: int, depth_scale: float) -> None:
    depth = np.random.default_rng(seed).uniform(0.01, 65000 / depth_scale, (6, 8)).astype(np.float32)
    depth[1, 2] = np.nan
    decoded = decode_depth_png(encode_depth_png(depth, depth_scale), depth_scale)
    assert decoded.dtype == np.float32
    np.testing.assert_array_equal(np.isnan(decoded), np.isnan(depth))
    np.testing.assert_allclose(decoded, depth, atol=0.5001 / depth_scale, rtol=1e-6)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1000.0, 5000.0, 256.0, 4000.0]))
def test_pixels_survive_bit_for_bit(seed: int, depth_scale: float) -> None:
    pixels = np.random.default_rng(seed).integers(0, 65535, (6, 8)).astype(np.uint16)
    depth = decode_depth_png(_png(pixels), depth_scale)
    again = cv2.imdecode(np.frombuffer(encode_depth_png(depth, depth_scale), np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(again, pixels)


def test_zero_and_65535_are_not_measured() -> None:
    depth = decode_depth_png(_png(np.array([[0, 1, 65534, 65535]], dtype=np.uint16)), 1000.0)
    np.testing.assert_allclose(depth, [[np.nan, 0.001, 65.534, np.nan]], rtol=1e-6)


def test_depth_that_cannot_be_written_is_not_measured() -> None:
    depth = np.array([[np.nan, np.inf, -np.inf, -1.0, 0.0, 1e-5, 65.535, 1e30, 2.0]], dtype=np.float32)
    decoded = decode_depth_png(encode_depth_png(depth, 1000.0), 1000.0)
    np.testing.assert_array_equal(np.isfinite(decoded), [[False] * 8 + [True]])


def test_an_image_cut_off_anywhere_is_damaged(capfd: pytest.CaptureFixture[str]) -> None:
    data = _random_png()
    for length in [*range(40), *range(40, len(data), 97), *range(len(data) - 20, len(data))]:
        with pytest.raises(DamagedImageError, match=r"cut off|empty"):
            decode_depth_png(data[:length], 1000.0)
    output = capfd.readouterr()
    assert output.err == output.out == ""


def test_an_image_with_any_byte_changed_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    data = _random_png()
    for position in [*range(40), *range(40, len(data), 53)]:
        changed = bytearray(data)
        changed[position] ^= 0x55
        with pytest.raises(RecordingError):
            decode_depth_png(bytes(changed), 1000.0)
    assert capfd.readouterr().err == ""


def test_a_file_of_zeros_is_damaged() -> None:
    with pytest.raises(DamagedImageError, match="empty"):
        decode_depth_png(bytes(1000), 1000.0)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (_png(np.zeros((4, 4), np.uint8)), "got 8-bit grey"),
        (_png(np.zeros((4, 4, 3), np.uint16)), "got 16-bit RGB"),
        (_png(np.zeros((4, 4, 3), np.uint8)), "got 8-bit RGB; is it a colour image"),
        (_png(np.zeros((4, 4), np.uint8), ".jpg"), "got JPEG"),
        (_png(np.zeros((4, 4), np.uint16), ".tiff"), "got TIFF"),
        (b"hello, this is no image at all, but a text", "got another kind of file"),
    ],
)
def test_another_kind_of_image_is_named(data: bytes, message: str) -> None:
    with pytest.raises(RecordingError, match=message) as caught:
        decode_depth_png(data, 1000.0)
    assert not isinstance(caught.value, DamagedImageError)


def test_the_header_gives_the_size() -> None:
    assert check_png_header(_random_png()[:33]) == (64, 48)


@given(st.binary(max_size=300))
def test_any_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(RecordingError):
        decode_depth_png(data, 1000.0)
