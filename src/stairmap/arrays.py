"""Names for the arrays that stairmap passes around, and how to freeze them."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float64Array: TypeAlias = NDArray[np.float64]
"""Any float64 array."""

Float32Array: TypeAlias = NDArray[np.float32]
"""Any float32 array: per-pixel work."""

Vector: TypeAlias = NDArray[np.float64]
"""(3,) float64."""

Points: TypeAlias = NDArray[np.float64]
"""(..., 3) float64, metres."""

Transform: TypeAlias = NDArray[np.float64]
"""(4, 4) float64 rigid transform, named ``destination_from_source``."""

DepthImage: TypeAlias = NDArray[np.float32]
"""(height, width) float32 metres along the optical axis, NaN where nothing was measured."""

Mask: TypeAlias = NDArray[np.bool_]
"""(height, width) or (N,) bool."""

IntArray: TypeAlias = NDArray[np.int64]
"""Any int64 array."""


def readonly(values: ArrayLike, dtype: Any = np.float64) -> NDArray[Any]:
    """Return a read-only copy of the values as an array.

    Parameters
    ----------
    values
        Anything that numpy turns into an array.
    dtype
        Element type of the result.

    Returns
    -------
    Array that cannot be written to.
    """
    array = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array
