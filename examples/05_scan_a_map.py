"""Where are the stairs in my map, and can my robot climb them?

python examples/05_scan_a_map.py building.laz spot
python examples/05_scan_a_map.py slam_map.pcd my_robot.yaml
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import stairmap


def main(path: Path, robot_name: str) -> None:
    """Print the stairways of a map of points, and whether a robot can climb each."""
    robot = stairmap.load_robot(robot_name)
    scan = stairmap.MapScan([stairmap.open_cloud(path)])
    scan.read()
    result = scan.find_stairways()

    print(f"{result.num_points:,} points in {result.unit}")
    for note in result.notes:
        print(f"note: {note}")
    for rejection in () if result.stairways else result.rejections:
        print(f"refused: {rejection}")

    for stairway in result.stairways:
        print(f"stairway {stairway.id}: {stairway.num_risers} risers")
        for flight in stairway.flights:
            std = flight.std
            print(f"  rise {flight.rise * 1e3:.0f} ± {std.rise * 1e3:.1f} mm, "
                  f"run {flight.run * 1e3:.0f} ± {std.run * 1e3:.1f} mm, width {flight.width * 1e3:.0f} mm, "
                  f"heading {np.degrees(flight.heading):.0f} deg")  # fmt: skip
            print(f"  from {np.round(flight.base, 2).tolist()} in the map")
        print(f"  {stairmap.assess(stairway, robot).verdict} for {robot.name}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(f"usage:\n{__doc__}")
    main(Path(sys.argv[1]), sys.argv[2])
