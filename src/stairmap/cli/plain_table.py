"""Tables of plain text, as they also stand in ``summary.txt``."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from stairmap.input_files import shown


def format_columns(
    header: Sequence[str], rows: Sequence[Sequence[str]], *, left_aligned: Collection[str] = ()
) -> str:
    """Return a table without a final newline; columns not named in ``left_aligned`` stand to the right.

    Names with control characters or line ends are escaped, so that a row stays a row.
    """
    lines = [header, *([shown(cell) for cell in row] for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    text = [_format_line(line, header, widths, left_aligned) for line in lines]
    text.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(text)


def _format_line(
    cells: Sequence[str], header: Sequence[str], widths: Sequence[int], left_aligned: Collection[str]
) -> str:
    padded = [
        cell.ljust(width) if name in left_aligned else cell.rjust(width)
        for cell, name, width in zip(cells, header, widths, strict=True)
    ]
    return "  ".join(padded).rstrip()
