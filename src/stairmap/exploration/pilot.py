"""What a mission asks of a robot: drive a way, turn, look, climb. A simulation or a ROS node does it.

Each order is begun and then polled; a poll does a small part of it, and what the robot sees meanwhile enters
the map.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from stairmap.arrays import Points
from stairmap.exploration.stair_links import Link


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far an order is; ``reason`` says why it failed, ``is_stranded`` that people must come for it."""

    state: Literal["running", "done", "failed"]
    reason: str = ""
    is_stranded: bool = False


RUNNING, DONE = Progress(state="running"), Progress(state="done")


class Pilot(Protocol):
    """Carries out one order at a time.

    Attributes
    ----------
    blocking
        (N, 2) points of what stopped the last drive, m, map.
    """

    blocking: Points

    def drive(self, way: Points) -> None:
        """Begin to drive along (N, 2) points of the level, m, map."""
        ...

    def turn(self, heading: float) -> None:
        """Begin to turn to a heading, rad, map."""
        ...

    def look(self, *, is_tilted: bool, is_fine: bool) -> None:
        """Take a frame: with the camera down at an edge, or at its full resolution."""
        ...

    def climb(self, link: Link, *, is_up: bool) -> None:
        """Begin to use a flight from its staging pose."""
        ...

    def poll(self) -> Progress:
        """Do the next part of the order."""
        ...
