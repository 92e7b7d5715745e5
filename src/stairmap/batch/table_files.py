"""Write the table of a batch as CSV and Parquet, a few rows in memory at a time.

pyarrow is imported here only; it comes with the extra ``cluster``.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from stairmap.batch.table import Row, column_kind
from stairmap.errors import MissingPackageError, OutputError
from stairmap.output_files import output_error, partial_path

CSV_FILE = "batch.csv"
PARQUET_FILE = "batch.parquet"

ROWS_AT_ONCE = 10_000
"""Rows of a group of the Parquet file: 3 MB in memory."""


def load_pyarrow() -> Any:
    """Return pyarrow; ask for it before a batch begins.

    Raises
    ------
    MissingPackageError
        Without the extra ``cluster``.
    """
    try:
        import pyarrow.parquet  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("pyarrow", "cluster", "writing batch.parquet") from error
    return pyarrow


def write_tables(folder: Path, names: Sequence[str], rows: Iterable[Row]) -> None:
    """Write ``batch.csv`` and ``batch.parquet``, each whole or not at all; older ones are replaced.

    Parameters
    ----------
    folder
        Where to.
    names
        The columns.
    rows
        Each is asked for once.

    Raises
    ------
    OutputError
        If they cannot be written.
    """
    pyarrow = load_pyarrow()
    targets = folder / CSV_FILE, folder / PARQUET_FILE
    partials = partial_path(targets[0]), partial_path(targets[1])
    schema = pyarrow.schema([(name, _arrow_type(pyarrow, name)) for name in names])
    iterator = iter(rows)
    try:
        with (
            partials[0].open("w", encoding="utf-8", errors="backslashreplace", newline="") as file,
            pyarrow.parquet.ParquetWriter(partials[1], schema, compression="zstd") as parquet,
        ):
            table = csv.writer(file)
            table.writerow(names)
            while chunk := list(islice(iterator, ROWS_AT_ONCE)):
                table.writerows([_csv_cell(row[name]) for name in names] for row in chunk)
                columns = [[_arrow_value(row[name]) for row in chunk] for name in names]
                arrays = [
                    pyarrow.array(values, type=kind)
                    for values, kind in zip(columns, schema.types, strict=True)
                ]
                parquet.write_table(pyarrow.Table.from_arrays(arrays, schema=schema))
        for partial, target in zip(partials, targets, strict=True):
            partial.replace(target)
    except OSError as error:
        for partial in partials:
            partial.unlink(missing_ok=True)
        raise output_error(targets[0], error) from error


def read_table(folder: Path) -> list[dict[str, Any]]:
    """Return the rows of ``batch.parquet``, for what is drawn of them.

    Raises
    ------
    OutputError
        If it cannot be read.
    """
    pyarrow = load_pyarrow()
    try:
        rows: list[dict[str, Any]] = pyarrow.parquet.read_table(folder / PARQUET_FILE).to_pylist()
    except OSError as error:
        raise OutputError(f"cannot read {folder / PARQUET_FILE}: {error}") from error
    return rows


def _arrow_type(pyarrow: Any, name: str) -> Any:
    types = {"text": pyarrow.string(), "count": pyarrow.int64(), "truth": pyarrow.bool_()}
    return types.get(column_kind(name), pyarrow.float64())


def _arrow_value(value: Any) -> Any:
    return value.encode("utf-8", "backslashreplace").decode("utf-8") if isinstance(value, str) else value


def _csv_cell(value: Any) -> Any:
    return "" if value is None else str(value).lower() if isinstance(value, bool) else value
