"""What ``stairmap evaluate`` was asked for, as a value that costs nothing to import."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluateRequest:
    """What ``stairmap evaluate`` was asked for.

    Attributes
    ----------
    suites, methods
        Names.
    only, sensor, width, robot, seed, num_drives, is_quick
        See ``stairmap.evaluation.suites.TrialChoice``.
    kinds
        Kinds of the suite ``kinds``; none: all.
    data
        Folder with ``buildings`` and ``real``.
    cache
        Folder that keeps rendered frames between runs; ``None``: they are not kept.
    num_workers
        Number of processes; ``None``: one per core.
    config_file, overrides
        See ``load_config``.
    output
        Folder for tables and pictures.
    with_convergence
        Whether to draw how each trial converges.
    as_json
        Whether to print JSON.
    """

    suites: tuple[str, ...]
    methods: tuple[str, ...]
    only: tuple[str, ...]
    sensor: str | None
    width: int | None
    robot: str | None
    seed: int
    num_drives: int | None
    is_quick: bool
    kinds: tuple[str, ...]
    data: Path
    cache: Path | None
    num_workers: int | None
    config_file: Path | None
    overrides: tuple[str, ...]
    output: Path | None
    with_convergence: bool
    as_json: bool
