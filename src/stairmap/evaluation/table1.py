"""The report's Table 1 beside our estimates of stairs of the same dimensions (ARL-TR-6381, section 4)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from stairmap.evaluation.table_format import format_table
from stairmap.evaluation.trials import TrialResult
from stairmap.simulation.flight_scenes import TABLE_1

REPORT_ESTIMATES = {
    "b1_front": (0.174, 0.257, 0.977, 34.0),
    "b1_rear": (0.166, 0.252, 0.715, 33.0),
    "b3": (0.169, 0.245, 0.689, 35.4),
    "davis_front": (0.175, 0.323, 1.076, 28.3),
    "davis_rear": (0.169, 0.311, 1.048, 29.4),
}
"""What the report's authors estimated of the real stairs: rise, run, width (m), pitch (deg)."""


def format_table_1(results: Iterable[TrialResult], methods: Sequence[str]) -> str:
    """Return the table: for each stair and measure its true value, the report's estimate, and ours.

    Ours are the median over the drives in which the stair was found, with their number.
    """
    found: dict[tuple[str, str], list[tuple[float, ...]]] = {}
    for result in results:
        for flight in result.flights:
            if flight.estimate is not None:
                estimate = flight.estimate
                values = (
                    estimate["rise"],
                    estimate["run"],
                    estimate["width"],
                    float(np.degrees(estimate["pitch"])),
                )
                found.setdefault((result.spec.scene, result.method), []).append(values)
    rows = []
    for scene, (rise, run, width) in TABLE_1.items():
        truth = (rise, run, width, float(np.degrees(np.arctan2(rise, run))))
        rows.append([scene, "true", "", *_cells(truth)])
        rows.append(["", "the report", "", *_cells(REPORT_ESTIMATES[scene])])
        for method in methods:
            mine = found.get((scene, method), [])
            cells = _cells(tuple(np.median(mine, axis=0))) if mine else ["-"] * 4
            rows.append(["", method, str(len(mine)), *cells])
    return format_table(("stair", "", "drives", "rise m", "run m", "width m", "pitch °"), rows, num_left=2)


def _cells(values: Sequence[float]) -> list[str]:
    rise, run, width, pitch = values
    return [f"{rise:.3f}", f"{run:.3f}", f"{width:.3f}", f"{pitch:.1f}"]
