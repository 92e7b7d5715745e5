"""Drive robots to edges of the ground and write the section "edges" of BENCHMARKS.md.

Each drive comes up to an edge at 0.5 m/s, 10 frames a second, with the errors of odometry, and stops 0.45 m
before it: stairs that lead down, docks, wells, and voids behind which no sensor measures anything. Others
drive over grounds that do not end. All is drawn from seeds: the same commit gives the same table.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from document import BenchmarkRun, describe_run, write_section

from stairmap.arrays import Points, Transform
from stairmap.drop import Drop
from stairmap.evaluation.table_format import format_table
from stairmap.navigation.floors import FloorError, find_floors
from stairmap.navigation.keepout import ForbiddenGround, make_keepout_mask
from stairmap.session import MapSession
from stairmap.simulation.edge_scenes import EdgeKind, EdgeScene, make_edge_scene
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.simulate import Simulation
from stairmap.transforms import invert_transform, transform_points

KINDS: tuple[EdgeKind, ...] = ("stairs", "dock", "well", "void")
GROUNDS: tuple[EdgeKind, ...] = ("ramp", "kerb", "hall")
NUM_DRIVES, NUM_NEGATIVES = 10, 6
"""Drives of each kind with an edge, and of each without one."""

SENSORS = ("kinect_v1", "d435", "kinect_v2", "phone_lidar")
SPEED = 0.5
"""Speed of every robot, m/s."""

STOPPING_DISTANCE = 0.5
"""An edge must be known before the camera is nearer to it, m."""

MAX_OFF = 0.15
"""A drop is at an edge within this, m: of drift and noise together."""

FORBIDDEN = 0.25
"""So far before an edge no mask may be free, m."""

PATH_HALF = 0.25
"""Half the width of the robot's path on which masks are judged, m."""

MAX_FLOOR_ERROR = 0.030
"""Largest error of the height of a floor where the robot stood, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeDrive:
    """What came of one drive; distances in m, NaN where nothing was known or asked for."""

    kind: EdgeKind
    robot: str
    sensor: str
    known_at: float
    num_invented: int
    num_free: int
    floor_error: float


def main() -> None:
    """Drive to all edges; write the section, or only print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="three drives of each kind, for a first look")
    parser.add_argument("--print", action="store_true", dest="is_dry", help="write nothing")
    parser.add_argument("--kind", choices=(*KINDS, *GROUNDS), action="append", help="only this one")
    arguments = parser.parse_args()
    run = BenchmarkRun()
    drives = []
    for kind in arguments.kind or (*KINDS, *GROUNDS):
        num = 3 if arguments.quick else NUM_DRIVES if kind in KINDS else NUM_NEGATIVES
        drives += [run_drive(kind, number) for number in range(num)]
    text = "\n\n".join(["## Edges of the ground", describe_run(run), format_drives(drives)])
    if arguments.is_dry:
        print(text)
        for drive in drives:
            print(drive)
    else:
        write_section("edges", text)


