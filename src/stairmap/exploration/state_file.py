"""Read and write nested values with arrays in them as one ``.npz`` file, without pickles.

JSON types are kept as text in the file, arrays beside it.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from stairmap.array_files import load_arrays
from stairmap.errors import ResultsError
from stairmap.input_files import parse_json

State: TypeAlias = dict[str, Any]
"""Names and values: JSON types, arrays, and lists and dicts of these."""

_VALUES, _ARRAY = "values", "$array"

FAST = 1
"""Level of compression: maps are mostly empty, and a mission saves them often."""


def bytes_from_state(state: State) -> bytes:
    """Return the content of a file that holds a state."""
    arrays: list[np.ndarray[Any, Any]] = []
    text = json.dumps(_packed(state, arrays), allow_nan=False)
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=FAST) as archive:
        for name, array in [(_VALUES, np.array(text)), *((str(n), a) for n, a in enumerate(arrays))]:
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)
    return content.getvalue()


def load_state(path: Path) -> State:
    """Return the state that a file holds.

    Raises
    ------
    ResultsError
        If it cannot be read, or is damaged.
    """
    try:
        arrays = load_arrays(path, error_type=ResultsError)
        state = _unpacked(parse_json(str(arrays[_VALUES])), arrays)
    except (KeyError, ValueError) as error:
        raise ResultsError(f"cannot read {path}: {error}; begin anew") from error
    if not isinstance(state, dict):
        raise ResultsError(f"expected a saved state in {path}, but it holds something else; begin anew")
    return state


def _packed(values: Any, arrays: list[np.ndarray[Any, Any]]) -> Any:
    """Return values with a number in the place of each array, which goes to the list."""
    if isinstance(values, np.ndarray):
        arrays.append(values)
        return {_ARRAY: len(arrays) - 1}
    if isinstance(values, dict):
        return {key: _packed(value, arrays) for key, value in values.items()}
    if isinstance(values, list | tuple):
        return [_packed(value, arrays) for value in values]
    return values


def _unpacked(values: Any, arrays: Mapping[str, np.ndarray[Any, Any]]) -> Any:
    if isinstance(values, dict):
        if _ARRAY in values:
            return arrays[str(values[_ARRAY])]
        return {key: _unpacked(value, arrays) for key, value in values.items()}
    if isinstance(values, list):
        return [_unpacked(value, arrays) for value in values]
    return values
