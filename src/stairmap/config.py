"""Every number that a user may change: one frozen tree, checked, with units and reasons.

Later wins: defaults, YAML file, ``--set section.key=value``. ROS parameters and
docs/configuration.md are made from this file. What can be read from the data
(intrinsics, up, noise at a depth) is no parameter.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from stairmap.errors import ConfigError
from stairmap.input_files import first_mistake, parse_yaml, quoted, read_text, shown


class _Section(BaseModel):
    model_config = ConfigDict(
        strict=True, frozen=True, allow_inf_nan=False, extra="forbid", use_attribute_docstrings=True
    )


class EnvelopeConfig(_Section):
    """Which dimensions a stairway may have at all; anything outside is not called one."""

    min_rise: float = Field(0.09, gt=0, lt=1)
    """Smallest rise, m. Lowest legal outdoor steps are 0.10; the rest is measurement error."""
    max_rise: float = Field(0.26, gt=0, lt=1)
    """Largest rise, m. OSHA allows 0.241; ship stairs go to 0.305."""
    min_run: float = Field(0.18, gt=0, lt=2)
    """Smallest run, m. Ship stairs go down to 0.19."""
    max_run: float = Field(0.43, gt=0, lt=2)
    """Largest run, m. Outdoor and monumental stairs reach 0.42."""
    min_pitch_deg: float = Field(14.0, ge=0, lt=90)
    """Smallest pitch, deg. Below it lie ramps and floors; 0.10 by 0.40 m is 14.0."""
    max_pitch_deg: float = Field(52.0, gt=0, lt=90)
    """Largest pitch, deg. OSHA's industrial stairs end at 50."""
    min_width: float = Field(0.50, gt=0, le=20)
    """Smallest width of the widest step, m. The narrowest legal stair is 0.55."""

    @model_validator(mode="after")
    def _check_order(self) -> EnvelopeConfig:
        for low, high in (
            ("min_rise", "max_rise"),
            ("min_run", "max_run"),
            ("min_pitch_deg", "max_pitch_deg"),
        ):
            if getattr(self, low) >= getattr(self, high):
                raise ValueError(
                    f"{low} ({getattr(self, low):g}) must be below {high} ({getattr(self, high):g})"
                )
        return self


class DetectionConfig(_Section):
    """How one frame is looked at by the default method."""

    max_depth: float = Field(6.0, gt=0.5, le=20)
    """Farthest depth that is used, m. A riser of 0.17 m at 6 m is 7 px high at 320x240."""
    min_steps: int = Field(3, ge=2, le=10)
    """Fewest steps of an observation. Two equal steps also occur in furniture."""
    max_up_correction_deg: float = Field(6.0, ge=0, le=20)
    """How far treads and floor may turn the given up, deg. A real IMU was 3-4 deg off."""
    camera_height: float = Field(0.0, ge=0, le=3)
    """Height of the camera above the ground it moves on, m. 0: as the ground in view tells; give it where
    tables or lower floors fill the view."""


class ModelingConfig(_Section):
    """How observations become stairways in the default method."""

    min_observations: int = Field(3, ge=1, le=100)
    """Fewest observations of a stairway that is reported."""
    pose_drift: float = Field(0.0, ge=0, le=1)
    """Drift of the poses that widens the std of places, m per m travelled. 0: the poses' map is corrected;
    wheel odometry drifts by 0.01-0.02; --odometry sets its own measured one."""
    pose_heading_drift_deg: float = Field(0.0, ge=0, le=10)
    """Drift of their heading, deg per m travelled. Wheel odometry: 0.3-1; --odometry sets its own."""


class Delmerico2013Config(_Section):
    """Free choices of the report's method; its published numbers are constants of the code."""

    detections_per_fit: int = Field(5, ge=1, le=1000)
    """Algorithm 1's k: a model is fitted each time this many detections have come (the report: 5 or 10)."""
    min_cluster_points: int = Field(250, ge=1, le=10_000_000)
    """Fewest points of a cluster that counts as a stair edge (the report: more than 250)."""
    max_pitch_deg: float = Field(45.0, gt=0, le=90)
    """Largest angle of the edge plane to the horizontal, deg (the report: 45)."""


