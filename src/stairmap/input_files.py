"""Read files that others wrote: one loader for all of them, with limits, no surprises and one-line messages.

A path is read only if it is a regular file of a sensible size. JSON and YAML have each key once. What they
hold is checked against a pydantic model with ranges, in which a truth value or a text is no number.
"""

from __future__ import annotations

import json
import math
import stat
from collections.abc import Hashable, Iterator
from pathlib import Path
from typing import Annotated, Any, TypeVar

import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from stairmap.errors import StairmapError

MAX_DOCUMENT_SIZE = 64 * 2**20
"""Largest JSON or YAML file, bytes: the stairways of a city need less."""

MAX_TABLE_SIZE = 256 * 2**20
"""Largest text table, bytes: three million poses, eight hours at 100 Hz."""

MAX_LOG_SIZE = 8 * 2**30
"""Largest log, bytes: ten million frames with stairs."""

MAX_LINE_SIZE = 16 * 2**20
"""Longest line of a log, bytes: a hundred stairways with all their steps."""

MAX_IMAGE_SIZE = 256 * 2**20
"""Largest image file, bytes: no depth camera has so many pixels."""

MAX_DEPTH = 50
"""Deepest nesting of a JSON or YAML file; those of stairmap have eight levels."""

MAX_QUOTED = 60
"""Longest piece of a file that a message repeats, in characters."""

MAX_COORDINATE = 1e7
"""Farthest place from a map's origin, m: national grids count from the equator."""

LARGEST_STAMP_NS = 2**63 - 1
"""Largest stamp that fits into 64 bits, nanoseconds."""

AnyError = TypeVar("AnyError", bound=StairmapError)
AnyModel = TypeVar("AnyModel", bound=BaseModel)


class CheckedModel(BaseModel):
    """Base of all models of files: a truth value or a text is no number, and no number is infinite."""

    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False, extra="ignore")


Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE, le=MAX_COORDINATE)]
"""A position along one axis, m."""

Deviation = Annotated[float, Field(ge=0, le=MAX_COORDINATE)]
"""A standard deviation, m or rad."""

Stamp = Annotated[int, Field(ge=-LARGEST_STAMP_NS, le=LARGEST_STAMP_NS)]
"""A stamp, nanoseconds."""

Place = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
"""A position, m."""


def _unit_vector(values: list[float]) -> list[float]:
    length = math.hypot(*values)
    if abs(length - 1) > 1e-3:
        raise ValueError(f"should have unit length, has {length:.3g}")
    return values


UnitVector = Annotated[
    list[Annotated[float, Field(ge=-1.01, le=1.01)]],
    Field(min_length=3, max_length=3),
    AfterValidator(_unit_vector),
]
"""A direction of length one."""


def check_is_file(path: Path, *, max_size: int, error_type: type[AnyError], what: str = "") -> None:
    """Refuse what is no regular file, before a pipe or device is waited for, and what is too large.

    Raises
    ------
    StairmapError
        Of the type given.
    """
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise error_type(f"cannot read {what}{shown(path)}: {reason}") from error
    if not stat.S_ISREG(status.st_mode):
        kind = "a folder" if stat.S_ISDIR(status.st_mode) else "a pipe or device"
        raise error_type(f"cannot read {what}{shown(path)}: expected a file, but it is {kind}")
    if status.st_size > max_size:
        raise error_type(
            f"cannot read {what}{shown(path)}: it has {status.st_size / 2**20:,.0f} MiB, more than "
            f"{max_size / 2**20:,.0f}; is it another kind of file?"
        )


def read_limited(path: Path, *, max_size: int, error_type: type[AnyError], what: str = "") -> bytes:
    """Read a whole regular file that is not larger than ``max_size`` bytes; see ``check_is_file``."""
    check_is_file(path, max_size=max_size, error_type=error_type, what=what)
    try:
        with path.open("rb") as file:
            content = file.read(max_size + 1)
    except OSError as error:
        raise error_type(f"cannot read {shown(path)}: {error.strerror}") from error
    if len(content) > max_size:
        raise error_type(f"cannot read {shown(path)}: it grows beyond {max_size / 2**20:,.0f} MiB")
    return content


def read_text(
    path: Path, *, error_type: type[AnyError], max_size: int = MAX_DOCUMENT_SIZE, what: str = ""
) -> str:
    """Read a text file in UTF-8, with or without a byte order mark; ``what`` it is goes before its name.

    Raises
    ------
    StairmapError
        Of the type given, if it is no regular file, too large, or no such text.
    """
    what = f"{what} " if what else ""
    data = read_limited(path, max_size=max_size, error_type=error_type, what=what)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise error_type(f"expected {what}{shown(path)} to be UTF-8 text, but it is UTF-16; save it as UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise error_type(
            f"expected {what}{shown(path)} to be UTF-8 text, but byte {error.start} is "
            f"0x{data[error.start]:02x}; is it another kind of file?"
        ) from error
    if "\0" in text:
        raise error_type(
            f"expected {what}{shown(path)} to be text, but it holds binary data; is it another kind of file?"
        )
    return text


