"""Missions of a simulated robot: floors reached, way, area, falls, by strategy and odometry.

    python benchmarks/exploration.py --buildings DIR --results missions.jsonl            # the goals
    python benchmarks/exploration.py --buildings DIR --results missions.jsonl --table    # print what there is

A mission that stands in the file of results already is not run again, so the whole may be run in parts.
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from pathlib import Path

import numpy as np

from stairmap.exploration.body import load_body
from stairmap.exploration.landings import MIN_STOREY
from stairmap.exploration.odometry import Planar
from stairmap.exploration.reachable import ReachableGround, find_reachable_ground
from stairmap.exploration.simulated_exploration import ExplorationOptions, SimulatedExploration
from stairmap.navigation.occupancy import FREE
from stairmap.simulation.scenes import load_world, make_scene
from stairmap.simulation.storeys import STOREY_SCENES

WORLDS = {
    "two_floors": None, "loop_house": None, "two_stairways": None, "tower": None,
    "building:institute_var2": (19.0, 5.0, 0.0, 90.0), "building:office_a": (0.79, -13.74, 0.0, -90.0),
    "building:hospital": (-3.4, 20.0, 0.0, 180.0), "building:duplex_a": (0.92, -5.18, 0.02, 0.0),
    "building:testmodel_ifc4add2": (-3.5, 0.5, 0.0, 0.0),
}  # fmt: skip
"""Start of each world; ``None``: as the command finds it."""


def run_mission(
    world: str, robot: str, options: ExplorationOptions, buildings: Path | None
) -> dict[str, object]:
    """Run one mission and hold it against the ground that the robot could reach."""
    begun = time.process_time()
    mesh = load_world(world, 0, buildings=buildings)
    place = WORLDS[world]
    start = (
        None if place is None else Planar(x=place[0], y=place[1], z=place[2], heading=np.radians(place[3]))
    )
    exploration = SimulatedExploration(mesh, load_body(robot), start, options)
    marks: list[tuple[float, float]] = []
    outcome = exploration.run(
        on_tick=lambda: (
            marks.append((exploration.robot.counters.path_m, exploration.known.area()))
            if len(exploration.known.poses) % 5 == 0
            else None
        )
    )
    cpu = time.process_time() - begun
    if world in STOREY_SCENES:
        scene = STOREY_SCENES[world](world, np.random.default_rng([0, 1]))
    else:
        scene = make_scene(world, 0, buildings=buildings)
    flights = [f for s in (*scene.stairways, *scene.optional_stairways) for f in s.flights]
    truth = find_reachable_ground(exploration.robot.world, exploration.robot.body, exploration.start, flights)
    used = [
        max(abs(float(flights[n].base[2])), 0) for n in range(len(flights)) if n not in truth.flights
    ]  # heights of flights that must not be climbed
    return {
        "world": world, "robot": robot, "strategy": options.strategy, "seed": options.seed,
        "perfect": options.has_perfect_odometry,
        **{key: value for key, value in outcome.to_dict().items() if key != "coverage"},
        "true_floors": len(true_floors(truth)), "reachable_m2": truth.area_m2,
        "mapped_share": mapped_share(exploration, truth.places) if options.has_perfect_odometry else None,
        "way_to_95": way_to(marks, 0.95 * outcome.area_m2), "cpu_s": cpu,
        "decision_ms": [float(np.percentile([d.duration_s for d in exploration.log.decisions], q)) * 1e3
                        for q in (50, 95)],
        "height_errors": height_errors(outcome.floors, truth.heights(1.0)), "num_forbidden": len(used),
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
    }  # fmt: skip


def true_floors(truth: ReachableGround) -> list[float]:
    """Return the heights of the levels that are no landings, m: small ones between two flights."""
    heights, large = truth.heights(2.0), truth.heights(6.0)
    return [
        z for index, z in enumerate(heights)
        if z in large or index in (0, len(heights) - 1)
        or max(z - heights[index - 1], heights[index + 1] - z) >= MIN_STOREY
    ]  # fmt: skip


def mapped_share(exploration: SimulatedExploration, places: np.ndarray) -> float:
    """Return which share of reachable places is free ground in the map."""
    is_mapped = np.zeros(len(places), dtype=bool)
    for level in exploration.known.levels.levels:
        near = np.abs(places[:, 2] - level.height) < 0.3
        grid = level.map.grid()
        index, inside = grid.cells_at(places)
        index = np.clip(index, 0, np.array(grid.cells.shape) - 1)
        is_mapped |= near & inside & (grid.cells[index[:, 0], index[:, 1]] == FREE)
    return float(is_mapped.mean()) if len(places) else 1.0


def way_to(marks: list[tuple[float, float]], area: float) -> float:
    """Return the way after which so much ground was mapped, m."""
    return next((way for way, mapped in marks if mapped >= area), float("nan"))


def height_errors(levels: tuple[dict[str, object], ...], truth: list[float]) -> list[float]:
    """Return how far each level lies from the nearest true one, m."""
    return [round(min(abs(float(level["height"]) - z) for z in truth), 4) for level in levels if truth]


def print_table(path: Path) -> None:
    """Print a line for each mission and the mean way by strategy."""
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    names = ("world", "robot", "strategy", "odometry", "seed", "floors", "area m² (reachable)", "mapped")
    names += ("way m (to 95 %)", "falls", "collisions", "CPU s", "decision ms")
    print(f"| {' | '.join(names)} |\n{'|---' * len(names)}|")
    for row in rows:
        odometry = "perfect" if row["perfect"] else "drifts"
        share = "" if row["mapped_share"] is None else f"{100 * row['mapped_share']:.0f} %"
        print(
            f"| {row['world']} | {row['robot']} | {row['strategy']} | {odometry} | {row['seed']} "
            f"| {row['floors_reached']} of {row['true_floors']} "
            f"| {row['area_m2']:.0f} ({row['reachable_m2']:.0f}) | {share} "
            f"| {row['path_m']:.0f} ({row['way_to_95']:.0f}) | {row['falls']} | {row['collisions']} "
            f"| {row['cpu_s']:.0f} | {row['decision_ms'][0]:.0f}, {row['decision_ms'][1]:.0f} |"
        )


def main() -> None:
    """Run the missions that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--buildings", type=Path)
    parser.add_argument("--results", type=Path, required=True)
    parser.add_argument("--worlds", nargs="*", default=list(WORLDS))
    parser.add_argument("--robots", nargs="*", default=["spot", "go2"])
    parser.add_argument("--seeds", nargs="*", type=int, default=[0, 1, 2])
    parser.add_argument("--strategies", nargs="*", default=["gain"])
    parser.add_argument("--odometry", nargs="*", default=["perfect", "drifts"])
    parser.add_argument("--table", action="store_true")
    given = parser.parse_args()
    if given.table:
        print_table(given.results)
        return
    done = set()
    if given.results.exists():
        for line in given.results.read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            done.add((row["world"], row["robot"], row["strategy"], row["seed"], row["perfect"]))
    for seed in given.seeds:
        for world in given.worlds:
            for robot in given.robots:
                for strategy in given.strategies:
                    for odometry in given.odometry:
                        perfect = odometry == "perfect"
                        if (world, robot, strategy, seed, perfect) in done:
                            continue
                        options = ExplorationOptions(
                            strategy=strategy, seed=seed, has_perfect_odometry=perfect
                        )
                        row = run_mission(world, robot, options, given.buildings)
                        with given.results.open("a", encoding="utf-8") as file:
                            file.write(json.dumps(row) + "\n")
                        print(
                            world,
                            robot,
                            strategy,
                            odometry,
                            seed,
                            row["floors_reached"],
                            "of",
                            row["true_floors"],
                            "falls",
                            row["falls"],
                            "collisions",
                            row["collisions"],
                            f"{row['cpu_s']:.0f} s",
                            row["stopped"],
                            flush=True,
                        )


if __name__ == "__main__":
    main()
