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
from typing import Any

import cv2
import numpy as np

from stairmap.exploration.body import load_body
from stairmap.exploration.landings import MIN_STOREY
from stairmap.exploration.layer_map import RESOLUTION
from stairmap.exploration.levels import SAME_LEVEL
from stairmap.exploration.odometry import Planar
from stairmap.exploration.reachable import ReachableGround, find_reachable_ground, is_climbable
from stairmap.exploration.simulated_exploration import ExplorationOptions, SimulatedExploration
from stairmap.navigation.occupancy import FREE
from stairmap.simulation.scenes import load_world, make_scene
from stairmap.simulation.storeys import STOREY_SCENES
from stairmap.stairway import Flight

WORLDS = {
    "two_floors": None, "loop_house": None, "two_stairways": None, "tower": None,
    "building:institute_var2": (19.0, 5.0, 0.0, 90.0), "building:office_a": (0.79, -13.74, 0.0, -90.0),
    "building:hospital": (-3.4, 20.0, 0.0, 180.0), "building:duplex_a": (0.92, -5.18, 0.02, 0.0),
    "building:testmodel_ifc4add2": (-3.5, 0.5, 0.0, 0.0),
}  # fmt: skip
"""Start of each world; ``None``: as the command finds it."""

DRIFT = 0.3
"""With odometry error, mapped ground may lie so far from the true, m: the map has drifted."""


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
    errors: list[float] = [0.0]
    outcome = exploration.run(on_tick=lambda: watch(exploration, marks, errors))
    cpu = time.process_time() - begun
    if world in STOREY_SCENES:
        scene = STOREY_SCENES[world](world, np.random.default_rng([0, 1]))
    else:
        scene = make_scene(world, 0, buildings=buildings)
    flights = [f for s in (*scene.stairways, *scene.optional_stairways) for f in s.flights]
    truth = find_reachable_ground(exploration.robot.world, exploration.robot.body, exploration.start, flights)
    return {
        "world": world, "robot": robot, "strategy": options.strategy, "seed": options.seed,
        "perfect": options.has_perfect_odometry,
        **{key: value for key, value in outcome.to_dict().items() if key != "coverage"},
        "true_floors": len(true_floors(truth)), "floors_found": floors_found(outcome.floors, truth),
        "reachable_m2": truth.area_m2,
        "mapped_share": mapped_share(exploration, truth.places),
        "pose_error_m": [float(np.median(errors)), max(errors)],
        "way_to_95": way_to(marks, 0.95 * outcome.area_m2), "cpu_s": cpu,
        "decision_ms": [float(np.percentile([d.duration_s for d in exploration.log.decisions], q)) * 1e3
                        for q in (50, 95)],
        "height_errors": height_errors(outcome.floors, truth.heights(1.0)),
        "forbidden_climbs": forbidden_climbs(exploration, flights),
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
    }  # fmt: skip


def watch(exploration: SimulatedExploration, marks: list[tuple[float, float]], errors: list[float]) -> None:
    """Note way (m) and area (m²), and how far the robot is from where it believes to be, m, all 5 frames."""
    known, robot = exploration.known, exploration.robot
    if len(known.poses) % 5 == 0:
        marks.append((robot.counters.path_m, known.area()))
        believed = known.believed(robot.odometry.pose)
        errors.append(float(np.linalg.norm((believed.place - robot.pose.place)[:2])))


def true_floors(truth: ReachableGround) -> list[float]:
    """Return the heights of the levels that are no landings, m: small ones between two flights."""
    heights, large = truth.heights(2.0), truth.heights(6.0)
    return [
        z for index, z in enumerate(heights)
        if z in large or index in (0, len(heights) - 1)
        or max(z - heights[index - 1], heights[index + 1] - z) >= MIN_STOREY
    ]  # fmt: skip


def floors_found(levels: tuple[dict[str, Any], ...], truth: ReachableGround) -> int:
    """Return on how many of the floors that the robot could reach it stood."""
    return sum(
        any(abs(level["height"] - z) < SAME_LEVEL for level in levels) for z in true_floors(truth)
    )  # fmt: skip


def forbidden_climbs(exploration: SimulatedExploration, flights: list[Flight]) -> int:
    """Return how many stairs were climbed whose true measures are above a limit of the robot."""
    profile = exploration.robot.body.profile
    climbed = [link.flight for link in exploration.known.stairs.links if link.state == "climbed"]
    bases = np.array([flight.base for flight in flights]).reshape(-1, 3)
    nearest = [flights[int(np.linalg.norm(bases - f.base, axis=1).argmin())] for f in climbed]
    return sum(not is_climbable(flight, profile) for flight in nearest)


def mapped_share(exploration: SimulatedExploration, places: np.ndarray) -> float:
    """Return which share of reachable places is free ground in the map, at most ``DRIFT`` off."""
    reach = 0 if exploration.options.has_perfect_odometry else round(DRIFT / RESOLUTION)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    is_mapped = np.zeros(len(places), dtype=bool)
    for level in exploration.known.levels.levels:
        near = np.abs(places[:, 2] - level.height) < 0.3
        grid = level.map.grid()
        index, inside = grid.cells_at(places)
        index = np.clip(index, 0, np.array(grid.cells.shape) - 1)
        is_free = cv2.dilate((grid.cells == FREE).astype(np.uint8), disc) > 0
        is_mapped |= near & inside & is_free[index[:, 0], index[:, 1]]
    return float(is_mapped.mean()) if len(places) else 1.0


def way_to(marks: list[tuple[float, float]], area: float) -> float:
    """Return the way after which so much ground was mapped, m."""
    return next((way for way, mapped in marks if mapped >= area), float("nan"))


def height_errors(levels: tuple[dict[str, Any], ...], truth: list[float]) -> list[float]:
    """Return how far each level lies from the nearest true one, m."""
    return [round(min(abs(float(level["height"]) - z) for z in truth), 4) for level in levels if truth]


def print_table(path: Path) -> None:
    """Print a line for each mission and the mean way by strategy."""
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    names: tuple[str, ...] = (
        "world",
        "robot",
        "strategy",
        "odometry",
        "seed",
        "floors",
        "area m² (reachable)",
        "mapped",
    )
    names += (
        "way m (to 95 %)",
        "falls, collisions, forbidden climbs",
        "pose error m",
        "CPU s",
        "decision ms",
    )
    print(f"| {' | '.join(names)} |\n{'|---' * len(names)}|")
    for row in rows:
        odometry = "perfect" if row["perfect"] else "drifts"
        share = f"{100 * row['mapped_share']:.0f} %"
        print(
            f"| {row['world']} | {row['robot']} | {row['strategy']} | {odometry} | {row['seed']} "
            f"| {row['floors_found']} of {row['true_floors']} "
            f"| {row['area_m2']:.0f} ({row['reachable_m2']:.0f}) | {share} "
            f"| {row['path_m']:.0f} ({row['way_to_95']:.0f}) "
            f"| {row['falls']}, {row['collisions']}, {row['forbidden_climbs']} "
            f"| {row['pose_error_m'][0]:.2f}, {row['pose_error_m'][1]:.2f} "
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
                            row["floors_found"],
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