def read_lines(path: Path, *, error_type: type[AnyError]) -> Iterator[tuple[str, bool]]:
    """Read a log line by line; each comes with whether it is whole.

    Only the last line of a process that was killed is not; zeros at the end, which a pulled plug leaves, are
    no line.

    Raises
    ------
    StairmapError
        Of the type given, if it is no regular file or text, or a line is too long.
    """
    check_is_file(path, max_size=MAX_LOG_SIZE, error_type=error_type)
    try:
        with path.open("rb") as file:
            number = 0
            while line := file.readline(MAX_LINE_SIZE):
                number += 1
                if not line.strip(b"\0"):
                    return
                if len(line) == MAX_LINE_SIZE:
                    raise error_type(f"{shown(path)}, line {number} is longer than {MAX_LINE_SIZE} bytes")
                try:
                    yield line.decode("utf-8").rstrip("\n"), line.endswith(b"\n")
                except UnicodeDecodeError as error:
                    if line.endswith(b"\n"):
                        raise error_type(f"{shown(path)}, line {number} is not text in UTF-8") from error
    except OSError as error:
        raise error_type(f"cannot read {shown(path)}: {error.strerror}") from error


def parse_json(text: str) -> Any:
    """Return what a JSON text holds; each key once, nesting at most ``MAX_DEPTH`` deep, no NaN or Infinity.

    Raises
    ------
    ValueError
        If it is no such text; ``json.JSONDecodeError`` where the place is known.
    """
    try:
        values = json.loads(text, object_pairs_hook=_unique_pairs, parse_constant=_refuse_constant)
    except RecursionError:
        raise ValueError(f"it is nested deeper than {MAX_DEPTH} levels") from None
    _check_depth(values)
    return values


def parse_yaml(text: str) -> Any:
    """Return what a YAML text holds; each key once, no aliases, nesting not deeper than ``MAX_DEPTH``.

    Raises
    ------
    ValueError
        If it is no such text.
    """
    try:
        values = yaml.load(text, Loader=_UniqueKeyLoader)
    except yaml.YAMLError as error:
        raise ValueError(quoted(" ".join(str(error).split()), limit=300, marks=False)) from error
    except RecursionError:
        raise ValueError(f"it is nested deeper than {MAX_DEPTH} levels") from None
    except (OverflowError, TypeError, AttributeError, KeyError, IndexError) as error:
        raise ValueError(str(error)) from error
    _check_depth(values)
    return values


def validated(model: type[AnyModel], values: Any) -> AnyModel:
    """Check values against a model.

    Raises
    ------
    ValueError
        With the first thing that is wrong: where, what was expected, what came.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise ValueError(first_mistake(error)) from error


def first_mistake(error: ValidationError) -> str:
    """Return the first mistake that pydantic found in a line: where, what was expected, what came."""
    first = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    if first["type"] == "missing":
        return f"lacks the key '{place}'"
    message = first["msg"].removeprefix("Value error, ")
    message = f"{message[:1].lower()}{message[1:]}".replace("input should", "should")
    got = "" if first["type"] == "value_error" else f", got {quoted(repr(first['input']), marks=False)}"
    return f"{place}: {message}{got}" if place else f"{message}{got}"


def quoted(text: str, *, limit: int = MAX_QUOTED, marks: bool = True) -> str:
    """Return a piece of a file for a message: shortened, on one line."""
    short = text if len(text) <= limit else text[: limit - 1] + "…"
    return repr(short) if marks else shown(short)


def shown(name: object) -> str:
    """Return a name for people: control characters, line ends and what is no UTF-8 as escapes (``\\n``)."""
    text = str(name)
    if text.isprintable():
        return text
    return "".join(character if character.isprintable() else _escaped(character) for character in text)


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def _unique_pairs(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) < len(pairs):
        keys = [key for key, _ in pairs]
        double = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {quoted(double)} is there twice")
    return values


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON; null is for one that is not known")


def _check_depth(values: Any) -> None:
    level = [values]
    for _ in range(MAX_DEPTH):
        level = [
            child
            for value in level
            if isinstance(value, dict | list)
            for child in (value.values() if isinstance(value, dict) else value)
            if isinstance(child, dict | list)
        ]
        if not level:
            return
    raise ValueError(f"it is nested deeper than {MAX_DEPTH} levels")


class _UniqueKeyLoader(yaml.SafeLoader):
    """The safe loader without its two traps: a key that is there twice, and aliases that multiply."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not supported; write the value")
        node: yaml.Node | None = super().compose_node(parent, index)
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            name = str(key.value)
            if name in seen:
                raise yaml.YAMLError(f"the key {quoted(name)} is there twice")
            seen.add(name)
        return super().construct_mapping(node, deep=deep)
