"""The robot that explores: how large it is, what its camera sees, what it can climb."""

from __future__ import annotations

from dataclasses import dataclass

from stairmap.navigation.robot_profile import RobotProfile, load_robot
from stairmap.simulation.robots import ROBOTS, Robot

DEFAULT_WIDTH = 0.5
"""Width of a body of which nobody published one, m: Spot's, the widest of the profiles that climb."""

HEADROOM = 0.15
"""How far a body reaches above its camera, m: an arm's mount, a handle."""

BODY_BOTTOM = 0.15
"""What is lower than this above the ground passes under the body, m; legs step over it."""

BODIES = {
    "go2_air": "go2", "lite3": "go2", "wheeled": "turtlebot", "turtlebot": "turtlebot", "packbot": "packbot",
}  # fmt: skip
"""Whose camera a profile carries in the simulation, where it is not its own; others carry Spot's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A robot that explores.

    Attributes
    ----------
    profile
        What it can climb, and its speeds.
    mount
        Height and tilt of its camera, and how its body shakes.
    radius
        Of the disc that its body fills on a floor, m: half its width, so it turns on the spot.
    clearance
        What it keeps from obstacles beyond that, m.
    """

    profile: RobotProfile
    mount: Robot
    radius: float
    clearance: float

    @property
    def top(self) -> float:
        """Height of the body above the ground, m."""
        return self.mount.camera_height + HEADROOM


def load_body(name: str) -> Body:
    """Return the robot of a profile: a name of ``stairmap check --list``, or a YAML file.

    Raises
    ------
    ConfigError
        If there is no such profile.
    """
    profile = load_robot(name)
    mount = ROBOTS[name] if name in ROBOTS else ROBOTS[BODIES.get(name, "spot")]
    width = DEFAULT_WIDTH if profile.body_width is None else profile.body_width
    clearance = 0.05 if profile.side_clearance is None else profile.side_clearance
    return Body(profile=profile, mount=mount, radius=width / 2, clearance=clearance)
