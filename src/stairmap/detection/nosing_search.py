"""Find nosings in the scans of an elevation: convex corners where a near surface ends.

Going up a scan, a nosing is where the surface seen so far ends: either something farther follows (a jump), or
a surface that leans back (a crease, the corner of a riser and its tread). Nothing is asked of what lies
beneath, so fronts of slabs, edges of treads seen from above and the tops of risers are all found alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.elevation import Elevation
from stairmap.kernels import find_creases, find_edge_turns, find_jumps
from stairmap.kernels.corners import CreaseLimits, JumpLimits, TurnLimits

MIN_JUMP = 0.10
"""Smallest distance along a ray between the two sides of a jump, m: half of the smallest run."""

JUMP_ROWS = (2, 3, 5, 7)
"""How many rows past an edge something farther must begin: a sensor that smooths makes a ramp of a few."""

NOISE_JUMP = 5.0
"""A jump is larger than this many standard deviations of inverse distance."""

MIN_NOTHING_ROWS = 8
"""An edge before nothing at all counts as a jump where this many rows hold no measurement."""

MIN_CORNER = np.radians(40.0)
"""Smallest angle between the surfaces below and above a crease: worn and sloping risers keep half of 90°."""

MAX_CORNER_STD = np.radians(14.0)
"""Largest standard deviation of a crease's angle."""

MAX_CREASE_GAP = 0.07
"""Largest forward distance between the surfaces that meet at a crease, m: the overhang of a nosing."""

WINDOW_HEIGHT = 0.06
"""Height of the piece of a scan to which a line is fitted on each side of a crease, m: a third of a rise."""

MIN_WINDOW, MAX_WINDOW = 3, 10
"""Bounds of the same, rows."""

MIN_WINDOW_SHARE = 0.7
"""Share of such a piece that must be measured."""

FRONT_LEAN, MAX_TOP_FALL = (np.radians(30.0), np.radians(150.0)), np.radians(30.0)
"""The surface below a crease faces the camera: inclinations of a tread's front, rad, 90° upright. The one
above is seen from above, and falls toward its back by no more than the second, rad."""

LEVEL_SLOPE = 0.02
"""Rays that look down by more than this may see a level surface, m per m."""

MAX_DEEPER = 0.05
"""A level surface is followed to its edge by no more than this past its last measurement, m."""

_JUMP_ROWS = np.array(JUMP_ROWS)

MAX_PAIR_STRIPS = 3
"""Corners of one edge are compared over this many strips at most."""

PAIR_HEIGHT, PAIR_HEIGHT_ROWS = 0.012, 1.5
"""Corners of one edge lie within this height of each other, m, and this many rows: level edges only."""

MAX_EDGE_TURN = np.radians(65.0)
"""An edge that is turned more against the heading is seen almost end on, rad."""

TURN_BINS = 36
"""Bins of 5 degrees in which the directions of edges are counted."""

MIN_PAIRS = 5
"""Fewest pairs of corners that tell a heading."""

PEAK_REACH = np.radians(7.0)
"""Pairs within this of the commonest direction give it, rad."""

PEAKS_APART = 1.5 * PEAK_REACH
"""Directions that are nearer to each other are one, rad."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Corners:
    """Convex corners of single scans; all arrays are (N,).

    Attributes
    ----------
    distance, height
        s and z, m.
    strip
        Strip of the elevation.
    is_jump
        Whether something farther follows, rather than a surface that leans back.
    is_end
        Whether nothing at all was measured behind it.
    """

    distance: Float64Array
    height: Float64Array
    strip: IntArray
    is_jump: Mask
    is_end: Mask

    @property
    def places(self) -> tuple[Float64Array, Float64Array, IntArray]:
        """Distance, height and strip, as kernels take them."""
        distance, height = np.ascontiguousarray(self.distance), np.ascontiguousarray(self.height)
        return distance, height, np.ascontiguousarray(self.strip)

    def __len__(self) -> int:
        return len(self.distance)


def find_corners(elevation: Elevation, *, noise: float) -> Corners:
    """Find the convex corners of all scans.

    Parameters
    ----------
    elevation
        The scans.
    noise
        Standard deviation of inverse distance of one cell, 1/m.
    """
    q, slope, row_size = elevation.inverse_distance, elevation.slope, elevation.grid.row_size
    jump_distance, jump_height, jump_strip, jump_ends = find_jumps(
        q,
        slope,
        _JUMP_ROWS,
        JumpLimits(
            row_size=row_size,
            edge_shift=elevation.grid.edge_shift,
            min_jump=MIN_JUMP,
            min_difference=NOISE_JUMP * noise,
            min_nothing_rows=MIN_NOTHING_ROWS,
            level_slope=LEVEL_SLOPE,
            max_deeper=MAX_DEEPER,
        ),
    )
    distance, height, strip = find_creases(
        q,
        slope,
        CreaseLimits(
            row_size=row_size,
            noise=noise,
            height=WINDOW_HEIGHT,
            min_window=MIN_WINDOW,
            max_window=MAX_WINDOW,
            min_share=MIN_WINDOW_SHARE,
            max_gap=MAX_CREASE_GAP,
            min_corner=MIN_CORNER,
            max_corner_std=MAX_CORNER_STD,
            min_lean=FRONT_LEAN[0],
            max_lean=FRONT_LEAN[1],
            min_upper_lean=-MAX_TOP_FALL,
        ),
    )
    no_jump = np.zeros(len(distance), dtype=bool)
    return Corners(
        distance=np.concatenate([jump_distance, distance]),
        height=np.concatenate([jump_height, height]),
        strip=np.concatenate([jump_strip, strip]),
        is_jump=np.concatenate([np.ones(len(jump_ends), dtype=bool), no_jump]),
        is_end=np.concatenate([jump_ends, no_jump]),
    )


def find_turns(elevation: Elevation, corners: Corners, *, max_turns: int) -> list[float]:
    """Find how far level edges are turned against an elevation's heading.

    Corners in neighbouring scans at one height are of one edge. The direction from one to the other, seen
    from above, is that of the edge; stairs have many edges of one direction.

    Parameters
    ----------
    elevation, corners
        Scans and their corners.
    max_turns
        How many directions are returned at most.

    Returns
    -------
    Angles by which the heading must be turned to the left to stand square to the edges, rad, the commonest
    first.
    """
    # Where measurements end, at the sensor's range or a shiny floor, there is no edge.
    known = ~corners.is_end
    limits = TurnLimits(
        max_strips=MAX_PAIR_STRIPS,
        max_height=PAIR_HEIGHT,
        max_height_slope=PAIR_HEIGHT_ROWS * elevation.grid.row_size,
        max_turn=float(MAX_EDGE_TURN),
        num_bins=TURN_BINS,
        reach=float(PEAK_REACH),
        min_pairs=MIN_PAIRS,
        min_apart=float(PEAKS_APART),
    )
    places = corners.distance[known], corners.height[known], corners.strip[known]
    turns = find_edge_turns(places, np.ascontiguousarray(elevation.bearing), limits, max_turns)
    return [float(turn) for turn in turns]
