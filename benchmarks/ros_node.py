"""Measure the ROS 2 node: delay from image stamp to marker, images per second, memory, on one core.

Writes the section "ros" of BENCHMARKS.md. Needs the environment that ``make test`` makes (``.venv-ros``).
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
import threading
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from document import ROOT, BenchmarkRun, describe_run, write_section

from stairmap.evaluation.table_format import format_table
from stairmap.evaluation.trials import TrialSpec

ENVIRONMENT = ROOT / ".venv-ros"
CAMERA = ROOT / "benchmarks/ros_camera.py"
PROFILE = ROOT / "ros/stairmap_ros/config/fastdds_large_images.xml"
WARM_UP = 5.0
"""Seconds before the measurement: discovery, first images, memory of the libraries."""

RATE = 30.0


def main() -> None:
    """Measure and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=300.0, help="length of the measurement")
    parser.add_argument("--core", type=int, default=0, help="processor core of the node")
    parser.add_argument("--other-core", type=int, default=1, help="core of the camera and the listener")
    arguments = parser.parse_args()
    run = BenchmarkRun()
    with tempfile.TemporaryDirectory() as folder:
        drive = render_drive(Path(folder) / "drive.npz")
        text = measure(Path(folder), drive, arguments)
    section = "\n\n".join(["## ROS 2 node", describe_run(run), describe_versions(), text])
    write_section("ros", section)
    print(section)


def render_drive(file: Path) -> Path:
    """Render an approach to a flight of stairs, 640x480 Kinect v1, 60 frames with true poses."""
    spec = TrialSpec(
        suite="ros", scene="free_standing", sensor="kinect_v1", robot="spot", seed=1, num_frames=60
    )
    simulation = spec.simulation()
    depth = [np.nan_to_num(frame.frame.depth * 1000.0) for frame in simulation.frames()]
    camera = simulation.sensor.camera
    np.savez(
        file,
        depth=np.rint(depth).astype(np.uint16),
        map_from_camera=simulation.true_poses,
        intrinsics=[camera.fx, camera.fy, camera.cx, camera.cy],
    )
    return file


def measure(folder: Path, drive: Path, arguments: argparse.Namespace) -> str:
    """Run node, camera and listener, and return the tables."""
    variables = os.environ | {
        "ROS_DOMAIN_ID": str(os.getpid() % 100 + 1),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(PROFILE),
        "FASTDDS_DEFAULT_PROFILES_FILE": str(PROFILE),
    }
    variables.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
    python, total = str(ENVIRONMENT / "bin/python"), arguments.seconds + WARM_UP
    on_node_core = ["taskset", "-c", str(arguments.core)]
    on_other_core = ["taskset", "-c", str(arguments.other_core), python, str(CAMERA)]
    node = subprocess.Popen([*on_node_core, str(ENVIRONMENT / "bin/stairmap_node")], env=variables)
    try:
        out = folder / "answers.npz"
        time.sleep(3.0)
        listener = subprocess.Popen([*on_other_core, "listen", str(out), str(total + 3.0)], env=variables)
        time.sleep(2.0)
        memory: list[tuple[float, float, float]] = []
        stop = threading.Event()
        sampler = threading.Thread(target=sample_memory, args=(node.pid, memory, stop))
        camera = subprocess.Popen([*on_other_core, "publish", str(drive), str(total)], env=variables)
        started_ns = time.time_ns()
        sampler.start()
        busy = processor_seconds(node.pid)
        camera.wait()
        share = (processor_seconds(node.pid) - busy) / total
        stop.set()
        sampler.join()
        listener.wait()
    finally:
        node.terminate()
        node.wait(timeout=20)
    with np.load(out) as arrays:
        answers = arrays["answers"]
    seconds = (answers[:, 1] - started_ns) * 1e-9 - WARM_UP
    delay_ms = (answers[:, 0] - answers[:, 1]) * 1e-6
    measured = (seconds >= 0) & (seconds < arguments.seconds)
    return describe(seconds[measured], delay_ms[measured], np.array(memory), share, arguments.seconds)


def describe(
    seconds: np.ndarray, delay_ms: np.ndarray, memory: np.ndarray, share: float, total: float
) -> str:
    """Return the tables: the whole measurement, and its parts in turn."""
    rows = []
    edges = np.linspace(0.0, total, 6)
    parts = [(0.0, total), *pairwise(edges)]
    for start, end in parts:
        inside = (seconds >= start) & (seconds < end)
        of_time = (memory[:, 0] - WARM_UP >= start) & (memory[:, 0] - WARM_UP < end)
        delays = delay_ms[inside] if inside.any() else np.array([np.nan])
        rows.append(
            [
                "all" if (start, end) == parts[0] else f"{start:.0f}-{end:.0f}",
                f"{np.count_nonzero(inside) / (end - start):.1f}",
                f"{np.median(delays):.1f}",
                f"{np.percentile(delays, 95):.1f}",
                f"{delays.max():.0f}",
                f"{memory[of_time, 1].mean():.1f}",
                f"{memory[of_time, 2].mean():.1f}",
            ]
        )
    header = (
        "seconds",
        "images answered per s",
        "delay ms",
        "95 %",
        "longest",
        "own memory, MB",
        "with libraries and shared, MB",
    )
    note = (
        "The node on one processor core, a camera that publishes depth of 640×480 (16UC1, best effort), "
        f"camera_info and TF at {RATE:.0f} Hz and a listener on another; the robot comes up to a stairway "
        "and goes back again and again. Delay: from the stamp of an image, taken right before it is "
        "published, to the arrival of its markers at the listener; median. "
        f"The node uses {100 * share:.0f} % of its core. "
        "Other work on the machine at the end: "
        f"{os.getloadavg()[1]:.0f} processes on {os.cpu_count()} cores{describe_priority()}."
    )
    return note + "\n\n" + format_table(header, rows)


def describe_priority() -> str:
    """Say whether all this ran before other work: Linux weighs whole sessions against each other."""
    file = Path("/proc/self/autogroup")
    nice = int(file.read_text(encoding="utf-8").split()[-1]) if file.exists() else 0
    return f", which had to stand back (priority of this session: nice {nice})" if nice < 0 else ""


def describe_versions() -> str:
    """Return what the node itself runs on."""
    code = (
        "import platform, cv2, numpy; from importlib.metadata import version;"
        'print(f\'The node: ROS 2 Jazzy (rclpy {version("ros-jazzy-rclpy")}, Fast DDS), '
        "Python {platform.python_version()}, numpy {numpy.__version__}, OpenCV {cv2.__version__}.')"
    )
    command = [str(ENVIRONMENT / "bin/python"), "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def sample_memory(pid: int, memory: list[tuple[float, float, float]], stop: threading.Event) -> None:
    """Note a process's memory once per second: time, its own, and with what it shares, MB."""
    start = time.monotonic()
    while not stop.wait(1.0):
        lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
        sizes = {line.split()[0]: int(line.split()[1]) / 1024 for line in lines if line.endswith(" kB")}
        memory.append((time.monotonic() - start, sizes["RssAnon:"], sizes["VmRSS:"]))


def processor_seconds(pid: int) -> float:
    """Return the processor time that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
