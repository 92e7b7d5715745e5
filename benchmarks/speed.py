"""Measure what stairmap costs: detection, modeling, queries, whole commands, start; against bare OpenCV.

Writes the sections "detection_speed" and "speed" of BENCHMARKS.md. Times are processor times of one thread
where nothing else is said; what is compared is measured in turn on the same frames in the same run, so that a
busy machine slows all of them alike.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from detection_speed import measure_detection
from document import BenchmarkRun, describe_run, write_section
from kernel_results import measure_agreement
from long_runs import measure_growth, measure_large_queries, measure_queries
from samples import Sample, load_samples, timed
from stage_times import timed_stages
from whole_commands import measure_commands, measure_start

from stairmap.config import Config
from stairmap.delmerico2013 import lines as report_lines
from stairmap.detection.observation import StairObservation
from stairmap.evaluation.table_format import format_table
from stairmap.kernels import VARIANT, describe_kernels
from stairmap.pipeline import METHODS, Detector, Modeler

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Environment in which numpy computes on one thread; it must be set before numpy is imported."""

SIZES = (320, 640)


def main() -> None:
    """Measure everything and write both sections."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cache", type=Path, default=None, help="keep rendered frames here")
    parser.add_argument("--num-frames", type=int, default=10_000, help="length of the long run")
    parser.add_argument("--detection-only", action="store_true", help="only kinds of frames and kernels")
    parser.add_argument("--print", action="store_true", dest="is_dry", help="write nothing")
    arguments = parser.parse_args()
    if os.environ | ONE_THREAD != os.environ:
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | ONE_THREAD)
    cv2.setNumThreads(1)
    if VARIANT != "compiled":
        raise SystemExit(f"expected compiled kernels, both are measured; got {describe_kernels()}")
    samples = {width: load_samples(width, arguments.cache) for width in SIZES}
    write_part(
        "detection_speed",
        "## Speed of detection",
        lambda: [measure_detection(samples, arguments.cache)],
        is_dry=arguments.is_dry,
    )
    if arguments.detection_only:
        return
    write_part(
        "speed",
        "## Speed",
        lambda: [
            "### Per frame, one thread",
            measure_frames(samples),
            "### Where the default detector's time goes",
            measure_stages(samples),
            "### Compiled against NumPy kernels over whole drives",
            measure_agreement(samples),
            f"### Over {arguments.num_frames:,} frames, 320×240",
            measure_growth(samples[320], arguments.num_frames),
            "### Queries",
            measure_queries(samples[320]),
            measure_large_queries(samples[320]),
            "### Whole commands",
            measure_commands(arguments.cache),
            "### Start",
            measure_start(),
        ],
        is_dry=arguments.is_dry,
    )


def write_part(name: str, title: str, measure: Callable[[], list[str]], *, is_dry: bool) -> None:
    """Measure one section, and write it unless it is only printed."""
    run = BenchmarkRun()
    parts = measure()
    text = "\n\n".join([title, describe_run(run), *parts])
    if not is_dry:
        write_section(name, text)
    print(text)


def measure_frames(samples: dict[int, list[Sample]]) -> str:
    """Return the table of medians per frame of bare OpenCV and both methods, taken in turn."""
    rows = []
    for width, mine in samples.items():
        detectors = {name: make[0](Config()) for name, make in METHODS.items()}
        modelers = {name: make[1](Config()) for name, make in METHODS.items()}
        for sample in mine[:5]:
            for detector in detectors.values():
                detector.detect(sample.frame)
        seconds: dict[str, list[float]] = {}
        for sample in mine:
            edges, spent = timed(find_edges, sample.grey)
            seconds.setdefault("Canny", []).append(spent)
            _, spent = timed(find_lines, edges)
            seconds.setdefault("HoughLinesP", []).append(spent)
            sure_edges = report_lines.remove_edges_at_invalid_depth(edges, sample.grey)
            _, spent = timed(find_lines, sure_edges)
            seconds.setdefault("HoughLinesP without edges at holes", []).append(spent)
            for name, detector in detectors.items():
                detection, spent = timed(detector.detect, sample.frame)
                seconds.setdefault(f"{name}: detection", []).append(spent)
                _, spent = timed(add_all, modelers[name], detection.observations)
                seconds.setdefault(f"{name}: modeling", []).append(spent)
        rows += frame_rows(
            f"{width}×{width * 3 // 4}", mine, {k: np.array(v) * 1e3 for k, v in seconds.items()}
        )
    header = ("image", "", "stairs ms", "× OpenCV", "clutter ms", "× OpenCV", "all ms", "× OpenCV")
    note = (
        f"Medians over {len(samples[320])} frames of simulated Kinect v1 (four drives to stairs, one through "
        "a cluttered room without). OpenCV is `cv2.Canny` and `cv2.HoughLinesP` with the report's parameters "
        "on the 8-bit image of the same frame, one thread. The report's method works on 320×240 pixels of "
        "either image, and fits its models when it is asked for them. Borders of holes without depth are "
        "most of the edges in these images; the report's method removes them before the transform, which "
        "is then quicker, as a line of its own shows."
    )
    return note + "\n\n" + format_table(header, rows, num_left=2)


def frame_rows(size: str, samples: list[Sample], ms: dict[str, np.ndarray]) -> list[list[str]]:
    """Return the lines of one image size."""
    has_stairs = np.array([sample.has_stairs for sample in samples])
    groups = (has_stairs, ~has_stairs, np.ones(len(samples), dtype=bool))
    bare = ms["Canny"] + ms["HoughLinesP"]
    names = ("Canny", "HoughLinesP", "HoughLinesP without edges at holes")
    lines = {name: ms[name] for name in names} | {"Canny and HoughLinesP": bare}
    for name in METHODS:
        detection, modeling = ms[f"{name}: detection"], ms[f"{name}: modeling"]
        lines |= {
            f"{name}: detection": detection,
            f"{name}: modeling": modeling,
            f"**{name}**": detection + modeling,
        }
    rows = []
    for name, values in lines.items():
        row = [size, name]
        for group in groups:
            median = float(np.median(values[group]))
            row += [f"{median:.2f}", f"{median / float(np.median(bare[group])):.1f}"]
        rows.append(row)
        size = ""
    return rows


def measure_stages(samples: dict[int, list[Sample]]) -> str:
    """Return the table of mean times of the detector's parts."""
    means: dict[int, dict[str, float]] = {}
    for width, mine in samples.items():
        detector = METHODS["stairmap"][0](Config())
        with timed_stages() as seconds:
            _, total = timed(detect_all, detector, mine)
        seconds["the rest"] = total - sum(seconds.values())
        means[width] = {name: 1e3 * value / len(mine) for name, value in seconds.items()}
        means[width]["all"] = 1e3 * total / len(mine)
    names = sorted(means[320], key=lambda name: (name in ("the rest", "all"), -means[320][name]))
    names = [*(name for name in names if name != "all"), "all"]
    rows = [
        [f"`{name}`" if "_" in name else name, *(f"{means[w].get(name, 0):.2f}" for w in SIZES)]
        for name in names
    ]
    return format_table(("function", *(f"{w}×{w * 3 // 4}, mean ms" for w in SIZES)), rows)


def find_edges(grey: np.ndarray) -> np.ndarray:
    """Run bare Canny with the report's parameters."""
    return cv2.Canny(grey, *report_lines.CANNY_THRESHOLDS, apertureSize=report_lines.CANNY_KERNEL)


def find_lines(edges: np.ndarray) -> np.ndarray | None:
    """Run the bare probabilistic Hough transform with the report's parameters."""
    return cv2.HoughLinesP(
        edges,
        report_lines.HOUGH_DISTANCE,
        report_lines.HOUGH_ANGLE,
        report_lines.HOUGH_THRESHOLD,
        minLineLength=report_lines.HOUGH_MIN_LENGTH,
        maxLineGap=report_lines.HOUGH_MAX_GAP,
    )


def add_all(modeler: Modeler, observations: Sequence[StairObservation]) -> None:
    """Give observations to a modeler."""
    for observation in observations:
        modeler.add(observation)


def detect_all(detector: Detector, samples: Sequence[Sample]) -> None:
    """Look at all frames."""
    for sample in samples:
        detector.detect(sample.frame)


if __name__ == "__main__":
    main()
