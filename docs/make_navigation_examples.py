"""Make the recordings, plans and pictures of docs/navigation.md.

A simulated Spot climbs the stairs of two architects' buildings. The buildings lie beside the project and are
no part of it:

    python docs/make_navigation_examples.py ../shared/data/buildings /tmp/navigation
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
    """Return a way up one flight of a whole storey, to the closed door behind it."""
    points = [(-3.4, 20.0, 0.0), (-6.0, 20.0, 0.0), (-9.75, 20.0, 3.0), (-11.2, 20.3, 3.0)]
    return Route(waypoints=np.array(points), last_heading=0.0, last_pause=1.0)


ROUTES = {"institute_var2": institute_route, "hospital": hospital_route}


def stairmap(*arguments: str | Path) -> None:
    """Run a command and show it."""
    sys.stdout.write(f"$ stairmap {' '.join(map(str, arguments))}\n")
    sys.stdout.flush()
    subprocess.run([sys.executable, "-m", "stairmap", *map(str, arguments)], check=True)


PLANS = {
    "institute_var2": ("spot", "--from", "19,6,0", "--to", "21,9.5,3"),
    "hospital": ("b2", "--allow-unknown", "--from", "-3.6,20,0", "--to", "-11,20.4,1"),
}


def main(buildings: Path, folder: Path) -> None:
    """Simulate, run, check, plan and export in each building."""
    for name, make_route in ROUTES.items():
        recording, run, plan = folder / name, folder / f"{name}_run", folder / f"{name}_plan"
        scene = replace(make_scene(f"building:{name}", 1, buildings=buildings), route=make_route())
        if not recording.exists():
            write_simulation(recording, scene, make_sensor("d435", factor=0.5), ROBOTS["spot"], seed=1)
        robot, *way = PLANS[name]
        if not run.exists():
            stairmap("run", recording, "--robot", robot, "-o", run)
        picture = IMAGES / f"navigation-{name}-verdicts.png"
        stairmap(
            "check", run, "--robot", "spot", "--robot", "b2", "--robot", "go2", "--robot", "wheeled",
            "--code", "ibc", "--code", "uk_k_general", "--picture", picture,
        )  # fmt: skip
        stairmap("plan", run, "--recording", recording, "--robot", robot, *way, "-o", plan)
        stairmap("plan", run, "--recording", recording, "--robot", robot, "--allow-unknown")
        stairmap("export", run, "-f", "nav2-graph", "-f", "keepout", "-f", "ifc", "-f", "obj")
        shutil.copy(plan / "plan.png", IMAGES / f"navigation-{name}-plan.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
