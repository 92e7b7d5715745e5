"""Exceptions that stairmap raises on purpose.

Every message says what was expected, what came, and what to do. Only the
command line and the ROS node catch them. A scene without a stairway is not an
error: detectors return an empty, falsy ``Detection`` that carries its reasons.
"""

from __future__ import annotations

import platform
from enum import Enum


class StairmapError(Exception):
    """Root of all errors that stairmap raises on purpose."""


class ConfigError(StairmapError):
    """A configuration file, key or value cannot be used."""


class RecordingError(StairmapError):
    """A recording, or a file in it, cannot be read."""


class CalibrationError(StairmapError):
    """Camera intrinsics or a depth scale are missing or impossible."""


class TrajectoryError(RecordingError):
    """Poses are missing, out of order or not rigid transforms."""


class TransformProblem(str, Enum):
    """Why a transform between two coordinate frames cannot be told."""

    UNKNOWN_FRAME = "unknown_frame"
    """Nobody has named one of the coordinate frames."""

    NOT_CONNECTED = "not_connected"
    """Both are known, but no chain of transforms joins them."""

    TOO_EARLY = "too_early"
    """The stamp lies before the oldest transform that is kept."""

    NOT_YET = "not_yet"
    """The stamp lies after the newest transform: wait, and it may come."""

    GAP = "gap"
    """The stamp lies between two transforms that are too far apart to interpolate."""


class TransformLookupError(TrajectoryError):
    """A transform between two coordinate frames cannot be told.

    Parameters
    ----------
    message
        What was asked, what there is.
    problem
        The kind of it; only after ``NOT_YET`` it pays to wait.
    """

    def __init__(self, message: str, problem: TransformProblem) -> None:
        super().__init__(message)
        self.problem = problem


class MapFullError(StairmapError):
    """A map holds as many observations as can be asked for stairways."""


class OutputError(StairmapError):
    """A result cannot be written."""


class BatchError(StairmapError):
    """A batch of recordings cannot be started or go on."""


class MergeError(StairmapError):
    """Runs cannot be made one map."""


class BenchmarkError(StairmapError):
    """Programs cannot be scored."""


class ResultsError(StairmapError):
    """A run folder, or a file in it, cannot be read."""


class CrashedTrialsError(StairmapError):
    """Trials of an evaluation did not come to their end."""


class MissingPackageError(StairmapError):
    """An optional package is needed for what was asked.

    Parameters
    ----------
    package
        Name of the missing package.
    extra
        Name of the stairmap extra that installs it.
    purpose
        What it is needed for, as the end of a sentence.
    no_wheel_on
        Processors (``platform.machine()``) for which nobody builds the package.
    """

    def __init__(self, package: str, extra: str, purpose: str, *, no_wheel_on: tuple[str, ...] = ()) -> None:
        machine = platform.machine()
        if machine in no_wheel_on:
            super().__init__(
                f"{purpose} needs the package {package}, which is not built for {machine}; do this on an "
                "x86-64 machine and copy the result"
            )
            return
        super().__init__(
            f"{purpose} needs the package {package}, which is not installed; "
            f"run: pip install 'stairmap[{extra}]'"
        )
