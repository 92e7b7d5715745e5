"""What depth sensors do to an exact depth image, one effect at a time.

Lateral effects move edges, never planes: a pixel that takes its value from a
neighbour extends the neighbour's plane to its own ray. The published axial noise was
measured on planes and already holds what lateral noise does there.
"""

from __future__ import annotations

import cv2
import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.simulation.render import Rendering

EDGE_DROPOUT = 0.09
"""Share of pixels missing on depth edges; 7-11 % were measured (docs/evaluation.md, sensors)."""

_MAX_ANGLE = np.radians(85.0)
"""Angle of incidence at which noise formulas with a pole at 90 deg are held."""


def grazing_ratio(incidence: Float64Array) -> Float64Array:
    """Return θ/(π/2 − θ) of angles in rad, held at its value for 85 deg."""
    angle = np.minimum(incidence, _MAX_ANGLE)
    return np.asarray(angle / (np.pi / 2 - angle))


def find_jumps(rendering: Rendering, *, min_jump: float = 0.02, min_ratio: float = 0.01) -> Mask:
    """Return the (height, width) pixels on either side of a depth jump.

    Neighbours are a jump when neither one's plane, extended to the other's ray, comes within
    ``min_jump`` m plus ``min_ratio`` of the depth. A crease or a steep floor is none.
    """
    depth, normals = rendering.depth, rendering.normals
    cosine = _cosines(rendering)
    jumps = np.zeros(depth.shape, dtype=bool)
    for axis, component, focal in ((1, 0, rendering.camera.fx), (0, 1, rendering.camera.fy)):
        here = (slice(None), slice(None, -1)) if axis == 1 else (slice(None, -1), slice(None))
        there = (slice(None), slice(1, None)) if axis == 1 else (slice(1, None), slice(None))
        slope = normals[..., component] / focal
        with np.errstate(divide="ignore", invalid="ignore"):
            forward = depth[here] * cosine[here] / (cosine[here] + slope[here])
            backward = depth[there] * cosine[there] / (cosine[there] - slope[there])
            limit = min_jump + min_ratio * np.minimum(depth[here], depth[there])
            smooth = (np.abs(forward - depth[there]) <= limit) | (np.abs(backward - depth[here]) <= limit)
        both_missing = np.isnan(depth[here]) & np.isnan(depth[there])
        jump = ~smooth & ~both_missing
        jumps[here] |= jump
        jumps[there] |= jump
    return jumps


def shifted_laterally(rendering: Rendering, sigma: Float64Array, random: np.random.Generator) -> Float64Array:
    """Return the depth with every pixel looking a random way aside.

    Parameters
    ----------
    rendering
        Exact image.
    sigma
        (height, width) standard deviation of the shift along each image axis, px.
    random
        Source of the shifts.
    """
    depth = rendering.depth
    height, width = depth.shape
    shift = random.standard_normal((2, height, width), dtype=np.float32) * np.nan_to_num(sigma)
    v, u = np.indices(depth.shape)
    source_u = np.clip(np.rint(u + shift[0]).astype(np.int64), 0, width - 1)
    source_v = np.clip(np.rint(v + shift[1]).astype(np.int64), 0, height - 1)
    source = source_v * width + source_u
    cosine = _cosines(rendering).ravel()[source]
    normals = rendering.normals.reshape(-1, 3)[source]
    seen = depth.ravel()[source]
    own_cosine = (
        cosine
        + normals[..., 0] * (u - source_u) / rendering.camera.fx
        + normals[..., 1] * (v - source_v) / rendering.camera.fy
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        extended = seen * cosine / own_cosine
    # A plane seen nearly edge on leaves the image's depths within a pixel: keep the neighbour's depth.
    return np.asarray(np.where(np.abs(extended - seen) <= 0.05 * seen, extended, seen))


def correlated_noise(shape: tuple[int, int], sigma_px: float, random: np.random.Generator) -> Float64Array:
    """Return Gaussian noise of unit variance, smoothed by a Gaussian of ``sigma_px``.

    Its autocorrelation falls to 1/e at 2·``sigma_px``.
    """
    margin = int(np.ceil(4 * sigma_px))
    white = random.standard_normal((shape[0] + 2 * margin, shape[1] + 2 * margin), dtype=np.float32)
    kernel = cv2.getGaussianKernel(2 * margin + 1, sigma_px)
    smooth = cv2.sepFilter2D(white, cv2.CV_64F, kernel, kernel)
    gain = float((kernel**2).sum())
    return np.asarray(smooth[margin : margin + shape[0], margin : margin + shape[1]] / gain)


def drop_grazing(
    depth: Float64Array, incidence: Float64Array, start: float, end: float, random: np.random.Generator
) -> None:
    """Remove pixels seen at a grazing angle, in place: none at ``start`` rad, all from ``end`` rad."""
    chance = (np.nan_to_num(incidence) - start) / (end - start)
    depth[random.random(depth.shape, dtype=np.float32) < chance] = np.nan


def drop_randomly(depth: Float64Array, where: Mask, share: float, random: np.random.Generator) -> None:
    """Remove a share of the pixels of a mask, in place."""
    depth[where & (random.random(depth.shape, dtype=np.float32) < share)] = np.nan


def drop_out_of_range(depth: Float64Array, min_depth: float, max_depth: float) -> None:
    """Remove what is nearer or farther than a sensor measures, in place, m."""
    with np.errstate(invalid="ignore"):
        depth[(depth < min_depth) | (depth > max_depth)] = np.nan


def _cosines(rendering: Rendering) -> Float64Array:
    """(height, width) dot product of normal and ray (ray with z = 1), negative."""
    rays = rendering.camera.rays()
    return np.asarray(np.einsum("ijk,ijk->ij", rendering.normals, rays))
