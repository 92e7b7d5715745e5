"""Programs that enter the benchmark: they read requests from stdin and answer, a line each."""

from __future__ import annotations

import contextlib
import json
import math
import select
import shlex
import subprocess
import time
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from stairmap.errors import BenchmarkError
from stairmap.input_files import CheckedModel, Coordinate, Place, parse_json, quoted, validated
from stairmap.saved_stairway import MAX_RISE, MAX_RISERS, MAX_RUN, MAX_WIDTH, MIN_RISE, MIN_RUN, MIN_WIDTH
from stairmap.stairway import Flight, FlightStd

MAX_ANSWER = 16 * 2**20
"""Longest answer, bytes."""

MAX_READ = 65536
"""Bytes that are read at once."""

_UNKNOWN = FlightStd(
    **dict.fromkeys(("rise", "run", "width", "pitch", "heading"), math.nan), base=np.full(3, math.nan)
)


class _AnsweredFlight(CheckedModel):
    """A flight of an answer, in the map: m, rad."""

    base: Place
    heading: Annotated[float, Field(ge=-100, le=100)]
    rise: Annotated[float, Field(ge=MIN_RISE, le=MAX_RISE)]
    run: Annotated[float, Field(ge=MIN_RUN, le=MAX_RUN)]
    width: Annotated[float, Field(ge=MIN_WIDTH, le=MAX_WIDTH)]
    num_risers: Annotated[int, Field(ge=1, le=MAX_RISERS)]


class _AnswerLine(CheckedModel):
    """An answer: flights, or ``skip`` for a kind of task that the program is not for."""

    flights: Annotated[list[_AnsweredFlight], Field(max_length=1000)] = Field(default_factory=list)
    skip: bool = False
    ms: Coordinate | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a program said to one task.

    Attributes
    ----------
    flights
        What it found, in the map.
    is_skipped
        Whether it is not for such tasks.
    ms
        Wall-clock time from request to answer, or what the program itself measured, ms.
    error
        Why there is no answer that counts; empty if there is one.
    """

    flights: tuple[Flight, ...] = ()
    is_skipped: bool = False
    ms: float = 0.0
    error: str = ""


class Program:
    """A program that answers; started at the first request, and again after it ended.

    Parameters
    ----------
    name
        What tables call it.
    command
        How it is started, with its arguments, as for a shell.
    timeout
        Time for an answer, s.

    Raises
    ------
    BenchmarkError
        If the command is no command.
    """

    def __init__(self, name: str, command: str, *, timeout: float) -> None:
        try:
            self._command = shlex.split(command)
        except ValueError as error:
            raise BenchmarkError(f"the command of {name} cannot be read: {error}") from error
        if not self._command:
            raise BenchmarkError(f"expected --program NAME=COMMAND, but the command of {name} is empty")
        self.name, self._timeout = name, timeout
        self._process: subprocess.Popen[bytes] | None = None

    def ask(self, request: dict[str, Any]) -> Answer:
        """Return the answer to a request; whatever goes wrong stands in it."""
        started = time.perf_counter()
        try:
            process = self._start()
        except OSError as error:
            raise BenchmarkError(f"cannot start {self.name}: {self._command[0]}: {error.strerror}") from error
        try:
            assert process.stdin is not None
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
            line = self._read_line(process, started + self._timeout)
        except OSError:
            line = b""
        ms = (time.perf_counter() - started) * 1e3
        if not line.endswith(b"\n"):
            self.close()
            is_late = ms >= self._timeout * 1e3
            return Answer(ms=ms, error=f"no answer in {self._timeout:g} s" if is_late else "it ended")
        return _answer_of(line, ms)

    def _read_line(self, process: subprocess.Popen[bytes], deadline: float) -> bytes:
        assert process.stdout is not None
        parts = bytearray()
        while len(parts) < MAX_ANSWER and not parts.endswith(b"\n"):
            rest = deadline - time.perf_counter()
            if rest <= 0 or not select.select([process.stdout], [], [], rest)[0]:
                break
            part = process.stdout.read(MAX_READ)  # unbuffered: what there is
            if not part:
                break
            parts += part
        return bytes(parts)

    def _start(self) -> subprocess.Popen[bytes]:
        if self._process is None or self._process.poll() is not None:
            self._process = subprocess.Popen(
                self._command,
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )
        return self._process

    def close(self) -> None:
        """End the program."""
        if self._process is not None:
            self._process.kill()
            with contextlib.suppress(OSError):
                self._process.communicate()
            self._process = None


def _answer_of(line: bytes, ms: float) -> Answer:
    try:
        saved = validated(_AnswerLine, parse_json(line.decode("utf-8")))
    except ValueError as error:
        return Answer(
            ms=ms, error=f"its answer breaks the protocol: {quoted(str(error), limit=120, marks=False)}"
        )
    flights = tuple(
        Flight(
            base=np.array(flight.base), heading=flight.heading, rise=flight.rise, run=flight.run,
            width=flight.width, num_risers=flight.num_risers, std=_UNKNOWN,
        )
        for flight in saved.flights
    )  # fmt: skip
    return Answer(flights=flights, is_skipped=saved.skip, ms=ms if saved.ms is None else saved.ms)
