"""What detection costs over kinds of frames, with compiled and with NumPy kernels, frame by frame in turn.

Times are given in units of a fixed piece of work, a stable sort of 100,000 doubles, that is measured between
the frames: so tables of different machines, and of one that is busy, can be compared.
"""

from __future__ import annotations

import os
import pickle
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from goals import Goal
from samples import Sample

from stairmap.camera import PinholeCamera
from stairmap.delmerico2013 import lines as report_lines
from stairmap.evaluation.table_format import format_table
from stairmap.evaluation.view_running import load_view, make_view_specs
from stairmap.frame import DepthFrame

KERNELS = {"compiled": "", "NumPy": "numpy"}
"""Variants by name, and what ``STAIRMAP_KERNELS`` is for them."""

MAX_MEDIAN_UNITS = {"320×240": 0.31, "640×480": 0.31}
"""Goals of the median, by size: about three milliseconds."""

MAX_P99, MAX_MOST = 2.5, 4.0
"""Goals of the 99th percentile and of the maximum, in medians."""

MAX_LARGE_MS, USUAL_UNIT_MS = 10.0, 9.6
"""Goal of a frame of 1920×1080 pixels, and the unit of the machine it was set for, ms."""

VIEWS_PER_KIND = 24
STRIPE_ROWS = 6
NOISE_RANGE = (0.5, 5.0)
PIECE = np.random.default_rng(0).random(100_000)


def measure_detection(samples: dict[int, list[Sample]], cache: Path | None) -> str:
    """Return the table of all kinds of frames."""
    named = list(_all_frames(samples, cache))
    milliseconds = _measure([frame for _, frame in named])
    names = list(dict.fromkeys(name for name, _ in named))
    groups = [(name, [i for i, (own, _) in enumerate(named) if own == name]) for name in names]
    sizes = {
        size: [i for i, (name, _) in enumerate(named) if name.endswith(size)] for size in MAX_MEDIAN_UNITS
    }
    groups += [(f"**all of {size}**", members) for size, members in sizes.items()]
    unit = statistics.median(milliseconds["piece"])
    rows = []
    for name, members in groups:
        mine = {key: np.array(values)[members] for key, values in milliseconds.items()}
        edges = float(np.median(mine["edges"]))
        row = [name, str(len(members))]
        for variant in KERNELS:
            p50, p99, most = (float(np.percentile(mine[variant], share)) for share in (50, 99, 100))
            row += [f"{p50:.2f}", f"{p50 / unit:.2f}", f"{p99 / p50:.1f}", f"{most / p50:.1f}"]
        row += [f"{float(np.median(mine['compiled'])) / edges:.1f}"]
        rows.append(row)
    columns = [f"{variant}: {what}" for variant in KERNELS for what in ("ms", "units", "p99", "max")]
    note = (
        "Processor time of one thread; medians, and the 99th percentile and the maximum in medians. A unit "
        f"is a stable sort of 100,000 doubles, {unit:.2f} ms here, measured between the frames. The last "
        "column is the median with compiled kernels over that of `cv2.Canny` and `cv2.HoughLinesP` on the "
        "same frames."
    )
    table = format_table(("frames", "number", *columns, "compiled: × Canny + Hough"), rows)
    compiled = np.array(milliseconds["compiled"])
    goals = [goal for size, members in sizes.items() for goal in _goals(size, compiled[members], unit)]
    largest = [i for i, name in enumerate(name for name, _ in named) if name.endswith("1920×1080")]
    median = float(np.median(compiled[largest]))
    text = f"1920×1080: median ≤ {MAX_LARGE_MS:g} ms where a unit takes {USUAL_UNIT_MS:g} ms"
    at_usual = median / unit * USUAL_UNIT_MS
    goals.append(Goal(text=text, measured=f"{at_usual:.1f} ms", is_met=at_usual <= MAX_LARGE_MS))
    met = format_table(("goal, compiled kernels", "measured", "met"), [goal.cells() for goal in goals])
    return "\n\n".join([note, table, met])


def _goals(size: str, milliseconds: np.ndarray, unit: float) -> list[Goal]:
    """What all frames of one size should take, and what they took."""
    median, p99, most = (float(np.percentile(milliseconds, share)) for share in (50, 99, 100))
    limit = MAX_MEDIAN_UNITS[size]
    return [
        Goal(
            text=f"{size}: median ≤ {limit:g} units",
            measured=f"{median / unit:.2f}",
            is_met=median <= limit * unit,
        ),
        Goal(
            text=f"{size}: 99th percentile ≤ {MAX_P99:g}, maximum ≤ {MAX_MOST:g} medians",
            measured=f"{p99 / median:.1f}, {most / median:.1f}",
            is_met=p99 <= MAX_P99 * median and most <= MAX_MOST * median,
        ),
    ]


