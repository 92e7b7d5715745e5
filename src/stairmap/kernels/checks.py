"""Check the arrays that a kernel is given; the compiled kernels refuse the same ones in the same words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def check_array(values: Any, name: str, dtype: Any, ndim: int) -> NDArray[Any]:
    """Return an array, checked to be C-contiguous, aligned, and of one native element type.

    Parameters
    ----------
    values
        The argument.
    name
        How the argument is called.
    dtype, ndim
        What it must be.

    Raises
    ------
    ValueError
        If it is not; the message names the argument.
    """
    expected = np.dtype(dtype)
    if isinstance(values, np.ndarray):
        flags = values.flags
        if values.dtype == expected and values.ndim == ndim and flags.c_contiguous and flags.aligned:
            return values
        came = f"{values.dtype} of shape {values.shape}" + ("" if flags.c_contiguous else ", not contiguous")
    else:
        came = type(values).__name__
    noun = "dimension" if ndim == 1 else "dimensions"
    raise ValueError(
        f"{name}: expected a C-contiguous {expected} array of {ndim} {noun}, got {came}; "
        "use numpy.ascontiguousarray"
    )


def check_length(array: NDArray[Any], name: str, expected: int, axis: int = 0) -> None:
    """Refuse an array whose length along an axis is not that of another one."""
    if array.shape[axis] != expected:
        raise ValueError(f"{name}: expected length {expected} along axis {axis}, got {array.shape[axis]}")


def check_arrays(
    values: Sequence[Any], name: str, dtypes: Sequence[Any], ndims: Sequence[int] | None = None
) -> list[NDArray[Any]]:
    """Return the arrays of a tuple argument; the first axes of all must be equally long."""
    if len(values) != len(dtypes):
        words = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six", 7: "seven"}
        raise ValueError(f"{name}: expected {words[len(dtypes)]} arrays, got {len(values)}")
    dims = [1] * len(dtypes) if ndims is None else ndims
    checked = [
        check_array(value, f"{name}[{i}]", dtype, ndim)
        for i, (value, dtype, ndim) in enumerate(zip(values, dtypes, dims, strict=True))
    ]
    for i, array in enumerate(checked[1:], start=1):
        check_length(array, f"{name}[{i}]", len(checked[0]))
    return checked


def check_strips(strip: NDArray[np.int64], name: str, num_strips: int) -> None:
    """Refuse numbers of strips that there are not."""
    if len(strip) and (strip.min() < 0 or strip.max() >= num_strips):
        raise ValueError(f"{name}: expected strips below {num_strips}, got others")