class Config(_Section):
    """All settings of stairmap, by section, as in ``config.yaml`` (docs/configuration.md)."""

    envelope: EnvelopeConfig = EnvelopeConfig()
    detection: DetectionConfig = DetectionConfig()
    modeling: ModelingConfig = ModelingConfig()
    delmerico2013: Delmerico2013Config = Delmerico2013Config()


def load_config(path: Path | None = None, overrides: Sequence[str] = ()) -> Config:
    """Return the configuration: defaults, then a YAML file, then ``section.key=value`` overrides.

    Raises
    ------
    ConfigError
        If the file cannot be read, a key is unknown (the nearest known one is named),
        or a value is not allowed.
    """
    values: dict[str, Any] = {} if path is None else _load_yaml(path)
    for override in overrides:
        key, separator, text = override.partition("=")
        parts = key.strip().split(".")
        if not separator or not all(parts):
            raise ConfigError(f"expected --set section.key=value, got {quoted(override)}")
        _set_value(values, parts, _parse_value(text, override))
    _check_keys(values, Config, "")
    try:
        return Config.model_validate(values)
    except ValidationError as error:
        raise ConfigError(f"config {first_mistake(error)}") from error


def dump_config(config: Config, *, only_given: bool = False) -> str:
    """Return the configuration as YAML that ``load_config`` reads back equal.

    Parameters
    ----------
    config
        The configuration.
    only_given
        Leave out what nobody set, so that it still can be told from what was set to its default.
    """
    return yaml.safe_dump(config.model_dump(exclude_unset=only_given), sort_keys=False)


def _load_yaml(path: Path) -> dict[str, Any]:
    text = read_text(path, error_type=ConfigError, what="the config file")
    try:
        values = parse_yaml(text)
    except ValueError as error:
        raise ConfigError(f"{shown(path)} is not a YAML file: {error}") from error
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise ConfigError(f"{path} must hold sections such as 'detection:', got {type(values).__name__}")
    return values


def _parse_value(text: str, override: str) -> Any:
    try:
        return parse_yaml(text)
    except ValueError as error:
        raise ConfigError(
            f"cannot read the value of --set {quoted(override, marks=False)}: {error}"
        ) from error


def _set_value(values: dict[str, Any], parts: list[str], value: Any) -> None:
    for part in parts[:-1]:
        child = values.setdefault(part, {})
        if not isinstance(child, dict):
            raise ConfigError(f"config key {part} is a value, not a section, in {'.'.join(parts)}")
        values = child
    values[parts[-1]] = value


def _check_keys(values: dict[str, Any], section: type[BaseModel], prefix: str) -> None:
    for key, value in values.items():
        if key not in section.model_fields:
            known = _all_keys(Config)
            # A misspelt section is told best by the key that was sought in it.
            sought = (
                f"{prefix}{key}.{next(iter(value))}"
                if value and isinstance(value, dict)
                else f"{prefix}{key}"
            )
            near = difflib.get_close_matches(sought, known, n=1, cutoff=0.0)
            raise ConfigError(
                f"unknown config key {prefix}{quoted(str(key), marks=False)}; did you mean {near[0]}? "
                "(stairmap config lists all)"
            )
        annotation = section.model_fields[key].annotation
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            if not isinstance(value, dict):
                found = quoted(repr(value), marks=False)
                raise ConfigError(f"config {prefix}{key} is a section, expected keys in it, got {found}")
            _check_keys(value, annotation, f"{prefix}{key}.")


def _all_keys(section: type[BaseModel], prefix: str = "") -> list[str]:
    keys = []
    for name, info in section.model_fields.items():
        annotation = info.annotation
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            keys += _all_keys(annotation, f"{prefix}{name}.")
        else:
            keys.append(f"{prefix}{name}")
    return keys
