"""The code blocks of README and docs, with what they show and whether they can be run here."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]

_MARK = re.compile(r"<!-- not run: (.+) -->")


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A code block.

    Attributes
    ----------
    page, line
        Where it stands.
    language
        ``sh`` for commands alone, ``console`` for ``$ commands`` with what they print, or another.
    text
        Its lines.
    not_run
        Why it cannot be run here, from ``<!-- not run: REASON -->`` on the line before it; else empty.
    """

    page: str
    line: int
    language: str
    text: str
    not_run: str

    def commands(self) -> list[str]:
        """Its commands, one a line, without comments at their ends."""
        lines = [line for line in self.text.splitlines() if line.strip() and not line.startswith("#")]
        if self.language == "console":
            lines = [line[2:] for line in lines if line.startswith("$ ")]
        return [re.sub(r"\s+# .*$", "", line) for line in lines]

    def printed(self) -> str:
        """What a ``console`` block shows of the output of its commands."""
        return "\n".join(line for line in self.text.splitlines() if not line.startswith("$ "))


def blocks_of(page: Path) -> list[Block]:
    """Return the code blocks of a page, in their order."""
    found: list[Block] = []
    lines = page.read_text(encoding="utf-8").splitlines()
    start: int | None = None
    for index, line in enumerate(lines):
        if not line.startswith("```"):
            continue
        if start is None:
            start = index
            continue
        mark = _MARK.fullmatch(lines[start - 1]) if start else None
        found.append(
            Block(
                page=page.name,
                line=start + 1,
                language=lines[start][3:].strip(),
                text="\n".join(lines[start + 1 : index]),
                not_run="" if mark is None else mark[1],
            )
        )
        start = None
    return found


def all_blocks() -> list[Block]:
    """Return the code blocks of all pages."""
    return [block for page in PAGES for block in blocks_of(page)]
