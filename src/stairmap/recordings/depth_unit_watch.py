"""Notice depth in another unit than it is read in, by the camera's own way.

A camera that moves by 0.3 m sees what lies ahead come nearer by 0.3 m. Depth that is read four times too
large, such
as the raw 0.25 mm of an L515 taken for millimetres, comes nearer by 1.2 m. So each unit in use is tried:
depth of one image, moved by the poses into a later one, must lie where that one measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import DepthImage, Float64Array, Mask, Points, Transform
from stairmap.camera import PinholeCamera
from stairmap.transforms import invert_transform

AS_READ = 1.0
"""Depth is as it is read."""

FACTORS = (AS_READ, 0.25, 0.2, 0.125, 0.1, 0.001)
"""By what depth may have to be multiplied: values of 0.25 mm (L515), 0.2 mm (TUM), 0.125 mm (L500), 0.1 mm
(D405) that were read as millimetres, and floating-point millimetres that were read as metres."""

MIN_MOVE, MAX_MOVE = 0.3, 1.0
"""Images are compared whose cameras are so far apart, m: less tells nothing, more shows something else."""

MAX_TURN_COSINE = np.cos(np.radians(25.0))
"""The view may have turned by so much between two images."""

MAX_KEPT_AGE_NS = 10_000_000_000
"""An image is compared with one that is not older than this, nanoseconds."""

COLUMNS_COMPARED = 48
"""Images are thinned to about so many columns."""

RELATIVE_TOLERANCE = 0.04
"""Depth agrees if it is off by less than this share: noise of a Kinect at 4 m, and half a pixel of a
floor."""

MIN_PAIRS, MAX_PAIRS = 3, 12
"""Fewest pairs that decide, and how many are asked at most: the unit does not change."""

MIN_TELLING = 0.1
"""Smallest share of the points on which a unit and the one that was read differ. A floor along which the
camera moves tells nothing."""

MIN_AGREEING = 0.85
"""A unit is told if it is the right one of the two for so large a share of the points on which they
differ."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthUnitMistake:
    """Depth that is in another unit than it was read in.

    Attributes
    ----------
    factor
        By what depth must be multiplied.
    agreeing
        Share of the depth on which the two units differ that agrees with it, and not with the one that was
        read.
    """

    factor: float
    agreeing: float

    def __str__(self) -> str:
        return (
            f"depth fits the camera's way only if it is {self.factor:g} times what was read: the images are "
            f"in another unit ({100 * self.agreeing:.0f} % of the depth that can tell says so)"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _KeptImage:
    """An image that waits for one from farther on: (N, 3) points, m as read, and its pose."""

    stamp_ns: int
    points: Points
    map_from_camera: Transform


class DepthUnitWatch:
    """Watches images with poses pass by and tells if their depth is in another unit."""

    def __init__(self) -> None:
        self._kept: _KeptImage | None = None
        self._verdicts: list[Float64Array] = []

    @property
    def is_sure(self) -> bool:
        """Whether further images would tell nothing new."""
        return len(self._verdicts) >= MAX_PAIRS

    def add(
        self, depth: DepthImage, camera: PinholeCamera, stamp_ns: int, map_from_camera: Transform
    ) -> None:
        """Take in a (height, width) image, m as read, with its (4, 4) pose."""
        if self.is_sure:
            return
        kept = self._kept
        if kept is not None and 0 <= stamp_ns - kept.stamp_ns <= MAX_KEPT_AGE_NS:
            way = np.linalg.norm(map_from_camera[:3, 3] - kept.map_from_camera[:3, 3])
            has_turned = map_from_camera[:3, 2] @ kept.map_from_camera[:3, 2] < MAX_TURN_COSINE
            if way < MIN_MOVE and not has_turned:
                return
            if way <= MAX_MOVE and not has_turned:
                later_from_kept = invert_transform(map_from_camera) @ kept.map_from_camera
                self._verdicts.append(_compare_units(later_from_kept, kept.points, depth, camera))
        stride = max(1, camera.width // COLUMNS_COMPARED)
        points = camera.strided(stride).unproject(depth[::stride, ::stride]).reshape(-1, 3)
        points = points[np.isfinite(points[:, 2])]
        self._kept = _KeptImage(stamp_ns=stamp_ns, points=points, map_from_camera=map_from_camera)

    def mistake(self) -> DepthUnitMistake | None:
        """Return what is wrong with the unit; ``None`` if nothing is, or nothing tells."""
        if len(self._verdicts) < MIN_PAIRS:
            return None
        shares = np.mean(self._verdicts, axis=0)
        telling = shares.sum(axis=1)
        with np.errstate(invalid="ignore"):
            agreeing = np.where(telling >= MIN_TELLING, shares[:, 0] / telling, 0.0)
        best = int(np.argmax(shares[:, 0] - shares[:, 1]))
        if agreeing[best] < MIN_AGREEING:
            return None
        return DepthUnitMistake(factor=FACTORS[best], agreeing=float(agreeing[best]))

    def advice(self) -> str | None:
        """Return what is wrong with a recording's unit, and what mends it; ``None`` if nothing is."""
        mistake = self.mistake()
        if mistake is None:
            return None
        return (
            f"{mistake}; give a camera.json with a depth_scale {1 / mistake.factor:g} times as large "
            f"({1000 / mistake.factor:g} instead of 1000), for a bag with --camera"
        )


def _compare_units(
    later_from_earlier: Transform, points: Points, later: DepthImage, camera: PinholeCamera
) -> Float64Array:
    """Compare each unit with the one that was read.

    Returns
    -------
    (len(FACTORS), 2) shares of the points that agree only if multiplied, and only as they were read.
    """
    as_read, known_as_read = _find_agreeing(later_from_earlier, points, later, camera)
    shares = np.zeros((len(FACTORS), 2))
    for index, factor in enumerate(FACTORS):
        # Depth that is multiplied moves by less: the same as if the camera had moved by more.
        scaled = later_from_earlier.copy()
        scaled[:3, 3] /= factor
        agrees, known = _find_agreeing(scaled, points, later, camera)
        both = known & known_as_read
        if both.any():
            shares[index] = np.mean(agrees[both] & ~as_read[both]), np.mean(as_read[both] & ~agrees[both])
    return shares


def _find_agreeing(
    later_from_earlier: Transform, points: Points, later: DepthImage, camera: PinholeCamera
) -> tuple[Mask, Mask]:
    """Tell which of the (N, 3) points lie where the later image measured, and which of them it can tell
    of."""
    moved = points @ later_from_earlier[:3, :3].T + later_from_earlier[:3, 3]
    pixels = camera.project(moved)
    with np.errstate(invalid="ignore"):
        known = (
            (moved[:, 2] > 0)
            & (pixels >= 0).all(axis=1)
            & (pixels <= (camera.width - 1, camera.height - 1)).all(axis=1)
        )
    columns, rows = np.rint(pixels[known]).astype(np.int64).T
    measured = np.full(len(points), np.nan)
    measured[known] = later[rows, columns]
    known &= np.isfinite(measured)
    with np.errstate(invalid="ignore"):
        agrees = np.abs(measured - moved[:, 2]) < RELATIVE_TOLERANCE * moved[:, 2]
    return agrees & known, known
