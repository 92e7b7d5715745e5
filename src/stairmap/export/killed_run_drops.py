"""Find the drops of a run that was killed, from the edges that its frames wrote down.

The log tells where each frame saw the ground end, and not where it saw ground. So what later frames spoke
against stays: where nobody knows, a robot is kept off.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from stairmap.config import Config
from stairmap.detection.drops import DropEdge
from stairmap.detection.ground import NUM_RANGE_BINS, GroundView
from stairmap.detection.observation import Detection
from stairmap.drop import Drop
from stairmap.modeling.drop_map import DropMap
from stairmap.modeling.drop_stairways import assign_drops
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory

if TYPE_CHECKING:
    from stairmap.export.loading import SavedDetection


def drops_of_killed_run(
    detections: Iterable[SavedDetection], trajectory: Trajectory | None, stairways: Sequence[Stairway]
) -> tuple[tuple[Drop, ...], float | None]:
    """Return the drops, each with the stairway that it is an edge of, and the height of the camera, m.

    ``None`` where no height is known; without a trajectory there are no drops.
    """
    found = DropMap(min_observations=Config().modeling.min_observations)
    for detection in detections:
        if detection.camera_height is not None:
            found.add(_with_ground(detection, detection.camera_height))
    drops = () if trajectory is None else found.drops(trajectory)
    return assign_drops(drops, stairways), found.camera_height


def _with_ground(saved: SavedDetection, height: float) -> Detection:
    """The detection with a ground of which nothing is known but its height."""
    ground = GroundView(
        height=height,
        up=np.array([0.0, -1.0, 0.0]),
        forward=np.array([0.0, 0.0, 1.0]),
        bearing=np.array([1.0, -1.0]),
        is_seen=np.zeros((2, NUM_RANGE_BINS), dtype=np.bool_),
    )
    edges = tuple(
        DropEdge(edge=np.array(edge), depth=np.nan if depth is None else depth, num_rays=0)
        for edge, depth in saved.drops
    )
    return Detection(stamp_ns=saved.stamp_ns, observations=(), rejections=(), ground=ground, drops=edges)
