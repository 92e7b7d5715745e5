"""Read arrays that NumPy saved (.npz), whatever a disk or another program did to the file."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stairmap.errors import StairmapError
from stairmap.input_files import check_is_file

MAX_ARRAYS_SIZE = 4 * 2**30
"""Largest .npz file, and largest sum of the arrays in it, bytes."""

_MAX_REASON = 200
"""Longest reason of a library that a message repeats, in characters."""


def load_arrays(path: Path, *, error_type: type[StairmapError]) -> dict[str, NDArray[Any]]:
    """Read all arrays of an .npz file; objects are not read.

    Raises
    ------
    StairmapError
        Of the type given, if it is no regular file or too large.
    ValueError
        If what it holds is no such file, damaged, or unpacks to more than ``MAX_ARRAYS_SIZE``; one line.
    """
    check_is_file(path, max_size=MAX_ARRAYS_SIZE, error_type=error_type)
    if not zipfile.is_zipfile(path):
        raise ValueError("it is no .npz file of NumPy, or it was cut off")
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(part.file_size for part in archive.infolist())
        if size <= MAX_ARRAYS_SIZE:
            with np.load(path, allow_pickle=False) as saved:
                return {name: np.asarray(saved[name]) for name in saved.files}
    except Exception as error:
        # NumPy passes on what zip, decompressors and the parser of headers raise: zlib.error, TokenError, …
        reason = " ".join(str(error).split())[:_MAX_REASON] or type(error).__name__
        raise ValueError(f"it is damaged: {reason}") from error
    raise ValueError(
        f"its arrays have {size / 2**20:,.0f} MiB, more than {MAX_ARRAYS_SIZE / 2**20:,.0f}; is it another "
        "kind of file?"
    )
