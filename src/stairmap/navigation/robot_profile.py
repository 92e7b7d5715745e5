"""What a robot can climb, as YAML files that name a source for each figure.

Every limit must stand in the file; ``null`` says that there is one but nobody published it. An
unpublished limit is never guessed. See ``robots/spot.yaml`` for an example.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import field, fields
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, ConfigDict, Field, SkipValidation, ValidationError
from pydantic.dataclasses import dataclass

from stairmap.errors import ConfigError
from stairmap.input_files import CheckedModel, first_mistake, parse_yaml, quoted, read_text, shown, validated
from stairmap.navigation.limits import Limit, Measure, Sense

_FOLDER = "robots"

StairDirections: TypeAlias = Literal["both", "up", "down"]
"""In which directions a robot takes stairs."""

MAX_LENGTH = 5.0
"""No robot is larger, m."""

MIN_ANGLE_DEG = 2.0
"""No stairs are so flat; a smaller angle was meant in radians."""

MAX_SPEED = 50.0
"""No robot on stairs is faster, m/s."""

MAX_TIME = 1e6
"""Most that an alignment or a metre of height may cost, s: eleven days."""


def _check_metres(value: float) -> float:
    if value > MAX_LENGTH:
        raise ValueError(f"is in metres and at most {MAX_LENGTH:g}, got {value:g}; is that mm?")
    return value


def _check_degrees(value: float) -> float:
    if not MIN_ANGLE_DEG < value < 90:
        raise ValueError(f"must be from {MIN_ANGLE_DEG:g} to 90 degrees, got {value:g}")
    return value


def _check_name(value: str) -> str:
    if not value.strip():
        raise ValueError("must be a text that says something")
    return value


Name = Annotated[str, Field(max_length=100), AfterValidator(_check_name)]
Length = Annotated[float, Field(gt=0), AfterValidator(_check_metres)]
Margin = Annotated[float, Field(ge=0), AfterValidator(_check_metres)]
Angle = Annotated[float, AfterValidator(_check_degrees)]
Speed = Annotated[float, Field(gt=0, le=MAX_SPEED)]
Time = Annotated[float, Field(ge=0, le=MAX_TIME)]


@dataclass(
    frozen=True,
    slots=True,
    kw_only=True,
    config=ConfigDict(strict=True, allow_inf_nan=False, extra="forbid"),
)
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

    Raises
    ------
    ValueError
        If a figure is out of its range, no number, or contradicts another.
    """

    name: Name
    max_continuous_rise: Length | None
    max_single_rise: Length | None
    min_run: Length | None
    max_pitch_deg: Angle | None
    max_slope_deg: Angle | None
    body_width: Length | None
    side_clearance: Margin | None
    min_landing_length: Length | None
    floor_speed: Speed = 0.5
    stair_speed: Speed = 0.2
    alignment_time: Time = 5.0
    ascent_risk: Time = 10.0
    descent_risk: Time = 15.0
    stair_directions: StairDirections = "both"
    sources: SkipValidation[Mapping[str, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "sources", MappingProxyType(dict(self.sources)))
        low, high = self.max_continuous_rise, self.max_single_rise
        if low is not None and high is not None and low > high:
            raise ValueError(
                f"max_continuous_rise {low:g} m is above max_single_rise {high:g} m; what it climbs again "
                "and again it also climbs once"
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
    missing = [item for item in known if item not in values and item not in _OPTIONAL]
    if missing:
        raise ConfigError(
            f"robot profile {origin} lacks {', '.join(missing)}; write null for a limit that is not known"
        )
    figures, sources = dict(values), {}
    for key, entry in values.items():
        if isinstance(entry, dict):
            try:
                figure = validated(_Figure, entry)
            except ValueError as error:
                raise ConfigError(
                    f"robot profile {origin}: {key} must be a number or {{value, source}}: {error}"
                ) from error
            figures[key], sources[key] = figure.value, figure.source
    try:
        return RobotProfile(**figures, sources=sources)
    except ValidationError as error:
        raise ConfigError(f"robot profile {origin}: {first_mistake(error)}") from error


class _Figure(CheckedModel):
    """A figure and where it stands."""

    model_config = ConfigDict(extra="forbid")

    value: Any
    source: str = ""


_OPTIONAL = (
    "floor_speed", "stair_speed", "alignment_time", "ascent_risk", "descent_risk", "stair_directions",
)  # fmt: skip
