"""Align the sweeps of a window with each other: what odometry shakes within a second would blur a step.

The sweeps so far are kept as planes in cubes, as in Yuan et al., "Efficient and Probabilistic Adaptive Voxel
Mapping", RA-L 7(3), 2022, but simpler. A new sweep is moved until its points lie on these planes, held by how
well poses are known: along a corridor only the poses tell.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Points, Transform
from stairmap.transforms import rotation_from_vector, transform_from_parts

CUBE = 0.25
"""Side of a cube, m: about a tread, so that treads and risers have planes of their own."""

CORNER = np.array([0.097, 0.113, 0.119])
"""Where the cubes begin, m: the floor of most maps is at zero, and would lie half in one cube, half in
another."""

MIN_POINTS = 8
"""Fewest points of a plane."""

MAX_THICKNESS = 0.035
"""Largest standard deviation of a cube's points across their plane, m: two sigma of a LiDAR's noise. An edge
is thicker."""

MAX_LENGTH_SHARE, MAX_WIDTH_SHARE = 0.25, 0.6
"""Largest shares of the thickness in the plane's larger and smaller extent (as standard deviations): a line
is no plane."""

MAX_DISTANCE = 0.10
"""Points farther from their cube's plane, m, are not on it."""

MAX_USED = 3000
"""Most points of a sweep that are aligned; more tell nothing new."""

NUM_ROUNDS = 4
"""Rounds of moving: each halves the error at least."""

POINT_STD = 0.03
"""Standard deviation of a point from its plane, m, with what planes of few points are off."""

POINTS_PER_SAMPLE = 20.0
"""Points that count as one: those on one plane err together."""

TURN_STD, SHIFT_STD = float(np.radians(1.0)), 0.02
"""How far two sweeps of a window may be off each other by their poses, rad and m: standard deviations."""

_BITS = 20
_HALF = 1 << (_BITS - 1)


class PlaneMap:
    """Planes in cubes, from points that come in sweep by sweep."""

    def __init__(self) -> None:
        self._keys: IntArray = np.zeros(0, dtype=np.int64)
        self._sums: Float64Array = np.zeros((0, 10))
        self._planes: tuple[Points, Points, Mask] | None = None
        self._thickness: Float64Array = np.zeros(0)

    def add(self, points: Points) -> None:
        """Take in (N, 3) points, m."""
        keys, index = np.unique(cube_keys(points), return_inverse=True)
        # About the cube's middle: squares of large coordinates would lose what counts.
        local = points - cube_middles(keys)[index]
        x, y, z = local.T
        terms = (np.ones(len(x)), x, y, z, x * x, x * y, x * z, y * y, y * z, z * z)
        sums = np.stack([np.bincount(index, term, minlength=len(keys)) for term in terms], axis=1)
        merged, place = np.unique(np.concatenate([self._keys, keys]), return_inverse=True)
        total = np.zeros((len(merged), 10))
        total[place[: len(self._keys)]] = self._sums
        total[place[len(self._keys) :]] += sums
        self._keys, self._sums, self._planes = merged, total, None

    def planes(self) -> tuple[Points, Points, Mask]:
        """Return for each cube a (K, 3) point and a (K, 3) unit normal of its plane, and (K,) if it has
        one."""
        if self._planes is None:
            chosen = np.flatnonzero(self._sums[:, 0] >= MIN_POINTS)
            sums = self._sums[chosen]
            mean = sums[:, 1:4] / sums[:, :1]
            second = sums[:, [4, 5, 6, 5, 7, 8, 6, 8, 9]].reshape(-1, 3, 3) / sums[:, :1, None]
            spread, normal = _thinnest(second - mean[:, :, None] * mean[:, None, :])
            std = np.sqrt(np.maximum(spread, 0.0))
            is_flat = (std[:, 0] < MAX_THICKNESS) & (std[:, 0] < MAX_LENGTH_SHARE * std[:, 2])
            is_flat &= std[:, 0] < MAX_WIDTH_SHARE * std[:, 1]
            anchors, normals = np.zeros((len(self._keys), 3)), np.zeros((len(self._keys), 3))
            anchors[chosen] = mean + cube_middles(self._keys[chosen])
            normals[chosen] = normal
            is_plane = np.zeros(len(self._keys), dtype=bool)
            is_plane[chosen] = is_flat
            self._thickness = std[is_flat, 0]
            self._planes = anchors, normals, is_plane
        return self._planes

    def weights(self) -> Float64Array:
        """Return the (K,) number of points of each cube."""
        return np.asarray(self._sums[:, 0])

    def noise(self) -> float | None:
        """Return the median thickness of the planes, as a standard deviation, m: the noise of a point.

        ``None`` without planes.
        """
        self.planes()
        return float(np.median(self._thickness)) if len(self._thickness) else None

    def align(self, points: Points, middle: Points) -> Transform:
        """Return the (4, 4) small motion that puts (N, 3) points onto the planes.

        Parameters
        ----------
        points
            A sweep by its poses.
        middle
            (3,) where the LiDAR was: the point that the motion turns about.
        """
        motion = np.eye(4)
        if not len(self._keys):
            return motion
        anchors, normals, is_plane = self.planes()
        used = points[evenly(len(points), MAX_USED)] - middle
        held = np.diag([*(1 / TURN_STD**2,) * 3, *(1 / SHIFT_STD**2,) * 3])
        for _ in range(NUM_ROUNDS):
            moved = used @ motion[:3, :3].T + motion[:3, 3]
            place = np.minimum(np.searchsorted(self._keys, cube_keys(moved + middle)), len(self._keys) - 1)
            known = (self._keys[place] == cube_keys(moved + middle)) & is_plane[place]
            chosen, place = moved[known], place[known]
            normal = normals[place]
            off = np.einsum("ij,ij->i", normal, chosen + middle - anchors[place])
            near = np.abs(off) < MAX_DISTANCE
            chosen, normal, off = chosen[near], normal[near], off[near]
            rows = np.concatenate([np.cross(chosen, normal), normal], axis=1)
            # Huber: a point two deviations off counts less.
            weight = np.minimum(1.0, 2.0 * POINT_STD / np.maximum(np.abs(off), 1e-9))
            weight /= POINT_STD**2 * POINTS_PER_SAMPLE
            so_far = _small(motion)
            step = np.linalg.solve(
                rows.T @ (rows * weight[:, None]) + held, -rows.T @ (weight * off) - held @ so_far
            )
            motion = transform_from_parts(rotation_from_vector(step[:3]), step[3:]) @ motion
            if np.abs(step).max() < 2e-4:
                break
        about = np.eye(4)
        about[:3, 3] = middle
        back = np.eye(4)
        back[:3, 3] = -middle
        return np.asarray(about @ motion @ back)


