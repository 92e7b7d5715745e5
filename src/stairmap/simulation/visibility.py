"""What of the true stairways a camera could see: what a method can be asked to find."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Points, Transform, Vector, readonly
from stairmap.camera import PinholeCamera
from stairmap.simulation.render import RayCaster
from stairmap.stairway import Flight, rounded
from stairmap.transforms import invert_transform, transform_points

_NUM_SAMPLES = 21
"""Points along a nosing."""

_MIN_SHARE = 0.3
"""Share of a nosing that must be in view for it to count as seen."""

_CLEARANCE = 0.004
"""Height of the sampled points above the nosing, so that its own tread does not hide it, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightVisibility:
    """How one flight appeared over a drive, frame by frame.

    Attributes
    ----------
    distance
        (N,) horizontal distance of the camera from the middle of the nearer end's nosing, m.
    view_angle
        (N,) angle at that nosing between the way the stairs are walked onto and the camera: 0
        straight before it, pi/2 beside it, rad.
    is_descending
        (N,) whether the nearer end is the upper one.
    is_nosing_visible
        (N, K) whether at least 30 % of each nosing lies unhidden in the image, within range.
    """

    distance: Float64Array
    view_angle: Float64Array
    is_descending: Mask
    is_nosing_visible: Mask

    def __post_init__(self) -> None:
        for name, dtype in (
            ("distance", np.float64),
            ("view_angle", np.float64),
            ("is_descending", np.bool_),
            ("is_nosing_visible", np.bool_),
        ):
            object.__setattr__(self, name, readonly(getattr(self, name), dtype))

    @property
    def num_visible_nosings(self) -> IntArray:
        """(N,) number of nosings in view in each frame."""
        return np.asarray(self.is_nosing_visible.sum(axis=1), dtype=np.int64)

    @property
    def num_nosings_seen(self) -> int:
        """Number of nosings in view in at least one frame."""
        return int(self.is_nosing_visible.any(axis=0).sum())

    def num_frames_within(self, distance: float, view_angle: float, *, min_nosings: int = 3) -> int:
        """Return in how many frames enough nosings were in view within a distance, m, and angle, rad."""
        near = (self.distance <= distance) & (self.view_angle <= view_angle)
        return int(np.count_nonzero(near & (self.num_visible_nosings >= min_nosings)))

    def to_dict(self) -> dict[str, Any]:
        """Return the visibility as it stands in ``truth.json``."""
        return {
            "distance": rounded(self.distance),
            "view_angle": rounded(self.view_angle),
            "is_descending": self.is_descending.tolist(),
            "num_visible_nosings": self.num_visible_nosings.tolist(),
            "is_nosing_seen": self.is_nosing_visible.any(axis=0).tolist(),
            "num_nosings_seen": self.num_nosings_seen,
        }


def measure_visibility(
    flight: Flight, caster: RayCaster, camera: PinholeCamera, map_from_camera: Float64Array, max_depth: float
) -> FlightVisibility:
    """Return how a flight appears from true poses.

    Parameters
    ----------
    flight
        True flight; its ``steps`` hold the nosings.
    caster
        The scene.
    camera
        Intrinsics.
    map_from_camera
        (N, 4, 4) true poses.
    max_depth
        Range of the sensor, m.
    """
    nosings = np.array([step.nosing for step in flight.steps])
    share = np.linspace(0.02, 0.98, _NUM_SAMPLES)[:, None]
    samples = nosings[:, None, 0] * (1 - share) + nosings[:, None, 1] * share + [0.0, 0.0, _CLEARANCE]
    approaches = [find_approach(flight, nosings, pose[:3, 3]) for pose in map_from_camera]
    return FlightVisibility(
        distance=np.array([approach[0] for approach in approaches]),
        view_angle=np.array([approach[1] for approach in approaches]),
        is_descending=np.array([approach[2] for approach in approaches]),
        is_nosing_visible=np.array(
            [_find_visible_nosings(samples, caster, camera, pose, max_depth) for pose in map_from_camera]
        ),
    )


def find_approach(flight: Flight, nosings: Points, eye: Vector) -> tuple[float, float, bool]:
    """Return distance and view angle of an eye from the nearer end, and whether that is the upper one.

    Parameters
    ----------
    flight, nosings
        The flight, and its (K, 2, 3) nosings, map, m.
    eye
        (3,) where the sensor is, map, m.
    """
    bottom, top = nosings[0].mean(axis=0), nosings[-1].mean(axis=0)
    is_descending = bool((eye - (bottom + top) / 2) @ flight.forward > 0)
    end, outward = (top, flight.forward) if is_descending else (bottom, -flight.forward)
    offset = (eye - end)[:2]
    along = float(offset @ outward[:2])
    across = float(outward[0] * offset[1] - outward[1] * offset[0])
    return float(np.hypot(along, across)), float(abs(np.arctan2(across, along))), is_descending


def _find_visible_nosings(
    samples: Points, caster: RayCaster, camera: PinholeCamera, map_from_camera: Transform, max_depth: float
) -> Mask:
    """(K,) whether enough of the (K, M, 3) points of each nosing is in view."""
    in_camera = transform_points(invert_transform(map_from_camera), samples)
    with np.errstate(invalid="ignore"):
        pixels = camera.project(in_camera)
        inside = (in_camera[..., 2] > 0) & (in_camera[..., 2] <= max_depth)
        inside &= (pixels[..., 0] >= -0.5) & (pixels[..., 0] <= camera.width - 0.5)
        inside &= (pixels[..., 1] >= -0.5) & (pixels[..., 1] <= camera.height - 0.5)
    if inside.any():
        inside[inside] = caster.is_visible(map_from_camera[:3, 3], samples[inside])
    return np.asarray(inside.mean(axis=1) >= _MIN_SHARE)
