"""What bags are compressed with, by the packages that rosbags brings along."""

from __future__ import annotations

import sys

from lz4.frame import decompress as _decompress_lz4

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
"""First bytes of what zstd compressed."""


def decompress_lz4(data: bytes) -> bytes:
    """Return what lz4 compressed.

    Raises
    ------
    RuntimeError
        If the data are cut off or corrupt.
    """
    return bytes(_decompress_lz4(data))


def decompress_zstd(data: bytes) -> bytes:
    """Return what zstd compressed.

    Raises
    ------
    ValueError
        If the data are cut off or corrupt.
    """
    try:
        return bytes(zstd.decompress(data))
    except zstd.ZstdError as error:
        raise ValueError(f"corrupt zstd data: {error}") from error
