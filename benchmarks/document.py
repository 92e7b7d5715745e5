"""BENCHMARKS.md: sections that each benchmark rewrites for itself, with command, commit and machine."""

from __future__ import annotations

import platform
import subprocess
import sys
import time
from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCUMENT = ROOT / "BENCHMARKS.md"

_TITLE = """# Benchmarks

Made by `accuracy.py`, `kinds.py`, `edges.py`, `speed.py`, `planning.py`, `exploration.py`, `ros_node.py`,
`bags.py`, `batch.py`, `points.py`, `detectors.py` and `mutants.py` in `benchmarks/`; do not edit by hand.
What is judged, and how, is told in [docs/evaluation.md](docs/evaluation.md). `delmerico2013` is the method
of ARL-TR-6381, the baseline.
"""

_SECTIONS = (
    "accuracy",
    "kinds",
    "edges",
    "detection_speed",
    "speed",
    "planning",
    "exploration",
    "ros",
    "bags",
    "batch",
    "clouds",
    "sweeps",
    "windows",
    "detectors",
    "mutants",
)


def write_section(name: str, text: str) -> None:
    """Replace one section of BENCHMARKS.md and leave the others as they are."""
    sections = dict.fromkeys(_SECTIONS, "")
    if DOCUMENT.exists():
        old = DOCUMENT.read_text(encoding="utf-8")
        for section in _SECTIONS:
            _, _, rest = old.partition(_mark(section, "begin"))
            sections[section] = rest.partition(_mark(section, "end"))[0].strip()
    sections[name] = text.strip()
    parts = [_TITLE.strip()]
    for section, content in sections.items():
        if content:
            parts += [_mark(section, "begin"), content, _mark(section, "end")]
    DOCUMENT.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


class BenchmarkRun:
    """Remembers when a run began, and with which commit: others may go on working meanwhile."""

    def __init__(self) -> None:
        self.started = time.monotonic()
        self.commit = _commit()


def describe_run(run: BenchmarkRun) -> str:
    """Return a paragraph with command, commit, machine and the time it took."""
    seconds = time.monotonic() - run.started
    # Where the folders lie on this machine is of no use elsewhere.
    given = [
        Path(argument).name.upper() if argument.startswith(("/", "..")) else argument
        for argument in sys.argv[1:]
    ]
    command = " ".join([f"python {Path(sys.argv[0]).resolve().relative_to(ROOT)}", *given])
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "opencv-python-headless"))
    when = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC")
    return (
        f"`{command}`, {seconds / 60:.0f} min, {when}; commit {run.commit}; {_processor()}; "
        f"Python {platform.python_version()}, {packages}."
    )


def _mark(section: str, place: str) -> str:
    return f"<!-- {section}: {place} -->"


def _commit() -> str:
    def git(*arguments: str) -> str:
        return subprocess.run(
            ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False
        ).stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", "src")
    return (git("rev-parse", "--short", "HEAD") or "unknown") + (
        " with uncommitted changes" if changed else ""
    )


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{len(names)} × {names[0]}" if names else platform.machine()
