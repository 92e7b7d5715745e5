"""Can my robot climb it, and where does it lead?

python examples/04_can_my_robot_climb_it.py results/hall_1 spot
python examples/04_can_my_robot_climb_it.py results/hall_1 my_robot.yaml
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import stairmap
from stairmap.export.verdicts import format_limit, format_margin, format_measured, format_probability


def main(run: Path, robot_name: str) -> None:
    """Print the verdict for each stairway of a run, and the portal that it is for a planner."""
    stairways = stairmap.load_stairways(run).stairways
    robot = stairmap.load_robot(robot_name)
    if not stairways:
        print("the run found no stairway")
        return

    floors = stairmap.find_floors(stairways, stairmap.load_tum_trajectory(run / "trajectory.tum"))
    for portal in stairmap.make_portals(stairways, floors, robot):
        answer = portal.assessment
        check = answer.limiting
        print(f"stairway {portal.stairway_id}: {answer.verdict} for {robot.name}")
        print(f"  probability {format_probability(answer.probability)}")
        print(f"  decided by the {check.limit.measure} of flight {check.flight_number}: "
              f"{format_measured(check)}, limit {format_limit(check)} ({check.limit.source})")  # fmt: skip
        print(f"  margin {format_margin(check) or 'unknown'}")

        explored = "unexplored" if portal.leads_to_unexplored else "explored"
        print(f"  joins floor {portal.lower_level} and floor {portal.upper_level} ({explored})")
        print(f"  line up at {np.round(portal.lower.position, 2).tolist()} m, "
              f"heading {np.degrees(portal.lower.heading):.0f} deg")  # fmt: skip
        print(f"  {portal.height:.2f} m up, {portal.cost_up:.0f} s up and {portal.cost_down:.0f} s down")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(f"usage:\n{__doc__}")
    main(Path(sys.argv[1]), sys.argv[2])
