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

MAX_QUOTED = 60
"""Longest piece of a file that a message repeats, in characters."""


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
    num_columns = len(columns.split())
    rows: list[StampedRow] = []
    for line_number, line in enumerate(load_text(path, error_type=error_type).split("\n"), start=1):
        cells = tuple(line.split())
        if not cells or cells[0].startswith("#"):
            continue
        place = f"{path}:{line_number}"
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


def load_text(path: Path, *, error_type: type[RecordingError] = RecordingError) -> str:
    """Read a UTF-8 text file.

    Raises
    ------
    RecordingError
        If it cannot be read or is not UTF-8 text.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise error_type(f"cannot read {path}: {error.strerror}") from error
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise error_type(f"expected {path} to be UTF-8 text, but it is UTF-16; save it as UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise error_type(
            f"expected {path} to be UTF-8 text, but byte {error.start} is 0x{data[error.start]:02x}; "
            "is it another kind of file?"
        ) from error
    if "\0" in text:
        raise error_type(f"expected {path} to be text, but it holds binary data; is it another kind of file?")
    return text


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


def quoted(text: str) -> str:
    """Return a piece of a file for a message: shortened, on one line."""
    return repr(text if len(text) <= MAX_QUOTED else text[: MAX_QUOTED - 1] + "…")
