"""Enter our own two methods into ``stairmap benchmark`` and write the section "detectors" of BENCHMARKS.md.

python benchmarks/detectors.py            two minutes on two free cores

The same seed gives the same tasks; only the column ``ms`` depends on the machine and on what else it does.
"""

from __future__ import annotations

import argparse
import sys

from document import BenchmarkRun, describe_run, write_section

from stairmap.benchmark.running import BenchmarkSettings, format_scores, own_programs, run_benchmark

NUM_FRAMES, NUM_DRIVES, NUM_CLOUDS = 60, 6, 6
"""As many tasks of each kind as ``stairmap benchmark`` has by default."""

TIMEOUT = 120.0
"""Time for an answer, s."""


def main() -> None:
    """Score both methods, print the table, and write the section."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the tasks")
    arguments = parser.parse_args()
    run = BenchmarkRun()
    settings = BenchmarkSettings(
        numbers={"frame": NUM_FRAMES, "drive": NUM_DRIVES, "cloud": NUM_CLOUDS},
        seed=arguments.seed,
        timeout=TIMEOUT,
    )
    table = format_scores(run_benchmark(own_programs(timeout=TIMEOUT), settings))
    sys.stdout.write(f"{table}\n")
    text = (
        f"Our own two methods in [the benchmark for any detector](docs/benchmark.md), seed {arguments.seed}: "
        "errors are mean absolute ones of the flights found, `right` is within 10 mm of the rise and 15 mm "
        "of the run. `ms` depends on what else the machine does."
    )
    write_section("detectors", "\n\n".join(["## Detectors side by side", describe_run(run), text, table]))


if __name__ == "__main__":
    main()
