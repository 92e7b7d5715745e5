"""docs/method.md agrees with the code: its constants, the tolerances it quotes, its files and pictures.

Run as a program, this file writes the table of constants into the page:

    .venv/bin/python tests/test_docs_method.py
"""

from __future__ import annotations

import ast
import itertools
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PATH = ROOT / "docs" / "method.md"
PAGE = PATH.read_text(encoding="utf-8")

BEGIN, END = "<!-- constants: begin -->\n", "<!-- constants: end -->\n"

MODULES = (
    *(f"detection/{name}.py" for name in (
        "detector", "inverse_depth", "orientation", "elevation", "nosing_search", "lattice", "profile", "fit",
        "candidate", "evidence", "extents", "judgement", "observation", "tracing",
    )),
    *(f"modeling/{name}.py" for name in (
        "observation_table", "association", "fitting", "landings", "mapper",
    )),
)  # fmt: skip
"""In the order of the method; other files of the two folders follow."""


def constants_table() -> str:
    """Return the table: file, constants, value, reason."""
    sources = ROOT / "src" / "stairmap"
    found = [f"{folder}/{path.name}" for folder in ("detection", "modeling")
             for path in sorted((sources / folder).glob("*.py"))]  # fmt: skip
    rows = ["| file | constant | value | what and why |", "|---|---|---|---|"]
    for module in sorted(found, key=lambda name: (*MODULES, name).index(name)):
        for names, value, reason in _documented_constants(sources / module):
            shown = " ".join(f"`{name}`" for name in names)
            # Angles are shown in degrees, whatever the code counts in.
            reason = reason.replace(", rad", "") if "°" in value else reason  # noqa: PLW2901
            rows.append(f"| {module} | {shown} | {value} | {reason} |")
    return "\n".join(rows) + "\n"


def _documented_constants(path: Path) -> list[tuple[list[str], str, str]]:
    """Names, value and docstring of each documented constant of a module."""
    found = []
    body = ast.parse(path.read_text(encoding="utf-8")).body
    for statement, following in itertools.pairwise(body):
        if not isinstance(statement, ast.Assign) or not isinstance(following, ast.Expr):
            continue
        target = statement.targets[0]
        names = [item.id for item in (target.elts if isinstance(target, ast.Tuple) else [target])
                 if isinstance(item, ast.Name)]  # fmt: skip
        if isinstance(following.value, ast.Constant) and all(
            re.fullmatch(r"[A-Z][A-Z0-9_]*", n) for n in names
        ):
            reason = " ".join(str(following.value.value).replace("``", "`").split())
            found.append((names, _shown(statement.value), reason.replace("|", "\\|")))
    return found


def _shown(value: ast.expr) -> str:
    """A value as people read it: angles in degrees, numbers without brackets."""
    text = ast.unparse(value)
    text = re.sub(r"np\.radians\(([\d.]+)\)", r"\1°", text)
    text = re.sub(r"float\(([\d.]+°)\)", r"\1", text)
    text = re.sub(r"([\d.]+)° \*\* 2", r"(\1°)²", text)
    text = re.sub(r"([\d.]+) \*\* 2", r"\1²", text)
    text = re.sub(r"^(np\.array\()?[\[(](.*?)[\])]+$", r"\2", text)
    return re.sub(r"\b(\d+)\.0\b", r"\1", text).replace("_", "")


def updated_page() -> str:
    """Return the page with the table as the code has it."""
    before, rest = PAGE.split(BEGIN)
    return before + BEGIN + constants_table() + END + rest.split(END)[1]


def test_table_of_constants_is_that_of_the_code():
    assert updated_page() == PAGE, "run: .venv/bin/python tests/test_docs_method.py"


@pytest.mark.parametrize(
    ("formula", "file"),
    re.findall(r"^\| .* \| `([^`]+)` \| ((?:detection|modeling)/\w+\.py) \|$", PAGE, re.M),
)
def test_tolerances_are_those_of_the_code(formula, file):
    assert formula in (ROOT / "src" / "stairmap" / file).read_text(encoding="utf-8")


def test_page_quotes_tolerances_at_all():
    assert len(re.findall(r"^\| .* \| `[^`]* noise[^`]*` \|", PAGE, re.M)) >= 2


QUOTED = re.findall(r"`([A-Z][A-Z_]+)` = ([\d.]+°?)", PAGE.split(BEGIN)[0])


@pytest.mark.parametrize(("name", "value"), QUOTED)
def test_numbers_in_the_text_are_those_of_the_code(name, value):
    session = _documented_constants(ROOT / "src" / "stairmap" / "session.py")
    table = re.findall(r"^\| [\w/.]+ \| (.*?) \| (.*?) \|", constants_table(), re.M)
    table += [(" ".join(f"`{mine}`" for mine in names), shown) for names, shown, _ in session]
    values = [
        float(number.rstrip("°"))
        for names, shown in table
        for mine, number in zip(names.split(), shown.split(", "), strict=False)
        if mine == f"`{name}`"
    ]
    assert float(value.rstrip("°")) in values


def test_text_quotes_numbers_at_all():
    assert len(QUOTED) >= 8


def test_files_in_the_table_of_steps_are_all_of_the_detector():
    named = set(re.findall(r"`(?:\w+/)*(\w+\.py)`", PAGE.split("## From observations to stairways")[0]))
    files = {path.name for path in (ROOT / "src" / "stairmap" / "detection").glob("*.py")}
    assert files - named <= {"__init__.py", "observation.py", "tracing.py"}


def test_rules_of_the_page_are_those_of_the_code():
    folder = ROOT / "src" / "stairmap" / "detection"
    source = "".join(path.read_text(encoding="utf-8") for path in folder.glob("*.py"))
    rules = set(re.findall(r'(?:rule=|_broken\()"(\w+)"', source))
    rules |= {f"{side}_{name}" for side in ("min", "max") for name in ("rise", "run", "pitch")}
    assert {rule for rule in rules if f"`{rule}`" not in PAGE} == set()


def test_named_files_exist():
    names = re.findall(r"`(?:\w+/)*(\w+\.py)`", PAGE)
    known = {path.name for folder in ("src", "docs", "tests") for path in (ROOT / folder).rglob("*.py")}
    assert sorted(set(names) - known) == []


def test_pictures_are_used_and_small():
    pictures = sorted((ROOT / "docs" / "images").glob("method-*.png"))
    assert [path.name for path in pictures if f"(images/{path.name})" not in PAGE] == []
    assert [path.name for path in pictures if path.stat().st_size > 200_000] == []


if __name__ == "__main__":
    PATH.write_text(updated_page(), encoding="utf-8")
