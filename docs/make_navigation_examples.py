"""Make the recordings, plans and pictures of docs/navigation.md.

A simulated Spot climbs the stairs of two architects' buildings. The buildings lie beside the project and are
no part of it:

    python docs/make_navigation_examples.py BUILDINGS OUTPUT
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from stairmap.simulation.recording import write_simulation
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scene import Route
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_wall

IMAGES = Path(__file__).parent / "images"


def institute_route() -> Route:
    """Return a way from the ground floor up three storeys; each has three flights about a square well."""
    points = [(19.0, 5.0, 0.0)]
    for storey in range(3):
        low = 3.0 * storey
        points += [
            (19.05, 9.5, low), (19.05, 11.7, low), (19.05, 14.2, low + 1.09), (19.05, 15.0, low + 1.09),
            (19.9, 15.0, low + 1.09), (22.0, 15.0, low + 2.05), (22.95, 15.0, low + 2.05),
            (22.95, 14.1, low + 2.05), (22.95, 12.0, low + 3.0), (22.95, 10.0, low + 3.0),
            (21.0, 9.5, low + 3.0),
        ]  # fmt: skip
    return Route(waypoints=np.array(points), last_pause=1.0)


def hospital_route() -> Route:
    """Return a way up three flights of a whole storey each, through a door that ``open_door`` makes."""
    points = [
        (-3.4, 20.0, 0.0), (-6.0, 20.0, 0.0), (-9.75, 20.0, 3.0), (-11.5, 20.0, 3.0),
        (-11.5, 18.0, 3.0), (-10.05, 18.0, 3.0), (-6.28, 18.0, 6.0), (-4.2, 18.0, 6.0),
        (-4.2, 16.5, 6.0), (-4.2, 20.0, 6.0), (-6.0, 20.0, 6.0), (-9.75, 20.0, 9.0), (-11.2, 20.3, 9.0),
    ]  # fmt: skip
    return Route(waypoints=np.array(points), last_heading=0.0, last_pause=1.0)


def open_door(mesh: TriangleMesh) -> TriangleMesh:
    """Return the hospital with a door of 1.5 m by 2.1 m between the two halves of a stairwell.

    The world stacks one storey three times, and a closed wall, 0.12 m thick, parts each flight from the next.
    """
    corners = mesh.vertices[mesh.triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    is_wall = (
        (low[:, 1] > 18.9) & (high[:, 1] < 19.06) & (low[:, 0] < -12.4) & (high[:, 0] > -6.1)
        & (low[:, 2] > 2.9) & (high[:, 2] < 6.1) & (high[:, 2] - low[:, 2] > 2.0)
    )  # fmt: skip
    if np.count_nonzero(is_wall) != 4:
        raise ValueError("the wall of the hospital's stairwell is not where it was")
    walls = []
    for y in (18.92, 19.04):
        walls.append(make_wall((-12.46, y), (-12.25, y), 3.0, 6.0))
        walls.append(make_wall((-12.25, y), (-10.75, y), 5.1, 6.0))
        walls.append(make_wall((-10.75, y), (-6.01, y), 3.0, 6.0))
    kept = TriangleMesh(vertices=mesh.vertices, triangles=mesh.triangles[~is_wall])
    return joined([kept, *walls])


ROUTES = {"institute_var2": institute_route, "hospital": hospital_route}


def stairmap(*arguments: str | Path) -> None:
    """Run a command and show it."""
    sys.stdout.write(f"$ stairmap {' '.join(map(str, arguments))}\n")
    sys.stdout.flush()
    subprocess.run([sys.executable, "-m", "stairmap", *map(str, arguments)], check=True)


PLANS = {
    "institute_var2": ("spot", "--from", "19,6,0", "--to", "21,9.5,3"),
    "hospital": ("b2", "--allow-unknown", "--from", "-3.6,20,0", "--to", "-11,20.4,3"),
}


def main(buildings: Path, folder: Path) -> None:
    """Simulate, run, check, plan and export in each building; ``show_exports.py`` then reads the exports."""
    for name, make_route in ROUTES.items():
        recording, run, plan = folder / name, folder / f"{name}_run", folder / f"{name}_plan"
        scene = replace(make_scene(f"building:{name}", 1, buildings=buildings), route=make_route())
        if name == "hospital":
            scene = replace(scene, mesh=open_door(scene.mesh))
        if not recording.exists():
            write_simulation(recording, scene, make_sensor("d435", factor=0.5), ROBOTS["spot"], seed=1)
        robot, *way = PLANS[name]
        if not run.exists():
            stairmap("run", recording, "--robot", robot, "-o", run)
        picture = IMAGES / f"navigation-{name}-verdicts.png"
        picture.unlink(missing_ok=True)  # a command overwrites nothing
        stairmap(
            "check", run, "--robot", "spot", "--robot", "b2", "--robot", "go2", "--robot", "wheeled",
            "--code", "ibc", "--code", "uk_k_general", "--picture", picture,
        )  # fmt: skip
        stairmap("plan", run, "--recording", recording, "--robot", robot, *way, "-o", plan)
        stairmap("plan", run, "--recording", recording, "--robot", robot, "--allow-unknown")
        stairmap(
            "export", run, "-f", "nav2-graph", "-f", "keepout", "-f", "osm", "-f", "ifc", "-f", "ply",
            "-f", "obj", "--anchor", "49.1,8.43,90",
        )  # fmt: skip
        shutil.copy(plan / "plan.png", IMAGES / f"navigation-{name}-plan.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
