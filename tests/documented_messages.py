"""The messages that docs/troubleshooting.md explains."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[1] / "docs/troubleshooting.md"

MIN_LENGTH = 8
"""Characters that a message must have to tell it from others."""


def _documented_parts() -> list[tuple[str, ...]]:
    found = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("|"):
            for message in re.findall(r"`([^`]+)`", line.split("|")[1]):
                parts = tuple(part.strip() for part in message.split("…"))
                if sum(map(len, parts)) >= MIN_LENGTH:
                    found.append(parts)
    return found


DOCUMENTED_PARTS = _documented_parts()
"""The pieces of each message between what differs (…)."""

DOCUMENTED = [re.compile(".*".join(map(re.escape, parts))) for parts in DOCUMENTED_PARTS]
"""A pattern for each message."""
