"""Unpack LZF, the compression of PCD files.

The format (liblzf, M. Lehmann): a control byte below 32 is followed by that many bytes plus one; another one
holds three bits of a length and, with the byte after it, thirteen of how far back the bytes to repeat lie.
"""

from __future__ import annotations

_LITERAL = 32
_LONG = 7


def decompress_lzf(packed: bytes, size: int) -> bytes:
    """Unpack a block.

    Parameters
    ----------
    packed
        The compressed bytes.
    size
        How many bytes it has unpacked.

    Raises
    ------
    ValueError
        If the block is broken, or has another size.
    """
    result = bytearray()
    place, end = 0, len(packed)
    try:
        while place < end:
            control = packed[place]
            place += 1
            if control < _LITERAL:
                following = place + control + 1
                if following > end:
                    raise ValueError("it ends within a run of bytes")
                result += packed[place:following]
                place = following
                continue
            length = control >> 5
            if length == _LONG:
                length += packed[place]
                place += 1
            start = len(result) - ((control & 31) << 8) - packed[place] - 1
            place += 1
            length += 2
            if start < 0:
                raise ValueError("it refers to bytes before its beginning")
            piece = result[start : start + length]
            # A reference may reach into what it writes: then the piece repeats.
            while len(piece) < length:
                piece += piece[: length - len(piece)]
            result += piece
            if len(result) > size:
                break
    except IndexError:
        raise ValueError("it ends within a reference") from None
    if len(result) != size:
        raise ValueError(f"expected {size:,} bytes, got {len(result):,}")
    return bytes(result)