def _thinnest(covariance: Float64Array) -> tuple[Float64Array, Points]:
    """Ascending (N, 3) variances along the axes of (N, 3, 3) covariances, and the (N, 3) axis of the least.

    In closed form (Smith, "Eigenvalues of a symmetric 3 x 3 matrix", CACM 4(4), 1961): ten times as fast as
    one by one.
    """
    mean = np.trace(covariance, axis1=1, axis2=2) / 3.0
    shifted = covariance - mean[:, None, None] * np.eye(3)
    size = np.sqrt(np.maximum(np.einsum("nij,nij->n", shifted, shifted) / 6.0, 1e-300))
    angle = np.arccos(np.clip(np.linalg.det(shifted / size[:, None, None]) / 2.0, -1.0, 1.0)) / 3.0
    turns = 2 * np.pi / 3 * np.array([1.0, -1.0, 0.0])
    variances = mean[:, None] + 2.0 * size[:, None] * np.cos(angle[:, None] + turns)
    variances = np.sort(variances, axis=1)
    rows = covariance - variances[:, :1, None] * np.eye(3)
    # The axis is perpendicular to all rows: the longest of their products is the surest.
    products = np.cross(rows[:, [0, 1, 2]], rows[:, [1, 2, 0]])
    lengths = np.linalg.norm(products, axis=2)
    best = np.argmax(lengths, axis=1)
    every = np.arange(len(best))
    axis = products[every, best] / np.maximum(lengths[every, best], 1e-300)[:, None]
    return variances, axis


def evenly(num: int, max_num: int) -> IntArray:
    """Return indices of at most ``max_num`` of ``num`` points, the same ones each time, in their order.

    They are drawn: every second point of a spinning LiDAR is of every second laser.
    """
    if num <= max_num:
        return np.arange(num)
    return np.asarray(np.sort(np.random.default_rng(num).permutation(num)[:max_num]))


def _small(motion: Transform) -> Float64Array:
    """A small motion as three turns and three shifts."""
    turn = motion[:3, :3]
    vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.concatenate([vector, motion[:3, 3]])


def cube_keys(points: Points) -> IntArray:
    """Return the (N,) number of the cube that each of (N, 3) points is in."""
    cubes = np.floor((points + CORNER) * (1.0 / CUBE)).astype(np.int64) + _HALF
    return np.asarray((cubes[:, 0] << (2 * _BITS)) | (cubes[:, 1] << _BITS) | cubes[:, 2])


def cube_middles(keys: IntArray) -> Points:
    """Return the (N, 3) middles of cubes."""
    mask = (1 << _BITS) - 1
    cubes = np.stack([keys >> (2 * _BITS), (keys >> _BITS) & mask, keys & mask], axis=1) - _HALF
    return np.asarray((cubes + 0.5) * CUBE - CORNER)
