"""Check records that were saved and read again: their fields, and that each number can be one."""

from __future__ import annotations

from typing import Any

import numpy as np

from stairmap.arrays import Mask

MAX_VALUE = 1e15
"""Largest number of a record: one over the square of a tenth of a micrometre, what is known best; m, rad."""


def check_records(
    name: str, records: Any, fields: np.dtype[np.void], *, may_be_unknown: tuple[str, ...] = ()
) -> None:
    """Check (N,) records: fields of ``may_be_unknown`` may be NaN, all other numbers are finite.

    Raises
    ------
    ValueError
        If they have other fields or another shape, or hold a number that is none.
    """
    if getattr(records, "ndim", None) != 1 or records.dtype != fields:
        raise ValueError(f"the {name} have the fields {records.dtype.names}, expected {fields.names}")
    for field in fields.names or ():
        values = records[field]
        if values.dtype.kind == "f":
            known = np.abs(values) <= MAX_VALUE
            if not (known | np.isnan(values) if field in may_be_unknown else known).all():
                raise ValueError(f"{name}: {field} is not finite in one of {len(records)}")


def check_each(name: str, what: str, is_right: Mask) -> None:
    """Check something of (N,) records.

    Raises
    ------
    ValueError
        If it does not hold of one of them.
    """
    if not is_right.all():
        raise ValueError(
            f"{name}: expected {what}, but {np.count_nonzero(~is_right)} of {len(is_right)} differ"
        )
