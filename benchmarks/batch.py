"""What a batch costs: two workers against one, the driver's own work and memory, workers that are killed.

python benchmarks/batch.py --folder FOLDER --prepare  simulate the drives and stop; they stay in FOLDER
python benchmarks/batch.py --folder FOLDER            all of it; two free cores, ten to twelve minutes
python benchmarks/batch.py --folder FOLDER --small    a tenth of it, to see whether it runs
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from document import ROOT, BenchmarkRun, describe_run, write_section

sys.path.insert(0, str(ROOT / "tests" / "batch"))

import stand_in_looks

from stairmap.batch.table_files import read_table
from stairmap.batch.task_process import resident_memory
from stairmap.evaluation.table_format import format_table

SCENES = ("free_standing", "davis_rear", "bookshelf", "overhang")
NUM_DRIVES = 20
"""Drives that are simulated; the others are the same under other names."""

NUM_FRAMES = 100
"""Frames of a drive: ten seconds, as short as recordings of robots get."""

NUM_RECORDINGS, NUM_NAPS = 200, 5_000
MEMORY_GOAL_MB, DRIVER_GOAL, SCALING_GOAL = 300, 0.02, 1.8
KILL_PERIOD_S = 10.0
PARTS = ("scaling", "memory", "killing")
PROCESSOR_TICKS = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """One batch: seconds, those of the driver's processor, those of its tasks, the driver's memory, MB."""

    seconds: float
    driver_cpu_s: float
    task_cpu_s: float
    early_mb: float
    peak_mb: float
    num_failed: int


def main() -> None:
    """Measure, print, and write the section of BENCHMARKS.md unless the batch is a small one."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--folder", type=Path, required=True, help="where recordings and results go")
    parser.add_argument("--small", action="store_true", help="a tenth, and BENCHMARKS.md stays")
    parser.add_argument("--write", action="store_true", help="write BENCHMARKS.md also after a small one")
    parser.add_argument("--prepare", action="store_true", help="simulate the drives, and no more")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="which of it")
    arguments = parser.parse_args()
    run = BenchmarkRun()
    share = 10 if arguments.small else 1
    drives = make_drives(arguments.folder / f"drives_of_{NUM_FRAMES}")
    if arguments.prepare:
        return
    recordings = make_recordings(arguments.folder / "recordings", drives, NUM_RECORDINGS // share)
    naps = make_naps(arguments.folder / "naps", NUM_NAPS // share)
    results = arguments.folder / "results"
    shutil.rmtree(results, ignore_errors=True)
    parts = []
    for name, measure_part in (
        ("scaling", lambda: measure_scaling(recordings, results)),
        ("memory", lambda: measure_memory(naps, results)),
        ("killing", lambda: measure_killing(recordings, results)),
    ):
        if name in arguments.parts:
            parts.append(measure_part())
            sys.stdout.write(f"{parts[-1]}\n\n")
            sys.stdout.flush()
    if arguments.write or (not arguments.small and set(arguments.parts) == set(PARTS)):
        write_section("batch", "\n\n".join(["## Batches", describe_run(run), *parts]))


def make_drives(folder: Path) -> list[Path]:
    """Simulate drives at 320x240, those that are not there yet."""
    drives = [folder / f"drive{index:02d}" for index in range(NUM_DRIVES)]
    for index, drive in enumerate(drives):
        if not (drive / "truth.json").exists():
            shutil.rmtree(drive, ignore_errors=True)
            command = ["simulate", SCENES[index % len(SCENES)], "-o", str(drive), "--seed", str(index)]
            command += ["--factor", "0.5", "--frames", str(NUM_FRAMES)]
            subprocess.run([sys.executable, "-m", "stairmap", *command], check=True, capture_output=True)
    return drives


def make_recordings(folder: Path, drives: Sequence[Path], number: int) -> Path:
    """Name the drives as often as there are to be recordings."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for index in range(number):
        (folder / f"r{index:03d}").symlink_to(drives[index % len(drives)])
    return folder


def make_naps(folder: Path, number: int) -> Path:
    """Make files that the stand-in of a worker naps over for 50 ms each."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for index in range(number):
        (folder / f"sleeper{index:05d}.bag").touch()
    return folder


def measure_scaling(recordings: Path, results: Path) -> str:
    """Return the table of one worker against two."""
    rows, by_workers = [], {}
    for num_workers in (1, 2):
        measured = measure(recordings, results / f"workers{num_workers}", num_workers)
        by_workers[num_workers] = measured
        rows.append(
            [
                str(num_workers),
                f"{measured.seconds:.1f}",
                f"{measured.task_cpu_s:.1f}",
                f"{measured.driver_cpu_s:.2f}",
                f"{100 * driver_share(measured):.2f} %",
            ]
        )
    ratio = by_workers[1].seconds / by_workers[2].seconds
    worst = max(driver_share(measured) for measured in by_workers.values())
    same = read_table(results / "workers1") == read_table(results / "workers2")
    number = len(list(recordings.iterdir()))
    header = ("workers", "wall clock, s", "tasks' processor, s", "driver's processor, s", "driver's share")
    return "\n\n".join(
        [
            f"{number} simulated recordings of {NUM_FRAMES} frames. The driver is the process that was "
            "called, dask's scheduler in it; its start and its tables count.",
            format_table(header, rows, num_left=0),
            f"Two workers: {ratio:.2f} times one (goal {SCALING_GOAL}): {verdict(ratio >= SCALING_GOAL)}. "
            f"Driver at most {100 * worst:.2f} % of the tasks (goal {100 * DRIVER_GOAL:.0f} %): "
            f"{verdict(worst <= DRIVER_GOAL)}. Rows equal: {verdict(same)}.",
        ]
    )


def measure_memory(naps: Path, results: Path) -> str:
    """Return how the driver's memory grows over tasks of 50 ms."""
    measured = measure(naps, results / "naps", 2)
    number = len(list(naps.iterdir()))
    own = 1e3 * measured.driver_cpu_s / number
    return (
        f"{number:,} stand-in tasks of 50 ms on two workers: {measured.seconds:.0f} s; driver {own:.1f} ms "
        f"of processor time each; memory {measured.early_mb:.0f} MB at a tenth, {measured.peak_mb:.0f} MB at "
        f"most (goal {MEMORY_GOAL_MB}): {verdict(measured.peak_mb <= MEMORY_GOAL_MB)}."
    )


def measure_killing(recordings: Path, results: Path) -> str:
    """Return what is lost while a worker is killed every ten seconds."""
    measured, num_killed = measure_killed(recordings, results / "killed")
    if not (results / "workers1").exists():
        measure(recordings, results / "workers1", 1)
    rows, expected = read_table(results / "killed"), read_table(results / "workers1")
    runs = list((results / "killed").glob("*/task.json"))
    is_whole = rows == expected and len(runs) == len(list(recordings.iterdir())) and not measured.num_failed
    return (
        f"A worker killed every {KILL_PERIOD_S:.0f} s, {num_killed} in all, {measured.seconds:.0f} s: "
        f"{len(runs)} run folders, rows equal to those of an undisturbed batch: {verdict(is_whole)}."
    )


def measure(inputs: Path, output: Path, num_workers: int) -> Measured:
    """Run one batch and watch its driver."""
    process, started = start(inputs, output, num_workers)
    return watch(process, started, output, total=len(list(inputs.iterdir())))


def measure_killed(inputs: Path, output: Path) -> tuple[Measured, int]:
    """Run one batch on two workers and kill one of them now and then."""
    process, started = start(inputs, output, 2)
    killed: list[int] = []

    def kill_sometimes() -> None:
        if time.monotonic() - started > KILL_PERIOD_S * (len(killed) + 1):
            workers = worker_processes(process.pid)
            if workers:
                os.kill(workers[len(killed) % len(workers)], signal.SIGKILL)
                killed.append(1)

    measured = watch(process, started, output, total=len(list(inputs.iterdir())), meanwhile=kill_sometimes)
    return measured, len(killed)


def start(inputs: Path, output: Path, num_workers: int) -> tuple[subprocess.Popen[str], float]:
    """Start a batch."""
    command = ["batch", str(inputs), "-o", str(output), "--workers", str(num_workers), "--json"]
    process = subprocess.Popen(
        [sys.executable, "-m", "stairmap", *command],
        env=stand_in_looks.prepare(output.parent / "site"),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    return process, time.monotonic()


def watch(process, started, output, *, total, meanwhile=lambda: None) -> Measured:  # type: ignore[no-untyped-def]
    """Wait for the end of a batch; sample memory and processor time of its driver until then."""
    early, peak, cpu = 0.0, 0.0, 0.0
    while process.poll() is None:
        meanwhile()
        memory = resident_memory(process.pid) / 2**20
        peak = max(peak, memory)
        cpu = max(cpu, processor_time(process.pid))
        journal = output / "batch.jsonl"
        if not early and journal.exists() and journal.read_bytes().count(b"stairways") >= total / 10:
            early = memory
        time.sleep(0.1)
    seconds = time.monotonic() - started
    if process.returncode:
        raise SystemExit(f"the batch into {output} ended with exit code {process.returncode}")
    values = json.loads(process.stdout.read())
    return Measured(
        seconds=seconds,
        driver_cpu_s=cpu,
        task_cpu_s=values["task_cpu_s"],
        early_mb=early,
        peak_mb=peak,
        num_failed=values["num_failed"],
    )


def driver_share(measured: Measured) -> float:
    """Return the driver's processor time against that of the tasks."""
    return measured.driver_cpu_s / measured.task_cpu_s


def processor_time(process_id: int) -> float:
    """Return the processor time of a process without its children, s."""
    try:
        fields = Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / PROCESSOR_TICKS


def worker_processes(driver: int) -> list[int]:
    """Return the processes of a driver that are dask workers: those that have a process of their own."""
    children = Path(f"/proc/{driver}/task")
    found = []
    for thread in children.iterdir():
        for child in (thread / "children").read_text().split():
            if any(
                "task_main" in Path(f"/proc/{grandchild}/cmdline").read_text()
                for task in Path(f"/proc/{child}/task").iterdir()
                for grandchild in (task / "children").read_text().split()
                if Path(f"/proc/{grandchild}/cmdline").exists()
            ):
                found.append(int(child))
    return found


def verdict(is_met: bool) -> str:
    """Return whether a goal is met."""
    return "met" if is_met else "**not met**"


if __name__ == "__main__":
    main()
