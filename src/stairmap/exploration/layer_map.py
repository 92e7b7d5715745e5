"""The map of one level of a building while a robot explores it: free, occupied, unknown, drop.

Cells gather votes of frames, one a frame, kind and cell. Ground that nobody saw is unknown, and unknown is
not free.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import IntArray, Mask, Points
from stairmap.exploration.odometry import Planar
from stairmap.exploration.scans import DROP, FLOOR, HIGH, OBSTACLE, Scan
from stairmap.exploration.state_file import State
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

RESOLUTION = 0.05
"""Size of a cell, m."""

GROWTH = 10.0
"""By how much a map grows at a time, m."""

MIN_OBSTACLE_VOTES = 2
MIN_OBSTACLE_SHARE = 0.25
"""Frames that must see an obstacle in a cell, and at least so many of those that saw floor there."""

CLOSING = 5
"""Gaps in the floor narrower than this are closed, cells: rows of pixels far off, slits below doors."""

FORGOTTEN_TRAIL = 0.35
"""So near to what stopped the robot it forgets that it passed there before, m: its body and some drift."""

SEEN_OVER = 0.35
"""What is lower hides nothing of what stands behind it, m: no camera is lower."""

MAX_SLIT = 3
"""Drops narrower than this are slits that a foot does not fall into, cells."""


class LayerMap:
    """Votes of frames on a grid that grows.

    Parameters
    ----------
    height
        Of the level's ground, m, map.
    """

    def __init__(self, height: float) -> None:
        self.height = height
        self.num_changes = 0
        self._grid: OccupancyGrid | None = None
        self._low = np.zeros(2, dtype=np.int64)
        self._votes = np.zeros((3, 0, 0), dtype=np.uint16)
        self._trail = np.zeros((0, 0), dtype=np.bool_)
        self._settled = np.zeros((0, 0), dtype=np.bool_)
        self._stops = np.zeros((0, 0), dtype=np.bool_)
        self._forgotten = np.zeros((0, 0), dtype=np.bool_)
        self._tops = np.zeros((0, 0), dtype=np.float32)

    def add(self, scan: Scan, pose: Planar, *, radius: float) -> None:
        """Take in a scan of a robot that stood on this level at a pose, with a body of this radius, m."""
        self._note_change()
        is_low = scan.kinds != HIGH
        cells = np.floor(scan.placed(pose)[is_low, :2] / RESOLUTION).astype(np.int64)
        own = self._disc(pose.x, pose.y, radius)
        cells = np.concatenate([cells, own])
        kinds = np.concatenate(
            [scan.kinds[is_low].astype(np.int64), np.full(len(own), FLOOR, dtype=np.int64)]
        )
        self._grow(cells)
        cells = cells - self._low
        columns = self._votes.shape[2]
        flat = (kinds * self._votes.shape[1] + cells[:, 1]) * columns + cells[:, 0]
        flat = np.unique(flat)
        votes = self._votes.reshape(-1)
        votes[flat] = np.minimum(votes[flat].astype(np.int64) + 1, 60_000).astype(np.uint16)
        is_obstacle = scan.kinds[is_low] == OBSTACLE
        at = cells[: len(is_obstacle)][is_obstacle]
        np.maximum.at(self._tops, (at[:, 1], at[:, 0]), scan.points[is_low][is_obstacle, 2])
        own = own - self._low
        self._trail[own[:, 1], own[:, 0]] = True
        self._forgotten[own[:, 1], own[:, 0]] = False
        self._stops[own[:, 1], own[:, 0]] = False

    def clear(self) -> None:
        """Forget all votes; what was settled too."""
        self._note_change()
        self._votes[:] = 0
        self._trail[:] = False
        self._settled[:] = self._stops[:] = self._forgotten[:] = False
        self._tops[:] = 0.0

    def settle(self, points: Points, radius: float) -> None:
        """Note that unknown ground about (N, 2) points was looked at from near and stayed unknown."""
        self._note_change()
        for x, y in np.atleast_2d(points)[:, :2]:
            cells = self._disc(float(x), float(y), radius)
            self._grow(cells)
            cells = cells - self._low
            self._settled[cells[:, 1], cells[:, 0]] = True

    def block(self, points: Points) -> None:
        """Note that (N, 2) points stopped the robot, whatever earlier frames said of them."""
        if not len(points):
            return
        self._note_change()
        cells = np.floor(np.asarray(points)[:, :2] / RESOLUTION).astype(np.int64)
        self._grow(cells)
        cells = cells - self._low
        self._stops[cells[:, 1], cells[:, 0]] = True
        # Where it was by the poses of then it cannot be by those of now.
        for x, y in np.unique(np.round(np.asarray(points)[:, :2], 1), axis=0):
            near = self._disc(float(x), float(y), FORGOTTEN_TRAIL)
            self._grow(near)
            near = near - self._low
            self._forgotten[near[:, 1], near[:, 0]] = True

    def forgive(self) -> bool:
        """Forget what stopped the robot: it may have moved. Return whether there was any."""
        if not self._stops.any():
            return False
        self._note_change()
        self._stops[:] = self._forgotten[:] = False
        return True

    def state(self) -> State:
        """Return all that is known, to go on from."""
        return {
            "low": self._low.copy(),
            "votes": self._votes.copy(),
            "tops": self._tops.copy(),
            "masks": np.stack([self._trail, self._settled, self._stops, self._forgotten]),
        }

    def restore(self, state: State) -> None:
        """Go on from a state.

        Raises
        ------
        ValueError
            If its arrays do not belong together.
        """
        votes, tops, masks = (np.array(state[name]) for name in ("votes", "tops", "masks"))
        types = [str(array.dtype) for array in (votes, tops, masks)]
        if types != ["uint16", "float32", "bool"]:
            raise ValueError(f"a map has arrays of the types {types}")
        shape = votes.shape[1:]
        if votes.ndim != 3 or len(votes) != 3 or tops.shape != shape or masks.shape != (4, *shape):
            raise ValueError(f"a map has votes {votes.shape}, heights {tops.shape} and masks {masks.shape}")
        self._note_change()
        self._low = np.array(state["low"], dtype=np.int64).reshape(2)
        self._votes, self._tops = votes, tops
        self._trail, self._settled, self._stops, self._forgotten = (mask.copy() for mask in masks)

    @property
    def settled(self) -> Mask:
        """(rows, columns) where looking again gives nothing."""
        return self._settled

    @property
    def tops(self) -> NDArray[np.float32]:
        """(rows, columns) height of the highest point seen on each cell above the level, m; 0 without one."""
        return self._tops

    @property
    def trail(self) -> Mask:
        """(rows, columns) where the robot's body was."""
        return self._trail & ~self._forgotten

    def grid(self) -> OccupancyGrid:
        """Return the map; drops are occupied in it. It is kept until something changes."""
        if self._grid is None:
            self._grid = self._make_grid()
        return self._grid

    def _note_change(self) -> None:
        self.num_changes += 1
        self._grid = None

    def _make_grid(self) -> OccupancyGrid:
        if not self._trail.size:
            nothing = np.full((1, 1), UNKNOWN, dtype=np.int8)
            return OccupancyGrid(cells=nothing, resolution=RESOLUTION, origin=(0.0, 0.0))
        floor, obstacle, drop = (self._votes[kind].astype(np.int32) for kind in (FLOOR, OBSTACLE, DROP))
        is_obstacle = _are_obstacles(floor, obstacle)
        is_drop = _wide(drop > floor, MAX_SLIT)
        seen = cv2.morphologyEx(
            ((floor > 0) & ~is_drop).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((CLOSING, CLOSING), np.uint8)
        )
        cells = np.full(floor.shape, UNKNOWN, dtype=np.int8)
        cells[seen > 0] = FREE
        cells[is_drop] = OCCUPIED
        cells[is_obstacle] = OCCUPIED
        cells[self.trail & ~is_drop] = FREE
        cells[self._stops] = OCCUPIED
        low = self._low * RESOLUTION
        return OccupancyGrid(cells=cells, resolution=RESOLUTION, origin=(float(low[0]), float(low[1])))

    def drops(self) -> Mask:
        """Return the (rows, columns) cells where the ground lies lower."""
        if not self._trail.size:
            return np.zeros((1, 1), dtype=np.bool_)
        floor, drop = self._votes[FLOOR].astype(np.int32), self._votes[DROP].astype(np.int32)
        return _wide(drop > floor, MAX_SLIT)

    def opaque(self) -> Mask:
        """Return the (rows, columns) cells with obstacles that hide what is behind them."""
        floor, obstacle = self._votes[FLOOR].astype(np.int32), self._votes[OBSTACLE].astype(np.int32)
        return _are_obstacles(floor, obstacle) & (self._tops > SEEN_OVER)

    def _disc(self, x: float, y: float, radius: float) -> IntArray:
        reach = math.ceil(radius / RESOLUTION)
        steps = np.arange(-reach, reach + 1)
        offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        offsets = offsets[np.hypot(offsets[:, 0], offsets[:, 1]) * RESOLUTION <= radius]
        return np.asarray(offsets + np.floor(np.array([x, y]) / RESOLUTION).astype(np.int64))

    def _grow(self, cells: IntArray) -> None:
        """Make room for (N, 2) columns and rows, with a border."""
        low, high = cells.min(axis=0) - CLOSING, cells.max(axis=0) + CLOSING + 1
        rows, columns = self._votes.shape[1:]
        if rows and np.all(low >= self._low) and np.all(high <= self._low + np.array([columns, rows])):
            return
        extra = round(GROWTH / RESOLUTION)
        old_low = self._low.copy()
        old_high = self._low + np.array([columns, rows])
        if not rows:
            old_low, old_high = low, high
        new_low = np.where(low < old_low, low - extra, old_low)
        new_high = np.where(high > old_high, high + extra, old_high)
        shape = (int(new_high[1] - new_low[1]), int(new_high[0] - new_low[0]))
        votes = np.zeros((3, *shape), dtype=np.uint16)
        trail, settled, stops, forgotten = (np.zeros(shape, dtype=np.bool_) for _ in range(4))
        tops = np.zeros(shape, dtype=np.float32)
        if rows:
            at = self._low - new_low
            window = np.s_[at[1] : at[1] + rows, at[0] : at[0] + columns]
            votes[:, window[0], window[1]] = self._votes
            trail[window], settled[window] = self._trail, self._settled
            stops[window], forgotten[window] = self._stops, self._forgotten
            tops[window] = self._tops
        self._low, self._votes, self._trail, self._settled = new_low, votes, trail, settled
        self._stops, self._forgotten, self._tops = stops, forgotten, tops


def _are_obstacles(floor: IntArray, obstacle: IntArray) -> Mask:
    return np.asarray((obstacle >= MIN_OBSTACLE_VOTES) & (obstacle > MIN_OBSTACLE_SHARE * floor))


def _wide(mask: Mask, cells: int) -> Mask:
    """Return the parts of a mask that are at least so many cells wide."""
    kernel = np.ones((cells, cells), np.uint8)
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, kernel) > 0)
