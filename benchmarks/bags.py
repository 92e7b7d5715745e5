"""Measure what reading bags costs: frames per second of 640x480 depth, and memory, for each format.

Writes the section "bags" of BENCHMARKS.md. Each bag is read in a process of its own; times are processor
times of one thread, of reading and decoding alone, without detection.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from document import ROOT, BenchmarkRun, describe_run, write_section

sys.path.insert(0, str(ROOT / "tests"))

from bag_files import (  # the tests' writer of bags
    DEPTH_TOPIC,
    INFO_TOPIC,
    Ros,
    static_messages,
    write_ordered_bag,
)
from stairmap.evaluation.frame_cache import recorded_frames
from stairmap.evaluation.table_format import format_table
from stairmap.evaluation.trials import TrialSpec
from stairmap.frame import DepthFrame
from stairmap.recordings.open import open_recording
from stairmap.transforms import transform_from_parts

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
FRAME_NS = 33_333_333
NUM_DIFFERENT = 30
GOAL_FPS = 100

FORMATS: dict[str, tuple[str, dict[str, str]]] = {
    "ROS 1, 16UC1": ("ros1", {}),
    "ROS 1 lz4, 16UC1": ("ros1_lz4", {}),
    "rosbag2 SQLite, 16UC1": ("sqlite", {}),
    "rosbag2 SQLite, 32FC1": ("sqlite", {"encoding": "32FC1"}),
    "rosbag2 MCAP, 16UC1": ("mcap", {}),
    "rosbag2 MCAP zstd, 16UC1": ("mcap_zstd", {}),
    "MCAP, compressedDepth 16UC1": ("bare_mcap", {"compressed": "16UC1"}),
    "MCAP, compressedDepth 32FC1": ("bare_mcap", {"compressed": "32FC1"}),
}
"""What is read: the writer's name of the format, and how depth is encoded."""


def main() -> None:
    """Measure everything and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--num-frames", type=int, nargs=2, default=[300, 3000], help="lengths of the bags")
    parser.add_argument("--read", type=Path, default=None, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.read is not None:
        print(json.dumps(read_bag(arguments.read)))
        return
    run = BenchmarkRun()
    frames = load_frames()
    rows = [measure(name, frames, arguments.num_frames) for name in FORMATS]
    short, long = arguments.num_frames
    header = (
        "format", "GB", "opening, ms per frame", "frames, ms each", "frames/s, both",
        f"memory at {short:,}, MB", f"at {long:,}, MB",
    )  # fmt: skip
    slowest = min(float(row[4]) for row in rows)
    text = "\n\n".join(
        [
            "## Bags",
            describe_run(run),
            f"640×480, {long:,} frames at 30 Hz with CameraInfo and 90 transforms a second. *Opening* reads "
            "the whole bag once, for stamps and poses; then each frame is read and decoded to metres. Memory "
            "is the most that was ever used, Python and numpy included (imports alone: "
            f"{rows[0][-1]} MB).",
            format_table(header, [row[:-1] for row in rows], num_left=1),
            f"Goal: ≥ {GOAL_FPS} frames/s on one core. Slowest: {slowest:.0f}, "
            f"{'met' if slowest >= GOAL_FPS else 'missed'}.",
        ]
    )
    write_section("bags", text)
    print(text)


def load_frames() -> list[DepthFrame]:
    """Return a drive to a stairway as a Kinect sees it."""
    spec = TrialSpec(
        suite="speed", scene="davis_rear", sensor="kinect_v1", robot="packbot", seed=0, width=640,
        num_frames=NUM_DIFFERENT,
    )  # fmt: skip
    return list(recorded_frames(spec.simulation(), None))


def measure(name: str, frames: list[DepthFrame], lengths: list[int]) -> list[str]:
    """Write and read bags of one format; return a line of the table."""
    kind, options = FORMATS[name]
    found: list[dict[str, Any]] = []
    for length in lengths:
        folder = Path(tempfile.mkdtemp(prefix="stairmap-bags-"))
        try:
            path = write_ordered_bag(folder, kind, Ros(kind), messages(Ros(kind), frames, length, **options))
            size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
            found.append(read_in_process(path) | {"size": size})
        finally:
            shutil.rmtree(folder)
        assert found[-1]["num_frames"] == length
        print(name, found[-1], file=sys.stderr)
    short, long = found
    num = long["num_frames"]
    total = long["opening_s"] + long["reading_s"]
    return [
        name,
        f"{long['size'] * 1e-9:.2f}",
        f"{1e3 * long['opening_s'] / num:.2f}",
        f"{1e3 * long['reading_s'] / num:.2f}",
        f"{num / total:.0f}",
        f"{short['peak_mb']:.0f}",
        f"{long['peak_mb']:.0f}",
        f"{long['start_mb']:.0f}",
    ]


def messages(
    ros: Ros, frames: list[DepthFrame], num_frames: int, *, encoding: str = "16UC1", compressed: str = ""
) -> Iterator[tuple[int, str, Any]]:
    """Give what a robot publishes, in order: its frames over and over, at 30 Hz."""
    yield from static_messages(ros)
    for index in range(num_frames):
        stamp_ns = 1_700_000_000_000_000_000 + index * FRAME_NS
        for step in range(3):
            at_ns = stamp_ns + step * FRAME_NS // 3
            pose = transform_from_parts(np.eye(3), [1e-9 * (at_ns % 10**12), 0.0, 0.0])
            yield at_ns, "/tf", ros.tf(at_ns, ("odom", "base_link", pose))
        frame = frames[index % len(frames)]
        yield at_ns, INFO_TOPIC, ros.camera_info(frame.camera, stamp_ns)
        if compressed:
            image = ros.compressed(frame.depth, stamp_ns, encoding=compressed)
            yield at_ns, f"{DEPTH_TOPIC}/compressedDepth", image
        else:
            yield at_ns, DEPTH_TOPIC, ros.image(frame.depth, stamp_ns, encoding=encoding)


def read_in_process(path: Path) -> dict[str, Any]:
    """Read a bag in a fresh interpreter."""
    command = [sys.executable, __file__, "--read", str(path)]
    done = subprocess.run(command, env=os.environ | ONE_THREAD, capture_output=True, text=True, check=True)
    values: dict[str, Any] = json.loads(done.stdout)
    return values


def read_bag(path: Path) -> dict[str, float]:
    """Open a bag and read all frames; return times of the processor and memory."""
    cv2.setNumThreads(1)
    start_mb = peak_mb()
    start = time.process_time()
    recording = open_recording(path)
    opened = time.process_time()
    num_frames = sum(1 for _ in recording)
    done = time.process_time()
    assert recording.problems.num_frames_without_pose <= 1
    return {
        "num_frames": num_frames,
        "opening_s": opened - start,
        "reading_s": done - opened,
        "start_mb": start_mb,
        "peak_mb": peak_mb(),
    }


def peak_mb() -> float:
    """Return the most memory that this process ever used, MB."""
    # Not getrusage: its maximum is that of the parent if this was larger.
    text = Path("/proc/self/status").read_text(encoding="utf-8")
    return int(text.partition("VmHWM:")[2].split()[0]) / 1024


if __name__ == "__main__":
    main()
