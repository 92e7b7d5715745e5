"""Which way is up in a cloud: by its level surfaces, which hold more of a building than any other direction.

Floors, ceilings, treads and tables lie level. So along up many points share few heights, and where a cloud
is tilted, the commonest normal near an axis is up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Vector
from stairmap.clouds.thinning import cube_keys
from stairmap.geometry import normalized

AXES = {
    "+x": (1, 0, 0),
    "-x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "-y": (0, -1, 0),
    "+z": (0, 0, 1),
    "-z": (0, 0, -1),
}

LEVEL_BIN = 0.03
"""Heights are counted in bins of this, m: a floor with its noise fills one or two."""

MIN_PREFERENCE = 1.6
"""Another axis than z must hold its points in so many times fewer heights to be taken for up."""

CAMERA_SHARE = 0.995
"""A cloud of which this share lies in front of the origin, within ``CAMERA_SLOPE``, is a depth camera's."""

CAMERA_SLOPE = 1.4
"""Largest distance aside over that ahead in a depth camera's view: 109 degrees across."""

PATCH = 0.12
"""Side of the cubes whose points give a normal, m: half of a tread."""

MIN_PATCH_POINTS = 6
"""Fewest points of a cube that give a normal."""

MAX_PATCH_THICKNESS = 0.25
"""Cubes whose points are thicker than this share of their extent are no plane."""

SAME_NORMAL = np.radians(2.5)
"""Normals within this of each other are of one direction, rad."""

NUM_TRIED = 400
"""Normals that are tried as the commonest direction."""

MIN_SHARE = 0.15
"""Share of the flat patches that must lie level for them to tell up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelDirection:
    """The commonest direction of normals.

    Attributes
    ----------
    up
        (3,) unit vector.
    share
        Share of all flat patches that lie across it.
    """

    up: Vector
    share: float


def is_camera_view(points: Float64Array) -> bool:
    """Tell whether points are what one depth camera at the origin sees along z."""
    ahead = points[:, 2] > 0
    inside = ahead & (np.abs(points[:, :2]).max(axis=1) < CAMERA_SLOPE * points[:, 2])
    return bool(len(points)) and float(np.mean(inside)) >= CAMERA_SHARE


def find_up_axis(points: Float64Array) -> str:
    """Return which axis of (N, 3) points, m, is up: z unless another holds them in fewer heights."""
    if is_camera_view(points):
        return "-y"
    scores = [_concentration(points[:, axis]) for axis in range(3)]
    best = int(np.argmax(scores))
    if best != 2 and scores[best] > MIN_PREFERENCE * scores[2]:
        return "+x" if best == 0 else "+y"
    return "+z"


def _concentration(values: Float64Array) -> float:
    """How few values hold most points: the chance that two points share a bin."""
    # Only bins that hold something: a single stray point may lie any distance away.
    bins, counts = np.unique(np.floor((values - values.min()) / LEVEL_BIN), return_counts=True)
    share = counts / counts.sum()
    # Neighbouring bins count together, wherever a surface falls.
    has_next = np.diff(bins) == 1
    return float(np.sum(share**2) + 2 * np.sum((share[1:] * share[:-1])[has_next]))


def find_level_direction(points: Float32Array, near: Vector, *, max_turn: float) -> LevelDirection | None:
    """Find the commonest normal of flat patches near a direction.

    Parameters
    ----------
    points
        (N, 3) points, m.
    near
        (3,) unit vector that is roughly up.
    max_turn
        How far the normal may be from it, rad.

    Returns
    -------
    ``None`` where too few patches lie across any such direction.
    """
    normals, weights = _patch_normals(points)
    if not len(normals):
        return None
    cosine = normals @ near
    normals = normals * np.sign(np.where(cosine == 0, 1.0, cosine))[:, None]
    is_near = np.abs(cosine) > np.cos(max_turn)
    total = float(weights.sum())
    normals, weights = normals[is_near], weights[is_near]
    if not len(normals):
        return None
    tried = normals[np.argsort(-weights, kind="stable")[:: max(len(weights) // NUM_TRIED, 1)]]
    support = (tried @ normals.T > np.cos(SAME_NORMAL)) @ weights
    up = tried[int(np.argmax(support))]
    for _ in range(5):
        same = normals @ up > np.cos(SAME_NORMAL)
        up = normalized((normals[same] * weights[same, None]).sum(axis=0))
    share = float(weights[normals @ up > np.cos(SAME_NORMAL)].sum()) / total
    return LevelDirection(up=up, share=share) if share >= MIN_SHARE else None


def _patch_normals(points: Float32Array) -> tuple[Float64Array, Float64Array]:
    """(M, 3) normals of the flat cubes, and how many points each has."""
    order = np.argsort(cube_keys(points, PATCH), kind="stable")
    keys = cube_keys(points[order], PATCH)
    begin = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
    count = np.diff(np.append(begin, len(keys)))
    local = points[order].astype(np.float64)
    local -= np.repeat(local[begin], count, axis=0)
    mean = np.add.reduceat(local, begin, axis=0) / count[:, None]
    covariance = np.empty((len(begin), 3, 3))
    for row in range(3):
        for column in range(row, 3):
            product = np.add.reduceat(local[:, row] * local[:, column], begin) / count
            covariance[:, row, column] = covariance[:, column, row] = product - mean[:, row] * mean[:, column]
    keep = count >= MIN_PATCH_POINTS
    values, vectors = np.linalg.eigh(covariance[keep])
    flat = values[:, 0] < MAX_PATCH_THICKNESS**2 * values[:, 1]
    return np.ascontiguousarray(vectors[flat][:, :, 0]), count[keep][flat].astype(np.float64)
