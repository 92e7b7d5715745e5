"""Text tables whose first column is a stamp in seconds, as TUM RGB-D defined them.

Lines are cells separated by blanks; ``#`` starts a comment line. UTF-8, with or
without a byte order mark, any line ends. Stamps become integer nanoseconds by
decimal arithmetic: as a float, 1305031102.160407 s would be 78 ns off.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

from stairmap.errors import RecordingError
from stairmap.input_files import MAX_TABLE_SIZE, quoted, read_text, shown


@dataclass(frozen=True, slots=True, kw_only=True)
class StampedRow:
    """One line of a table.

    Attributes
    ----------
    place
        ``file:line``, for messages.
    stamp_ns
        Stamp, in nanoseconds.
    cells
        The columns after the stamp.
    """

    place: str
    stamp_ns: int
    cells: tuple[str, ...]


def load_stamped_table(
    path: Path, columns: str, *, error_type: type[RecordingError] = RecordingError
) -> tuple[StampedRow, ...]:
    """Read a table of stamped lines.

    Parameters
    ----------
    path
        Text file.
    columns
        Names of all columns separated by blanks, the stamp first.
    error_type
        Which error to raise.

    Returns
    -------
    The rows, by strictly increasing stamp; empty for a file that holds only comments.

    Raises
    ------
    RecordingError
        If the file cannot be read or is not text, a line has another number of columns, or a stamp is not a
        number of seconds or not after the one before.
    """
    text = read_text(path, error_type=error_type, max_size=MAX_TABLE_SIZE)
    return parse_stamped_table(text, columns, place=shown(path), error_type=error_type)


def parse_stamped_table(
    text: str, columns: str, *, place: str, error_type: type[RecordingError] = RecordingError
) -> tuple[StampedRow, ...]:
    """Return the rows of a table's text, which came from a place; see ``load_stamped_table``."""
    file, num_columns = place, len(columns.split())
    rows: list[StampedRow] = []
    for line_number, line in enumerate(text.split("\n"), start=1):
        cells = tuple(line.split())
        if not cells or cells[0].startswith("#"):
            continue
        place = f"{file}:{line_number}"
        if len(cells) != num_columns:
            hint = "; separate them with spaces, not commas" if "," in line else ""
            raise error_type(
                f"{place}: expected {num_columns} columns '{columns}', got {len(cells)} "
                f"in {quoted(line.strip())}{hint}"
            )
        try:
            stamp_ns = stamp_ns_from_text(cells[0])
        except ValueError as error:
            raise error_type(f"{place}: {error}") from error
        if rows and stamp_ns <= rows[-1].stamp_ns:
            relation = "the same as" if stamp_ns == rows[-1].stamp_ns else "before"
            last_line = rows[-1].place.rpartition(":")[2]
            raise error_type(
                f"{place}: expected stamps that increase, but {cells[0]} s is {relation} that of line "
                f"{last_line}; sort the lines and drop doubles"
            )
        rows.append(StampedRow(place=place, stamp_ns=stamp_ns, cells=cells[1:]))
    return tuple(rows)


def stamp_ns_from_text(text: str) -> int:
    """Turn decimal seconds into integer nanoseconds, exactly; further digits are rounded.

    Raises
    ------
    ValueError
        If the text is no finite number, or too large for seconds in 64 bits of nanoseconds.
    """
    try:
        seconds = Decimal(text)
    except InvalidOperation:
        seconds = Decimal("NaN")
    if "_" in text or not seconds.is_finite():
        raise ValueError(f"expected a stamp in seconds, got {quoted(text)}")
    # The exponent first: int() of 1e999999999 would never end.
    if seconds.adjusted() > 12 or abs(seconds.scaleb(9)) >= 2**63:
        raise ValueError(f"expected a stamp in seconds, got {quoted(text)}; is it in milli- or nanoseconds?")
    return int(seconds.scaleb(9).to_integral_value())


def text_from_stamp_ns(stamp_ns: int) -> str:
    """Turn integer nanoseconds into decimal seconds with nine decimals, exactly."""
    sign = "-" if stamp_ns < 0 else ""
    seconds, nanoseconds = divmod(abs(int(stamp_ns)), 1_000_000_000)
    return f"{sign}{seconds}.{nanoseconds:09d}"
