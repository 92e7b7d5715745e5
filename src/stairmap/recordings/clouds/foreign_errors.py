"""Errors of packages that read files of points, as ours in one line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from stairmap.errors import RecordingError

_NO_ERRORS = (KeyboardInterrupt, SystemExit, GeneratorExit, RecordingError)
"""What passes: wishes to end, and what is a message already."""


@contextmanager
def refused_as(what: str) -> Iterator[None]:
    """Turn whatever a package raises at a damaged file into a ``RecordingError`` that begins with ``what``.

    That is struct's, NumPy's and the decompressors' errors, and panics of Rust, which are no ``Exception``.
    """
    try:
        yield
    except _NO_ERRORS:
        raise
    except BaseException as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise RecordingError(f"{what}: {reason}") from error
