"""Feed frames and poses from your own code, and ask again after a loop closure.

A simulated robot stands in for yours (needs the extra `sim`):

    python examples/03_own_poses.py
"""

from __future__ import annotations

import numpy as np

import stairmap
from stairmap.simulation.odometry import close_loop
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.simulate import Simulation


def main() -> None:
    """Print where a stairway is before and after the poses were corrected."""
    scene = make_scene("free_standing", seed=1)
    robot = Simulation(scene, make_sensor("d435", factor=0.5), ROBOTS["go2"], seed=1, num_frames=40)
    session = stairmap.MapSession()

    for simulated in robot.frames():
        # (4, 4) pose of the depth camera's optical frame in a map with z up, as SLAM gives it now.
        session.add(simulated.frame, simulated.map_from_camera_odometry)
    report("as the poses came", session.stairways())

    # A loop closure moves old poses. Observations are kept relative to them: correct them, ask again.
    corrected = stairmap.Trajectory(
        stamps_ns=robot.stamps_ns,
        map_from_camera=close_loop(robot.stamps_ns, robot.odometry_poses, robot.true_poses),
    )
    session.correct(corrected)
    report("after the loop closure", session.stairways())
    report("the truth", scene.stairways)


def report(title: str, stairways: tuple[stairmap.Stairway, ...]) -> None:
    """Print place and dimensions of stairways."""
    for stairway in stairways:
        flight = stairway.flights[0]
        print(
            f"{title}: stairway {stairway.id} at {np.round(flight.base, 2).tolist()} m, rise "
            f"{flight.rise * 1e3:.0f} mm, run {flight.run * 1e3:.0f} mm, {flight.num_risers} risers"
        )


if __name__ == "__main__":
    main()
