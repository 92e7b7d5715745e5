"""What a disk, a cable or an editor does to a file: bits flip, ends are cut off, fields change places."""

from __future__ import annotations

import itertools
from collections.abc import Callable

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

NUM_NIGHTLY = 2_000
"""Corruptions of each kind of file in the nightly target."""

NUM_QUICK = 6

_SEPARATORS = b" ,:\n[]{}"

_MAX_FIELDS = 2_000
"""Fields at the begin of a file of which two are swapped."""


def flip_bits(content: bytes, places: list[float], bits: list[int]) -> bytes:
    """Turn single bits."""
    spoilt = bytearray(content)
    for place, bit in zip(places, bits, strict=True):
        spoilt[int(place * len(spoilt))] ^= 1 << bit
    return bytes(spoilt)


def swap_fields(content: bytes, first: float, second: float) -> bytes:
    """Exchange two pieces between separators: values come under another's key."""
    at = itertools.islice((i for i, byte in enumerate(content) if byte in _SEPARATORS), _MAX_FIELDS)
    bounds = [-1, *at]
    fields = [(a + 1, b) for a, b in itertools.pairwise([*bounds, len(content)]) if b > a + 1]
    one, other = sorted(fields[int(place * len(fields))] for place in (first, second))
    if one == other:
        return content
    return b"".join(
        [
            content[: one[0]],
            content[slice(*other)],
            content[one[1] : other[0]],
            content[slice(*one)],
            content[other[1] :],
        ]
    )


_places = st.floats(0, 1, exclude_max=True)


@st.composite
def _corruptions(draw: st.DrawFn) -> Callable[[bytes], bytes]:
    way = draw(st.sampled_from(["flip", "cut", "swap", "zeros", "twice"]))
    if way == "flip":
        # Headers, where all that decides stands, are hit as often as the rest.
        reach = draw(st.sampled_from([1.0, 0.1, 0.01]))
        where = draw(st.lists(_places.map(lambda place: place * reach), min_size=1, max_size=8))
        bits = draw(st.lists(st.integers(0, 7), min_size=len(where), max_size=len(where)))
        return lambda content: flip_bits(content, where, bits)
    first = draw(_places)
    if way == "cut":
        return lambda content: content[: int(first * len(content))]
    if way == "zeros":
        return lambda content: content[: int(first * len(content))].ljust(len(content), b"\0")
    if way == "twice":
        return lambda content: content + content[int(first * len(content)) :]
    second = draw(_places)
    return lambda content: swap_fields(content, first, second)


def check_corruptions(check: Callable[[Callable[[bytes], bytes]], None], number: int) -> None:
    """Call a check with so many corruptions, each a function of a file's content."""

    @settings(
        max_examples=number,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        database=None,
        phases=[Phase.generate],
    )
    @given(_corruptions())
    def once(corrupt: Callable[[bytes], bytes]) -> None:
        check(corrupt)

    once()
