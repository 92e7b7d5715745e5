"""Standard output and error that cannot end a run: a full device, a closed pipe, a terminal that went away.

What libraries in C say to the terminal by themselves (libpng, OpenCV, librealsense) does not reach it, nor do
Python's warnings; with ``--debug`` both do.
"""

from __future__ import annotations

import codecs
import contextlib
import errno
import io
import logging
import os
import sys
import warnings
from typing import Any, TextIO

QUIET_ERRORS = (errno.EPIPE, errno.EIO, errno.EBADF)
"""Nobody reads any more: a pipe that was closed, a terminal that went away."""

_ENCODING_ERRORS = "stairmap"


class GuardedStream(io.TextIOBase):
    """A text stream that keeps the first error of its file and takes the rest without a word.

    Parameters
    ----------
    stream
        ``sys.stdout`` or ``sys.stderr``.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.error: OSError | None = None

    def write(self, text: str) -> int:
        """Write, or note why not."""
        if self.error is None:
            try:
                self._stream.write(text)
            except OSError as error:
                self._give_up(error)
        return len(text)

    def flush(self) -> None:
        """Flush, or note why not."""
        if self.error is None:
            try:
                self._stream.flush()
            except OSError as error:
                self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        self.error = error
        # What is still in the buffer would fail again when Python ends.
        with contextlib.suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self._stream.fileno())
            os.close(null)

    def isatty(self) -> bool:
        """Whether it is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Return its descriptor."""
        return self._stream.fileno()

    def writable(self) -> bool:
        """Return true."""
        return True

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Its encoding."""
        return self._stream.encoding

    @property
    def errors(self) -> str | None:  # type: ignore[override]
        """What it does with what it cannot spell."""
        return self._stream.errors

    @property
    def buffer(self) -> Any:
        """Its bytes."""
        return self._stream.buffer


def guard_streams(*, shows_noise: bool) -> tuple[GuardedStream, GuardedStream]:
    """Put guards around ``sys.stdout`` and ``sys.stderr`` of this process, and return them.

    Parameters
    ----------
    shows_noise
        Whether libraries may speak to the terminal themselves.
    """
    codecs.register_error(_ENCODING_ERRORS, _spell_otherwise)
    # Where a stream was closed by the caller, the next file that is opened would take its number.
    sys.stdout = sys.stdout or _open_nowhere()
    sys.stderr = sys.stderr or _open_nowhere()
    for stream in (sys.stdout, sys.stderr):
        # A terminal that cannot spell "±" or "≥" gets "?", not a traceback after an hour of frames.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=_ENCODING_ERRORS)
    error_stream: TextIO = sys.stderr
    if not shows_noise:
        error_stream = _part_from_libraries(sys.stderr)
        warnings.simplefilter("ignore")
        logging.getLogger().addHandler(logging.NullHandler())
    guards = GuardedStream(sys.stdout), GuardedStream(error_stream)
    sys.stdout, sys.stderr = guards
    return guards


def _open_nowhere() -> Any:
    return open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123


def _part_from_libraries(stream: TextIO) -> TextIO:
    """Return a stream to where stderr goes now; descriptor 2, which libraries write to, goes nowhere."""
    try:
        descriptor = os.dup(stream.fileno())
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 2)
        os.close(null)
    except (OSError, ValueError):
        return stream
    return open(  # noqa: PTH123
        descriptor, "w", buffering=1, encoding=stream.encoding, errors=_ENCODING_ERRORS, closefd=True
    )


def _spell_otherwise(error: UnicodeError) -> tuple[str | bytes, int]:
    """A byte of a file name that is no UTF-8 as that byte, any other character that cannot be spelt as ?."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    parts = [
        bytes([ord(character) - 0xDC00]) if "\udc80" <= character <= "\udcff" else b"?"
        for character in error.object[error.start : error.end]
    ]
    return b"".join(parts), error.end