def run_drive(kind: EdgeKind, number: int) -> EdgeDrive:
    """Drive once: the robot and the sensor follow from the number."""
    robot_name = list(ROBOTS)[number % len(ROBOTS)]
    sensor_name = SENSORS[(number + number // len(SENSORS)) % len(SENSORS)]
    edge_scene = make_edge_scene(kind, number)
    simulation = Simulation(
        edge_scene.scene,
        make_sensor(sensor_name, factor=0.5),
        replace(ROBOTS[robot_name], speed=SPEED),
        seed=number,
    )
    session = MapSession()
    known_at, drift, position = float("nan"), np.eye(4), np.zeros(3)
    for frame, believed, true_pose in simulation.frames():
        session.add(frame, believed)
        drift = believed @ invert_transform(true_pose)
        position = true_pose[:3, 3]
        if np.isnan(known_at) and edge_scene.edges.size and is_known(session.drops(), edge_scene, drift):
            known_at = -float(position[0])
    stairways = session.stairways()
    drops = session.drops()
    return EdgeDrive(
        kind=kind,
        robot=robot_name,
        sensor=sensor_name,
        known_at=known_at,
        num_invented=count_invented(drops, edge_scene, drift),
        **judge_floor(session, stairways, drops, (edge_scene, drift, float(position[1]))),
    )


def is_known(drops: Sequence[Drop], edge_scene: EdgeScene, drift: Transform) -> bool:
    """Whether a drop lies at the edge ahead."""
    front = transform_points(drift, edge_scene.edges[0])
    return any(distance_to(drop.center, front) < MAX_OFF for drop in drops)


def count_invented(drops: Sequence[Drop], edge_scene: EdgeScene, drift: Transform) -> int:
    """How many drops lie at no edge."""
    edges = [transform_points(drift, edge) for edge in edge_scene.edges]
    return sum(all(distance_to(drop.center, edge) > 2 * MAX_OFF for edge in edges) for drop in drops)


def distance_to(place: Points, edge: Points) -> float:
    """Distance of a (3,) place from a (2, 3) segment, m."""
    along = edge[1] - edge[0]
    share = float(np.clip((place - edge[0]) @ along / (along @ along), 0.0, 1.0))
    return float(np.linalg.norm(place - edge[0] - share * along))


def judge_floor(
    session: MapSession,
    stairways: Sequence,
    drops: Sequence[Drop],
    truth: tuple[EdgeScene, Transform, float],
) -> dict[str, float]:
    """Error of the height of the robot's floor, and the places before the edge that its mask leaves free."""
    edge_scene, drift, lateral = truth
    try:
        floors = find_floors(stairways, session.trajectory(), camera_height=session.camera_height)
    except FloorError:
        return {"num_free": -1, "floor_error": float("nan")}
    error = floors.floor(0).height
    if not edge_scene.edges.size:
        return {"num_free": 0, "floor_error": error}
    ground = ForbiddenGround(stairways=tuple(stairways), drops=tuple(drops))
    mask = make_keepout_mask(ground, floors, 0)
    num_free = 0
    for before in np.arange(0.0, FORBIDDEN + 1e-9, 0.05):
        for aside in np.linspace(-PATH_HALF, PATH_HALF, 11):
            half = float(np.abs(edge_scene.edges[0, :, 1]).max())
            y = float(np.clip(lateral + aside, -half, half))
            place = transform_points(drift, np.array([-before, y, 0.0]))
            num_free += int(mask is None or mask.value_at(place) != 100)
    return {"num_free": num_free, "floor_error": error}


def format_drives(drives: Sequence[EdgeDrive]) -> str:
    """Return the tables of all drives: goals, then a row for each kind."""
    edges = [drive for drive in drives if drive.kind in KINDS]
    late = [drive for drive in edges if not drive.known_at >= STOPPING_DISTANCE]
    rows = []
    for kind in dict.fromkeys(drive.kind for drive in drives):
        mine = [drive for drive in drives if drive.kind == kind]
        known = np.array([drive.known_at for drive in mine])
        rows.append(
            (
                kind,
                len(mine),
                int(np.count_nonzero(known >= STOPPING_DISTANCE)) if kind in KINDS else "",
                f"{np.nanmin(known):.2f}, {np.nanmedian(known):.2f}" if np.isfinite(known).any() else "",
                sum(drive.num_invented for drive in mine),
                sum(drive.num_free > 0 for drive in mine) if kind in KINDS else "",
                f"{1e3 * max(abs(drive.floor_error) for drive in mine):.0f}",
            )
        )
    goals = [
        (
            f"an edge is known before the robot is within {STOPPING_DISTANCE} m of it",
            f"{len(edges) - len(late)} of {len(edges)}",
        ),
        ("drops invented", sum(drive.num_invented for drive in drives)),
        (
            f"masks that are free within {FORBIDDEN} m before an edge on the robot's path",
            sum(drive.num_free != 0 for drive in edges),
        ),
        (
            f"floors off by more than {1e3 * MAX_FLOOR_ERROR:.0f} mm where the robot stood",
            sum(not abs(drive.floor_error) <= MAX_FLOOR_ERROR for drive in drives),
        ),
    ]
    header = (
        "ground",
        "drives",
        "known in time",
        "known at m: least, median",
        "invented",
        "masks free",
        "floor mm",
    )
    tables = [(("goal", "measured"), goals), (header, rows)]
    return "\n\n".join(
        format_table(names, [tuple(str(cell) for cell in row) for row in lines]) for names, lines in tables
    )


if __name__ == "__main__":
    main()
