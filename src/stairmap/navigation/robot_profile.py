"""What a robot can climb, as YAML files that name a source for each figure.

Every limit must stand in the file; ``null`` says that there is one but nobody published it. An
unpublished limit is never guessed. See ``robots/spot.yaml`` for an example.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypeAlias, get_args

from stairmap.errors import ConfigError
from stairmap.input_files import parse_yaml, quoted, read_text, shown
from stairmap.navigation.limits import Limit, Measure, Sense

_FOLDER = "robots"

StairDirections: TypeAlias = Literal["both", "up", "down"]
"""In which directions a robot takes stairs."""

_LIMITS = (
    "max_continuous_rise", "max_single_rise", "min_run", "max_pitch_deg", "max_slope_deg", "body_width",
    "side_clearance", "min_landing_length",
)  # fmt: skip

_LENGTHS = (
    "max_continuous_rise", "max_single_rise", "min_run", "body_width", "side_clearance", "min_landing_length",
)  # fmt: skip

_MAX_NAME_LENGTH = 100

_MAX_SPEED = 50.0
"""No robot on stairs is faster, m/s."""

_MAX_TIME = 1e6
"""Most that an alignment or a metre of height may cost, s: eleven days."""

_MAX_LENGTH = 5.0
_MIN_ANGLE_DEG = 2.0
"""No stairs are so flat; a smaller angle was meant in radians."""

_MOTION = ("floor_speed", "stair_speed", "alignment_time", "ascent_risk", "descent_risk")


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotProfile:
    """A robot as stairs see it. Lengths in m; ``None`` where no figure was published.

    Attributes
    ----------
    name
        How it is called in results.
    max_continuous_rise
        Largest rise of a flight of several steps. Up to three times less than a single obstacle.
    max_single_rise
        Largest rise of a single step.
    min_run
        Smallest run of a flight.
    max_pitch_deg
        Largest pitch of a flight, deg.
    max_slope_deg
        Steepest ramp, deg. Grip ends it, not geometry, so a flight that is no steeper passes, but one that
        is steeper does not fail by it. It counts where neither run nor pitch of stairs has a limit.
    body_width, side_clearance
        Width of the body, and room to be left at each side of it.
    min_landing_length
        Shortest landing between flights on which it can turn or rest.
    floor_speed, stair_speed
        Speed on floors, and on stairs along their slope, m/s.
    alignment_time
        Time to line up before a flight, s.
    ascent_risk, descent_risk
        What a metre of height costs on top of its time, s: how much of a detour it is worth.
    stair_directions
        ``both``, ``up`` or ``down``: the only direction in which it takes stairs. Some robots climb what they
        cannot come down.
    sources
        Where each figure stands, by the name of the field.
    """

    name: str
    max_continuous_rise: float | None
    max_single_rise: float | None
    min_run: float | None
    max_pitch_deg: float | None
    max_slope_deg: float | None
    body_width: float | None
    side_clearance: float | None
    min_landing_length: float | None
    floor_speed: float = 0.5
    stair_speed: float = 0.2
    alignment_time: float = 5.0
    ascent_risk: float = 10.0
    descent_risk: float = 15.0
    stair_directions: StairDirections = "both"
    sources: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "sources", MappingProxyType(dict(self.sources)))
        for name in (*_LIMITS, *_MOTION):
            _check_number(self.name, name, getattr(self, name))
        if self.stair_directions not in get_args(StairDirections):
            found = quoted(repr(self.stair_directions), marks=False)
            raise ConfigError(f"robot {self.name}: stair_directions must be both, up or down, got {found}")
        low, high = self.max_continuous_rise, self.max_single_rise
        if low is not None and high is not None and low > high:
            raise ConfigError(
                f"robot {self.name}: max_continuous_rise {low:g} m is above max_single_rise {high:g} m; "
                "what it climbs again and again it also climbs once"
            )
        for name in ("max_pitch_deg", "max_slope_deg"):
            angle = getattr(self, name)
            if angle is not None and not _MIN_ANGLE_DEG < angle < 90:
                raise ConfigError(
                    f"robot {self.name}: {name} must be from {_MIN_ANGLE_DEG:g} to 90 degrees, got {angle:g}"
                )

    def takes_stairs(self, *, up: bool) -> bool:
        """Whether it takes stairs in a direction."""
        return self.stair_directions in ("both", "up" if up else "down")

    @property
    def min_width(self) -> float | None:
        """Narrowest stairway that it fits into: body and clearance at both sides, m."""
        if self.body_width is None or self.side_clearance is None:
            return None
        return self.body_width + 2 * self.side_clearance

    def limits(self) -> tuple[Limit, ...]:
        """Return its limits for the flights of a stairway."""
        has_pitch = self.max_pitch_deg is not None or self.max_slope_deg is None
        pitch_key, degrees = (
            ("max_pitch_deg", self.max_pitch_deg) if has_pitch else ("max_slope_deg", self.max_slope_deg)
        )
        pitch = None if degrees is None else math.radians(degrees)
        rows: tuple[tuple[Measure, Sense, float | None, str], ...] = (
            ("rise", "max", self.max_continuous_rise, "max_continuous_rise"),
            ("single rise", "max", self.max_single_rise, "max_single_rise"),
            ("run", "min", self.min_run, "min_run"),
            ("pitch", "max", pitch, pitch_key),
            ("width", "min", self.min_width, "body_width"),
            ("landing length", "min", self.min_landing_length, "min_landing_length"),
        )
        return tuple(
            Limit(
                measure=measure,
                sense=sense,
                value=value,
                source=self.sources.get(key, ""),
                is_binding=key != "max_slope_deg",
            )
            for measure, sense, value, key in rows
        )


def robot_names() -> tuple[str, ...]:
    """Return the names of the profiles that come with stairmap."""
    folder = resources.files("stairmap.navigation") / _FOLDER
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name.removesuffix(".yaml") for name in names if name.endswith(".yaml")))


def load_robot(name_or_path: str | Path) -> RobotProfile:
    """Return a profile that comes with stairmap, by name, or one from a YAML file.

    Raises
    ------
    ConfigError
        If there is no such profile, it is not YAML, a limit is missing, negative or
        contradicts another, or a key is unknown.
    """
    text = str(name_or_path)
    if text in robot_names():
        content = (resources.files("stairmap.navigation") / _FOLDER / f"{text}.yaml").read_text("utf-8")
    elif not Path(text).suffix and not Path(text).exists():
        raise ConfigError(f"no robot {text!r}; choose one of {', '.join(robot_names())}, or name a YAML file")
    else:
        content = read_text(Path(text), error_type=ConfigError, what="the robot profile")
    try:
        values = parse_yaml(content)
    except ValueError as error:
        raise ConfigError(f"{shown(text)} is not a YAML file: {error}") from error
    return robot_from_values(values, origin=shown(text))


def robot_from_values(values: Any, *, origin: str) -> RobotProfile:
    """Return the profile of what a YAML file holds.

    A figure is a number, ``null``, or ``{value: number, source: text}``.

    Raises
    ------
    ConfigError
        If a limit is missing, negative or contradicts another, or a key is unknown.
    """
    if not isinstance(values, dict):
        raise ConfigError(f"robot profile {origin} must hold keys such as 'max_continuous_rise:'")
    known = [item.name for item in fields(RobotProfile) if item.name != "sources"]
    for key in values:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, n=1, cutoff=0.0)
            found = quoted(str(key), marks=False)
            raise ConfigError(f"robot profile {origin}: unknown key {found}; did you mean {near[0]}?")
    missing = [key for key in ("name", *_LIMITS) if key not in values]
    if missing:
        raise ConfigError(
            f"robot profile {origin} lacks {', '.join(missing)}; write null for a limit that is not known"
        )
    name = values["name"]
    if not isinstance(name, str) or not name.strip() or len(name) > _MAX_NAME_LENGTH:
        raise ConfigError(
            f"robot profile {origin}: name must be a text of 1 to {_MAX_NAME_LENGTH} characters, "
            f"got {quoted(repr(name), marks=False)}"
        )
    figures, sources = {}, {}
    for key in (*_LIMITS, *_MOTION):
        if key not in values:
            continue
        entry = values[key]
        if isinstance(entry, dict):
            if "value" not in entry or set(entry) - {"value", "source"}:
                raise ConfigError(f"robot profile {origin}: {key} must be a number or {{value, source}}")
            sources[key] = str(entry.get("source", ""))
            entry = entry["value"]
        if key in _MOTION and entry is None:
            raise ConfigError(f"robot profile {origin}: {key} must be a number; leave it out for the default")
        figures[key] = entry
    if "stair_directions" in values:
        figures["stair_directions"] = values["stair_directions"]
    return RobotProfile(name=values["name"], **figures, sources=sources)


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number of hundreds of digits
        return False


def _check_number(robot: str, name: str, value: Any) -> None:
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, int | float) or not _is_finite(value):
        raise ConfigError(
            f"robot {robot}: {name} must be a number or null, got {quoted(repr(value), marks=False)}"
        )
    if name in _MOTION and value > (_MAX_SPEED if name.endswith("_speed") else _MAX_TIME):
        unit, most = ("m/s", _MAX_SPEED) if name.endswith("_speed") else ("s", _MAX_TIME)
        raise ConfigError(f"robot {robot}: {name} is at most {most:g} {unit}, got {value:g}")
    may_be_zero = name in ("side_clearance", "alignment_time", "ascent_risk", "descent_risk")
    if name in _LENGTHS and value > _MAX_LENGTH:
        raise ConfigError(
            f"robot {robot}: {name} is in metres and at most {_MAX_LENGTH:g}, got {value:g}; is that mm?"
        )
    if value < 0 or (value == 0 and not may_be_zero):
        raise ConfigError(f"robot {robot}: {name} must be above zero, got {value:g}")
