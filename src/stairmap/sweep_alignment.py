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

MIN_FLATNESS = 0.25
"""Largest share of the thickness in the plane's smaller extent (as standard deviations): a line is no
plane."""

MAX_DISTANCE = 0.10
"""Points farther from their cube's plane, m, are not on it."""

MAX_USED = 4000
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
            count = np.maximum(self._sums[:, 0], 1.0)
            mean = self._sums[:, 1:4] / count[:, None]
            second = self._sums[:, [4, 5, 6, 5, 7, 8, 6, 8, 9]].reshape(-1, 3, 3) / count[:, None, None]
            spread, axes = np.linalg.eigh(second - mean[:, :, None] * mean[:, None, :])
            std = np.sqrt(np.maximum(spread, 0.0))
            is_plane = (self._sums[:, 0] >= MIN_POINTS) & (std[:, 0] < MAX_THICKNESS)
            is_plane &= std[:, 0] < MIN_FLATNESS * std[:, 2]
            is_plane &= std[:, 0] < 0.6 * std[:, 1]
            self._planes = mean + cube_middles(self._keys), axes[:, :, 0], np.asarray(is_plane)
        return self._planes

    def weights(self) -> Float64Array:
        """Return the (K,) number of points of each cube."""
        return np.asarray(self._sums[:, 0])

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
