"""Stairways of whole drives with compiled and with NumPy kernels: they must be the same.

usage, as a worker: kernel_results.py SAMPLES.pkl; prints the stairways of each drive as JSON.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

from samples import DRIVES, FRAMES_PER_DRIVE, Sample

from stairmap.evaluation.table_format import format_table
from stairmap.session import MapSession

LIMIT_MM = 0.1
"""Largest difference of rise and run that is taken for none, mm."""


def measure_agreement(samples: dict[int, list[Sample]]) -> str:
    """Return the table of both kernels' stairways on each drive."""
    rows = []
    for width, mine in samples.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "samples.pkl"
            path.write_bytes(pickle.dumps(mine))
            compiled, numpy = (_stairways(path, variant) for variant in ("", "numpy"))
        for (scene, robot), first, second in zip(DRIVES, compiled, numpy, strict=True):
            same = len(first) == len(second)
            pairs = list(zip(first, second, strict=True)) if same else []
            apart = [
                max((abs(a[place] - b[place]) for a, b in pairs), default=0.0) * 1e3 for place in range(2)
            ]
            is_same = same and max(apart) <= LIMIT_MM
            rows.append(
                [
                    f"{scene}, {robot}, {width}×{width * 3 // 4}",
                    f"{len(first)} / {len(second)}",
                    *(f"{value:.2g}" if same else "-" for value in apart),
                    "yes" if is_same else "**no**",
                ]
            )
    header = ("drive", "flights, compiled / NumPy", "rise apart mm", "run apart mm", f"same to {LIMIT_MM} mm")
    return format_table(header, rows)


def _stairways(path: Path, variant: str) -> list[list[list[float]]]:
    """Rise and run of the flights of each drive."""
    result = subprocess.run(
        [sys.executable, __file__, str(path)],
        env=os.environ | {"STAIRMAP_KERNELS": variant},
        capture_output=True,
        check=True,
        text=True,
    )
    found: list[list[list[float]]] = json.loads(result.stdout)
    return found


def main() -> None:
    """Map each drive and print its flights."""
    samples: list[Sample] = pickle.loads(Path(sys.argv[1]).read_bytes())
    drives = []
    for first in range(0, len(samples), FRAMES_PER_DRIVE):
        session = MapSession()
        for sample in samples[first : first + FRAMES_PER_DRIVE]:
            session.add(sample.frame, sample.pose)
        drives.append([[f.rise, f.run] for stairway in session.stairways() for f in stairway.flights])
    print(json.dumps(drives))


if __name__ == "__main__":
    main()
