"""camera.json: intrinsics, depth scale and, for images without poses, which way is up."""

from __future__ import annotations

import difflib
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from stairmap.arrays import Vector, readonly
from stairmap.camera import PinholeCamera
from stairmap.errors import CalibrationError
from stairmap.geometry import normalized
from stairmap.input_files import CheckedModel, Place, parse_json, quoted, read_text, validated
from stairmap.output_files import write_whole_text

REQUIRED_KEYS = ("width", "height", "fx", "fy", "cx", "cy", "depth_scale")
"""What camera.json must hold."""

MAX_SIDE = 8192
"""Longest side of an image, px: no depth camera has more, and a larger one would fill the memory."""

MAX_NUMBER = 1e6
"""Largest focal length and principal point, px, and most PNG values per metre: a micrometre each."""

MAX_FIELD_OF_VIEW = math.radians(170)
"""No pinhole camera sees more; such a focal length is not in pixels."""


def _whole(value: Any) -> Any:
    """Take 640.0 for 640, as some programs write it."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


Side = Annotated[int, BeforeValidator(_whole), Field(gt=0, le=MAX_SIDE)]
Focal = Annotated[float, Field(gt=0, le=MAX_NUMBER)]
Middle = Annotated[float, Field(ge=-MAX_NUMBER, le=MAX_NUMBER)]


class _SavedCameraFile(CheckedModel):
    """``camera.json``; ``up`` need not have unit length."""

    width: Side
    height: Side
    fx: Focal
    fy: Focal
    cx: Middle
    cy: Middle
    depth_scale: Annotated[float, Field(gt=0, le=MAX_NUMBER)]
    up: Place | None = None

    @model_validator(mode="after")
    def _check_focal_lengths(self) -> _SavedCameraFile:
        for name, size, focal in (("fx", self.width, self.fx), ("fy", self.height, self.fy)):
            if 2 * math.atan2(size / 2, focal) > MAX_FIELD_OF_VIEW:
                raise ValueError(f"{name}: should be in pixels, got {focal:g} for an image of {size} pixels")
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraFile:
    """What camera.json says.

    Attributes
    ----------
    camera
        Intrinsics.
    depth_scale
        PNG values per metre.
    up
        (3,) unit vector opposite to gravity, camera frame; ``None`` where the file does not tell.
    notes
        What looks strange but can be used, one sentence each.
    """

    camera: PinholeCamera
    depth_scale: float = 1000.0
    up: Vector | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not (math.isfinite(self.depth_scale) and self.depth_scale > 0):
            raise CalibrationError(
                f"depth_scale must be positive (PNG values per metre, 1000 for mm), got {self.depth_scale:g}"
            )
        if self.up is not None:
            try:
                object.__setattr__(self, "up", readonly(normalized(self.up)))
            except ValueError as error:
                raise CalibrationError(f"up: {error}") from error


def load_camera(path: Path) -> PinholeCamera:
    """Read the intrinsics of a ``camera.json`` (docs/inputs.md).

    Raises
    ------
    CalibrationError
        If the file cannot be read, or a value is missing or impossible.
    """
    return load_camera_file(path).camera


def load_camera_file(path: Path) -> CameraFile:
    """Read camera.json.

    Raises
    ------
    CalibrationError
        If the file cannot be read, it is not JSON, a key is missing or misspelt, or a value is impossible.
    """
    values = _load_json(path)
    _check_keys(values, path)
    try:
        saved = validated(_SavedCameraFile, values)
        camera = PinholeCamera(
            width=saved.width, height=saved.height, fx=saved.fx, fy=saved.fy, cx=saved.cx, cy=saved.cy
        )
        up = None if saved.up is None else np.array(saved.up)
        notes = tuple(f"{path.name}: {note}" for note in _find_oddities(camera, up, values))
        return CameraFile(camera=camera, depth_scale=saved.depth_scale, up=up, notes=notes)
    except (CalibrationError, ValueError) as error:
        raise CalibrationError(f"{path}: {error}") from error


def dump_camera_file(path: Path, contents: CameraFile) -> None:
    """Write camera.json; ``load_camera_file`` reads it back equal.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    camera = contents.camera
    # Numbers computed with numpy are not JSON's.
    values: dict[str, Any] = {"width": int(camera.width), "height": int(camera.height)}
    values |= {key: float(getattr(camera, key)) for key in ("fx", "fy", "cx", "cy")}
    values["depth_scale"] = float(contents.depth_scale)
    if contents.up is not None:
        values["up"] = [float(value) for value in contents.up]
    write_whole_text(path, json.dumps(values, indent=1) + "\n")


def _load_json(path: Path) -> dict[str, Any]:
    if not path.exists():
        raise CalibrationError(
            f"expected {path} with the keys {', '.join(REQUIRED_KEYS)}, but there is no such file; write it "
            "with the depth camera's intrinsics (docs/inputs.md)"
        )
    text = read_text(path, error_type=CalibrationError)
    try:
        values = parse_json(text)
    except json.JSONDecodeError as error:
        raise CalibrationError(f"{path}:{error.lineno}: expected JSON: {error.msg}") from error
    except ValueError as error:
        raise CalibrationError(f"{path}: expected JSON: {quoted(str(error))}") from error
    if not isinstance(values, dict):
        raise CalibrationError(
            f"{path}: expected an object with {', '.join(REQUIRED_KEYS)}, got {quoted(text)}"
        )
    return values


def _check_keys(values: dict[str, Any], path: Path) -> None:
    """Refuse missing keys, and unknown ones that look like a misspelt known one."""
    unknown = [key for key in values if key not in (*REQUIRED_KEYS, "up")]
    lowered = {key.lower().replace("_", ""): key for key in unknown}
    for key in (*REQUIRED_KEYS, "up"):
        if key in values:
            continue
        near = difflib.get_close_matches(key.replace("_", ""), lowered, n=1, cutoff=0.8)
        found = lowered[near[0]] if near else None
        if found is not None:
            raise CalibrationError(f"{path}: expected the key '{key}', found {quoted(found)}; rename it")
        if key == "depth_scale":
            raise CalibrationError(
                f"{path}: expected the key 'depth_scale', PNG values per metre; add \"depth_scale\": 1000 "
                "for images in millimetres, 5000 for TUM RGB-D"
            )
        if key != "up":
            has = ", ".join(list(values)[:12]) or "nothing"
            raise CalibrationError(
                f"{path}: expected the key '{key}'; it must hold {', '.join(REQUIRED_KEYS)}, "
                f"and has {quoted(has)}"
            )


def _find_oddities(camera: PinholeCamera, up: Vector | None, values: dict[str, Any]) -> list[str]:
    notes = [f"the key {quoted(key)} is not used" for key in values if key not in (*REQUIRED_KEYS, "up")]
    if not (0 <= camera.cx <= camera.width - 1 and 0 <= camera.cy <= camera.height - 1):
        notes.append(
            f"the principal point ({camera.cx:g}, {camera.cy:g}) lies outside the image of "
            f"{camera.width}x{camera.height}; are these the intrinsics of another resolution?"
        )
    # Optical y points down, so up has a negative y unless the camera hangs upside down.
    if up is not None and up[1] > 0.5 * np.linalg.norm(up):
        notes.append("up points to the lower side of the image; is it gravity, which is the opposite?")
    return notes
