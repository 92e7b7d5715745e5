"""RVL is decoded to the bit, and damaged images are told from whole ones."""

from __future__ import annotations

import numpy as np
import pytest

from rvl_encoder import encode_rvl
from stairmap.recordings.depth_png import DamagedImageError
from stairmap.recordings.rvl import decode_rvl


def random_image(seed: int, *, share_of_zeros: float = 0.3) -> np.ndarray:
    """Smooth depth with holes, and jumps over the whole range."""
    numbers = np.random.default_rng(seed)
    values = np.cumsum(numbers.integers(-9, 10, (31, 53)), axis=1) + 2000
    values[numbers.random(values.shape) < 0.02] = 65535
    holes = np.repeat(numbers.random((31, 53 // 4 + 1)) < share_of_zeros, 4, axis=1)[:, :53]
    return np.where(holes, 0, values).astype(np.uint16)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("share_of_zeros", [0.0, 0.3, 1.0])
def test_an_image_comes_back_to_the_bit(seed: int, share_of_zeros: float) -> None:
    values = random_image(seed, share_of_zeros=share_of_zeros)
    np.testing.assert_array_equal(decode_rvl(encode_rvl(values)), values)


def test_the_words_of_a_known_image_are_read() -> None:
    # 2 zeros, 2 values: 10 (difference +10, 20 = 4 + 2·8) and 9 (difference -1, 1); nibbles 2 2 c 2 1.
    data = np.array([4, 1, 0x22C21000], dtype="<u4").tobytes()
    np.testing.assert_array_equal(decode_rvl(data), [[0, 0, 10, 9]])


@pytest.mark.parametrize("num_bytes", [0, 7, 8, 12, 200])
def test_an_image_that_is_cut_off_is_damaged(num_bytes: int) -> None:
    with pytest.raises(DamagedImageError, match="RVL image"):
        decode_rvl(encode_rvl(random_image(1))[:num_bytes])


def test_corrupt_words_never_make_another_error() -> None:
    numbers = np.random.default_rng(7)
    data = np.frombuffer(encode_rvl(random_image(2)), dtype=np.uint8)
    num_refused = 0
    for _ in range(300):
        corrupt = data.copy()
        places = numbers.integers(0, len(data), 3)
        corrupt[places] = numbers.integers(0, 256, 3)
        try:
            decode_rvl(corrupt.tobytes())
        except DamagedImageError:
            num_refused += 1
    assert num_refused > 30
