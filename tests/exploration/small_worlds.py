"""Worlds of a few blocks, and robots in them, for the tests of exploration."""

from __future__ import annotations

import math

import numpy as np

from stairmap.exploration.body import load_body
from stairmap.exploration.odometry import Planar
from stairmap.exploration.simulated_robot import SimulatedRobot
from stairmap.exploration.world import World
from stairmap.simulation.odometry import PERFECT_ODOMETRY, OdometryModel
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.stair_shapes import FlightShape, StairwayShape
from stairmap.simulation.stairs import build_stairway
from stairmap.simulation.storeys import make_shell, make_slab
from stairmap.simulation.triangle_mesh import joined, make_block

ROOM = (0.0, 0.0, 6.0, 4.0)
SPOT = load_body("spot")


def room_with(*blocks):
    """Return a room of 6 by 4 m, with blocks in it, each a pair of corners."""
    return joined(
        [make_slab(ROOM, 0.0), make_shell(ROOM, 0.0, 2.6), *[make_block(*corners) for corners in blocks]]
    )


def stairs(rise=0.15, run=0.30, num_risers=6, width=1.2):
    """Return a flight from (2, 2, 0) along x, with a floor before and behind it."""
    shape = StairwayShape(flights=(FlightShape(rise=rise, run=run, width=width, num_risers=num_risers),))
    built = build_stairway(
        shape, base=(2.0, 2.0, 0.0), heading=0.0, stairway_id=1, random=np.random.default_rng(0)
    )
    end = 2.0 + (num_risers - 1) * run
    top = make_block([end + 0.001, 0.0, built.top_z - 0.2], [end + 3.0, 4.0, built.top_z])
    return joined([make_slab(ROOM, 0.0), built.mesh, top]), built.stairway


def robot_in(mesh, x, y, heading_deg=0.0, *, z=0.0, body=SPOT, model=PERFECT_ODOMETRY, seed=0):
    """Return a robot in a mesh."""
    start = Planar(x=x, y=y, z=z, heading=math.radians(heading_deg))
    sensor = make_sensor("kinect_v2", factor=0.25)
    return SimulatedRobot(World(mesh), body, sensor, start, seed=seed, model=model)


DRIFT = OdometryModel()
