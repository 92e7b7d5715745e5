"""docs/troubleshooting.md has a row for each message that a user can meet, and none for one that is gone."""

from __future__ import annotations

import ast
import builtins
import re
from pathlib import Path

import pytest

from documented_messages import DOCUMENTED, DOCUMENTED_PARTS

ROOT = Path(__file__).resolve().parents[1]
SOURCES = [*sorted((ROOT / "src/stairmap").rglob("*.py")), *sorted((ROOT / "ros").rglob("*.py"))]

OTHER_ERRORS = {*vars(builtins), "MissingPackageError", "ValidationError"}
"""Errors that are no user's, and that of a missing package, whose class makes the message."""

PASSED_ON = "error_type"
"""What functions of ``input_files`` call the kind of error that they were given."""

MIN_LETTERS = 16
"""A message with fewer letters of its own passes another one on, with a path or a topic before it."""


def text_of(node: ast.expr) -> str | None:
    """A text in which … stands for what is put in."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values)
    return None


@pytest.fixture(scope="module")
def expressions() -> list[tuple[str, ast.expr]]:
    """All expressions of the sources, and where they stand."""
    return [
        (f"{path.relative_to(ROOT)}:{node.lineno}", node)
        for path in SOURCES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call | ast.Constant | ast.JoinedStr)
    ]


def test_each_message_has_a_row(expressions: list[tuple[str, ast.expr]]) -> None:
    messages = {}
    for place, node in expressions:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.args:
            name = node.func.id
            is_ours = name == PASSED_ON or (name.endswith("Error") and name not in OTHER_ERRORS)
            text = text_of(node.args[0]) if is_ours else None
            if text is not None and len(re.findall(r"[A-Za-z]", text)) >= MIN_LETTERS:
                messages[place] = text
    assert len(messages) > 250
    rowless = {
        place: text
        for place, text in messages.items()
        if not any(pattern.search(text) for pattern in DOCUMENTED)
    }
    assert rowless == {}


OTHERS = {
    "should have", "list should have at", "should have at most", "externally-managed-environment",
    "No module named venv", "ensurepip is not available", "No such option", "No such command",
    "No such file or directory", "Possible options", "opencv-python", "opencv-python-headless",
    "stairmap --version", "width ≥", "reading LAS and LAZ files needs the package laspy",
    "the poses do not fit the depth images unless the quaternions are in the order qw qx qy qz",
    "unless they are in millimetres", "unless they are poses of the body", "but it is a pipe or device",
    "is used up only", "has no schema",
}  # fmt: skip
"""What pydantic, typer, Python and pip say, what is no message, and what is put together of two texts."""


def test_no_row_is_for_a_message_that_is_gone(expressions: list[tuple[str, ast.expr]]) -> None:
    texts = "\n".join(text for _, node in expressions if (text := text_of(node)) is not None)
    # Values that a row gives as examples are no words of the message.
    pieces = [
        max((piece.strip() for part in parts for piece in re.split(r"[\d:;,()]+", part)), key=len)
        for parts in DOCUMENTED_PARTS
    ]
    assert [piece for piece in pieces if piece not in texts and piece not in OTHERS] == []
