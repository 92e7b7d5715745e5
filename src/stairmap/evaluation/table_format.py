"""Markdown tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def format_table(header: Sequence[str], rows: Iterable[Sequence[str]], *, num_left: int = 1) -> str:
    """Return a Markdown table; the first ``num_left`` columns are aligned to the left."""
    lines = [list(header), *(list(row) for row in rows)]
    widths = [max(3, *(len(line[column]) for line in lines)) for column in range(len(header))]
    texts = [
        "| "
        + " | ".join(
            cell.ljust(width) if column < num_left else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        + " |"
        for line in lines
    ]
    rule = [
        "-" * width if column < num_left else "-" * (width - 1) + ":" for column, width in enumerate(widths)
    ]
    return "\n".join([texts[0], "| " + " | ".join(rule) + " |", *texts[1:]])
