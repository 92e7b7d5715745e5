"""Nosings seen as creases: a riser whose top edge meets the front of a tread.

This is how steps below the camera look. Riser and tread are both surfaces, so the
nosing is where they intersect: at the riser's distance and the tread's height, not
at a pixel.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray
from stairmap.detection.profile_segments import RISER, TREAD, ProfileSegments

MAX_GAP_ROWS = 14
"""Rows between riser and tread in which the inclination window straddles both, at most."""

MAX_OVERHANG = 0.08
"""Largest distance between the riser and the tread's visible front, m."""


def find_creases(segments: ProfileSegments) -> tuple[Float64Array, IntArray]:
    """Find the nosings where a tread follows a riser in the same scan.

    Returns
    -------
    (N, 3) distance s, height z (m) and strip of each nosing, and (N, 2) indices of
    its riser and tread among the segments.
    """
    riser = np.flatnonzero((segments.kind[:-1] == RISER) & (segments.kind[1:] == TREAD))
    tread = riser + 1
    same_scan = segments.strip[riser] == segments.strip[tread]
    gap = segments.last_row[riser] - segments.first_row[tread]
    step_back = segments.near[tread] - segments.distance[riser]
    rises = segments.height[tread] > segments.height[riser]
    keep = same_scan & (gap <= MAX_GAP_ROWS) & (step_back > -0.05) & (step_back < MAX_OVERHANG + 0.1) & rises
    riser, tread = riser[keep], tread[keep]
    nosings = np.stack([segments.distance[riser], segments.height[tread], segments.strip[riser]], axis=1)
    return nosings.astype(np.float64), np.stack([riser, tread], axis=1)
