"""What came of an exploration: ``exploration.json`` (docs/outputs.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplorationOutcome:
    """Result of a mission.

    Attributes
    ----------
    floors_reached
        Floors that the robot stood on; landings do not count.
    area_m2
        Free ground mapped, m².
    path_m, time_s
        Way and time of the robot.
    falls, collisions
        How often it fell, or ran into something.
    sensor_stops
        How often its own sensors stopped it before something that its map did not show.
    stairs_climbed
        How many flights it used, up or down.
    stopped
        Why the mission ended.
    coverage
        (time s, area m², level) after each decision.
    floors
        Number, height (m), area (m²) of each level, and whether it is a landing.
    """

    floors_reached: int
    area_m2: float
    path_m: float
    time_s: float
    falls: int
    collisions: int
    sensor_stops: int
    stairs_climbed: int
    stopped: str
    coverage: tuple[tuple[float, float, int], ...]
    floors: tuple[dict[str, Any], ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the outcome as JSON types."""
        return {
            "schema": 1,
            "floors_reached": self.floors_reached,
            "area_m2": round(self.area_m2, 2),
            "path_m": round(self.path_m, 2),
            "time_s": round(self.time_s, 1),
            "falls": self.falls,
            "collisions": self.collisions,
            "sensor_stops": self.sensor_stops,
            "stairs_climbed": self.stairs_climbed,
            "stopped": self.stopped,
            "coverage": [[round(t, 1), round(a, 2), level] for t, a, level in self.coverage],
            "levels": list(self.floors),
        }
