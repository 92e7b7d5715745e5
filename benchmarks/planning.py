"""Measure what planning over floors costs. Writes the section "planning" of BENCHMARKS.md.

Four floors of 10,000 cells each are joined by three stairways; walls leave doors at alternating ends, so
that routes are long. All times are processor times of one thread.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Callable
from functools import partial

import numpy as np
from document import BenchmarkRun, describe_run, write_section
from samples import timed

from stairmap.evaluation.table_format import format_table
from stairmap.navigation.exploration import find_candidates
from stairmap.navigation.floors import find_floors
from stairmap.navigation.occupancy import FREE, OCCUPIED, OccupancyGrid
from stairmap.navigation.planner import FloorPlanner
from stairmap.navigation.portals import Portal, make_portals
from stairmap.navigation.robot_profile import RobotProfile, load_robot
from stairmap.stairway import Flight, FlightStd, Stairway

NUM_FLOORS = 4
SIDE = 100
RESOLUTION = 0.2
STOREY = 3.0
NUM_RUNS = 50
GOAL_MS = 50.0


def main() -> None:
    """Measure and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--num-runs", type=int, default=NUM_RUNS)
    arguments = parser.parse_args()
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    run = BenchmarkRun()
    robot = load_robot("spot")
    portals = make_tower(robot)
    grids = {"empty": make_grids(with_walls=False), "walls": make_grids(with_walls=True)}
    rows = []
    for name, floors in grids.items():
        planner = FloorPlanner(floors, portals, robot)
        route = planner.find_route(0, (1.0, 1.0), NUM_FLOORS - 1, (18.5, 18.5))
        if not route:
            raise SystemExit(f"no route: {route.reason}")
        length = sum(float(np.linalg.norm(np.diff(leg.points, axis=0), axis=1).sum()) for leg in route.legs)
        works: dict[str, Callable[[], object]] = {
            "build the graph": partial(FloorPlanner, floors, portals, robot),
            f"route over {NUM_FLOORS} floors, {length:.0f} m": partial(
                planner.find_route, 0, (1.0, 1.0), NUM_FLOORS - 1, (18.5, 18.5)
            ),
            "places to explore": partial(find_candidates, planner, 0, (1.0, 1.0)),
        }
        rows += [[name, what, *measure(work, arguments.num_runs)] for what, work in works.items()]
        routes = [row for row in rows if row[1].startswith("route")]
    worst = max(float(row[-1]) for row in routes)
    verdict = "met" if worst <= GOAL_MS else "**not met**"
    header = ("floors", "work", f"median of {arguments.num_runs}, ms", "slowest, ms")
    text = [
        "## Planning over floors",
        describe_run(run),
        f"{NUM_FLOORS} floors of {SIDE * SIDE:,} cells each, three stairways; four `walls`, a door in each.",
        format_table(header, rows, num_left=2),
        f"Goal: a route in ≤ {GOAL_MS:.0f} ms. Slowest: {worst:.1f} ms: {verdict}.",
    ]
    write_section("planning", "\n\n".join(text))
    sys.stdout.write("\n\n".join(text) + "\n")


def measure(work: Callable[[], object], num_runs: int) -> tuple[str, str]:
    """Return median and largest time, ms, after one run that does not count."""
    work()
    times = [1e3 * timed(work)[1] for _ in range(num_runs)]
    return f"{np.median(times):.1f}", f"{max(times):.1f}"


def make_tower(robot: RobotProfile) -> tuple[Portal, ...]:
    """Return the portals of stairways that turn at each floor."""
    std = FlightStd(rise=0.002, run=0.003, width=0.02, pitch=0.01, heading=0.01, base=np.full(3, 0.01))
    stairways = []
    for level in range(NUM_FLOORS - 1):
        is_turned = bool(level % 2)
        flight = Flight(
            base=np.array([14.0 if is_turned else 4.0, 2.0 + 5.5 * level, STOREY * level]),
            heading=math.pi if is_turned else 0.0,
            rise=STOREY / 18, run=0.29, width=1.2, num_risers=18, std=std,
        )  # fmt: skip
        stairways.append(
            Stairway(id=level + 1, flights=(flight,), num_observations=9, first_seen_ns=0, last_seen_ns=1)
        )
    return make_portals(stairways, find_floors(stairways), robot)


def make_grids(*, with_walls: bool) -> dict[int, OccupancyGrid]:
    """Return the floors: all cells free, or with walls across that leave a door at one end."""
    cells = np.full((SIDE, SIDE), FREE, dtype=np.int8)
    if with_walls:
        for number, row in enumerate((25, 45, 65, 85)):
            cells[row, :] = OCCUPIED
            cells[row, slice(0, 6) if number % 2 else slice(SIDE - 6, SIDE)] = FREE
    grid = OccupancyGrid(cells=cells, resolution=RESOLUTION, origin=(0.0, 0.0))
    return dict.fromkeys(range(NUM_FLOORS), grid)


if __name__ == "__main__":
    main()