def _all_frames(samples: dict[int, list[Sample]], cache: Path | None) -> Iterator[tuple[str, DepthFrame]]:
    for width, mine in samples.items():
        for sample in mine:
            kind = "stairs" if sample.has_stairs else "clutter"
            yield f"{kind} {width}×{width * 3 // 4}", sample.frame
    for kind in ("descending", "look-alikes"):
        specs = make_view_specs([kind])
        for spec in specs[:: max(1, len(specs) // VIEWS_PER_KIND)]:
            yield kind, load_view(spec, cache)[1]
    random = np.random.default_rng(0)
    some = [sample.frame for sample in samples[640]][:: max(1, len(samples[640]) // VIEWS_PER_KIND)]
    for frame in some:
        noise = random.uniform(*NOISE_RANGE, frame.depth.shape).astype(np.float32)
        yield "noise 640×480", replace(frame, depth=noise)
    for frame in some:
        rows = np.arange(frame.camera.height)[:, None] // STRIPE_ROWS % 2
        stripes = np.broadcast_to(np.where(rows, 1.5, 2.0), frame.depth.shape).astype(np.float32)
        yield "stripes 640×480", replace(frame, depth=stripes)
    for factor, size in ((2, (1280, 720)), (3, (1920, 1080))):
        for frame in some:
            yield f"stairs and clutter {size[0]}×{size[1]}", _enlarged(frame, factor, size)


def _enlarged(frame: DepthFrame, factor: int, size: tuple[int, int]) -> DepthFrame:
    """The frame with each pixel made several, cut to a size about its middle."""
    camera = frame.camera
    top = (camera.height * factor - size[1]) // 2
    depth = frame.depth.repeat(factor, axis=0).repeat(factor, axis=1)[top : top + size[1], : size[0]]
    enlarged = PinholeCamera(
        width=size[0],
        height=size[1],
        fx=camera.fx * factor,
        fy=camera.fy * factor,
        cx=(camera.cx + 0.5) * factor - 0.5,
        cy=(camera.cy + 0.5) * factor - 0.5 - top,
    )
    return replace(frame, depth=np.ascontiguousarray(depth), camera=enlarged)


def _measure(frames: list[DepthFrame]) -> dict[str, list[float]]:
    """Milliseconds of each frame for each variant, bare edges, and the fixed piece of work."""
    milliseconds: dict[str, list[float]] = {name: [] for name in (*KERNELS, "edges", "piece")}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frames.pkl"
        path.write_bytes(pickle.dumps(frames))
        with _worker(path, "compiled") as compiled, _worker(path, "NumPy") as numpy:
            for number, frame in enumerate(frames):
                for name, worker in (("compiled", compiled), ("NumPy", numpy)):
                    assert worker.stdin is not None and worker.stdout is not None
                    worker.stdin.write(f"{number}\n")
                    worker.stdin.flush()
                    milliseconds[name].append(float(worker.stdout.readline()))
                grey = report_lines.grey_from_depth(np.nan_to_num(frame.depth))
                start = time.thread_time()
                edges = cv2.Canny(
                    grey, *report_lines.CANNY_THRESHOLDS, apertureSize=report_lines.CANNY_KERNEL
                )
                cv2.HoughLinesP(
                    edges,
                    report_lines.HOUGH_DISTANCE,
                    report_lines.HOUGH_ANGLE,
                    report_lines.HOUGH_THRESHOLD,
                    minLineLength=report_lines.HOUGH_MIN_LENGTH,
                    maxLineGap=report_lines.HOUGH_MAX_GAP,
                )
                milliseconds["edges"].append(1e3 * (time.thread_time() - start))
                start = time.thread_time()
                np.sort(PIECE, kind="stable")
                milliseconds["piece"].append(1e3 * (time.thread_time() - start))
    return milliseconds


@contextmanager
def _worker(path: Path, variant: str) -> Iterator[subprocess.Popen[str]]:
    """Start a process that detects with one variant of the kernels."""
    script = Path(__file__).parent / "detection_worker.py"
    environment = os.environ | {"STAIRMAP_KERNELS": KERNELS[variant]}
    with subprocess.Popen(
        [sys.executable, str(script), str(path)],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as worker:
        assert worker.stdin is not None and worker.stdout is not None
        if worker.stdout.readline().strip() != "ready":
            raise RuntimeError(f"the worker with {variant} kernels did not start")
        yield worker
        worker.stdin.close()
