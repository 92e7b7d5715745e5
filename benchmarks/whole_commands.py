"""What whole commands cost, reading and report included, and how long a fresh interpreter takes."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from stairmap.evaluation.table_format import format_table

NUM_STARTS = 9
NUM_FRAMES = 900

FIRST_DETECTION = """
import numpy as np
from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame
from stairmap.pipeline import make_detector
camera = PinholeCamera(width=640, height=480, fx=585.0, fy=585.0, cx=320.0, cy=240.0)
rows = np.arange(480)[:, None] - 239.5
depth = np.where(rows > 60, 585.0 * 0.5 / np.maximum(rows, 1.0), 4.0) + np.zeros((480, 640))
make_detector().detect(DepthFrame(stamp_ns=0, depth=depth.astype(np.float32), camera=camera))
"""
"""The first detection of a fresh interpreter: a floor before a wall."""


def measure_commands(cache: Path | None) -> str:
    """Return the table of `run` and `detect` over 900 frames of 640×480 pixels."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        recording = _recording(folder if cache is None else cache)
        commands = {
            "`stairmap run`": ["run", str(recording), "-o", str(folder / "run")],
            "`stairmap detect`": ["detect", str(recording), "-o", str(folder / "detect")],
            "`stairmap detect --no-overlays`": [
                "detect", str(recording), "--no-overlays", "-o", str(folder / "plain"),
            ],
        }  # fmt: skip
        rows = []
        for name, arguments in commands.items():
            wall, processor = _spent([sys.executable, "-m", "stairmap", *arguments])
            rows.append(
                [
                    name,
                    f"{wall:.1f}",
                    f"{processor:.1f}",
                    f"{1e3 * wall / NUM_FRAMES:.1f}",
                    f"{1e3 * processor / NUM_FRAMES:.1f}",
                ]
            )
    header = ("command", "wall s", "processor s", "wall ms per frame", "processor ms per frame")
    note = (
        f"A drive of {NUM_FRAMES} frames of simulated Kinect v1, 640×480, to `davis_rear`; start, reading, "
        "results and report included. Processor time is that of all threads."
    )
    return note + "\n\n" + format_table(header, rows)


def measure_start() -> str:
    """Return how long a fresh interpreter takes."""
    commands = {
        "`python -c pass`": ["-c", "pass"],
        "`import numpy, cv2`": ["-c", "import numpy, cv2"],
        "`import stairmap`": ["-c", "import stairmap"],
        "`import stairmap` and a first detection": ["-c", FIRST_DETECTION],
        "`stairmap --help`": ["-m", "stairmap", "--help"],
        "`stairmap run --help`": ["-m", "stairmap", "run", "--help"],
    }
    spent: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    for _ in range(NUM_STARTS):
        for name, arguments in commands.items():
            spent[name].append(_spent([sys.executable, *arguments]))
    rows = []
    for name, both in spent.items():
        walls, processors = zip(*both, strict=True)
        rows.append(
            [name, *(f"{statistics.median(s):.2f}" for s in (walls, processors)), f"{min(walls):.2f}"]
        )
    header = ("command", f"wall s, median of {NUM_STARTS}", "processor s, median", "fastest, wall s")
    return format_table(header, rows)


def _recording(folder: Path) -> Path:
    """The drive, simulated once for each folder."""
    recording = folder / f"davis_rear_{NUM_FRAMES}"
    if not recording.exists():
        partial = folder / f"davis_rear_{NUM_FRAMES}.partial"
        options = ["--sensor", "kinect_v1", "--frames", str(NUM_FRAMES), "-o", str(partial)]
        _spent([sys.executable, "-m", "stairmap", "simulate", "davis_rear", *options])
        partial.rename(recording)
    return recording


def _spent(command: Sequence[str]) -> tuple[float, float]:
    """Wall and processor seconds of a command and its threads."""
    before, start = os.times(), time.monotonic()
    result = subprocess.run(command, capture_output=True, check=False)
    wall, after = time.monotonic() - start, os.times()
    if result.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} failed: {result.stderr.decode()[-500:]}")
    user, system = after.children_user - before.children_user, after.children_system - before.children_system
    return wall, user + system
