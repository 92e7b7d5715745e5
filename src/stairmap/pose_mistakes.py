"""Notice the commonest mistakes of poses: quaternions in another order, the body's frame, inverse poses, mm.

Two witnesses are asked. Depth of one frame, moved by the poses into a later one, must lie where that one
measured: wrong poses move it elsewhere. And the floor must be level. Each mistake is undone in turn; if the
frames then fit together much better than as the poses are given, it is told, with the option that mends it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import DepthImage, Float64Array, Points, Transform
from stairmap.detection.inverse_depth import fit_surface_normals, inverse_depth_from_frame
from stairmap.detection.orientation import estimate_up
from stairmap.errors import TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.map_levelling import levelling_from_ups
from stairmap.recordings.map_up import UP_AUTO, UP_AXES
from stairmap.recordings.pose_format import BODY, INVERSE, MILLIMETRES, POSE_FORMATS, WXYZ, poses_from_format
from stairmap.transforms import invert_transform

NUM_FRAMES_ASKED = 30
"""About so many frames are asked, spread over the recording."""

GAPS_NS = (100_000_000, 350_000_000, 700_000_000, 1_400_000_000)
"""A frame is compared with the first ones that are so much later, nanoseconds: the camera has moved, and
still sees the same. A fast one has left it behind at the longer ones."""

MAX_GAP_NS = 3_000_000_000
"""Frames that are farther apart, nanoseconds, are not compared."""

MIN_OVERLAP = 0.15
"""Smallest share of the points of the one frame in view of the other of which agreement counts."""

MIN_OWN_OVERLAP = 0.3
"""Once the poses as given leave less in view than this, after they left more, longer gaps tell nothing."""

MIN_MILLIMETRES = 5.0
"""Least median way between two compared frames by poses in millimetres, m: a few millimetres in truth."""

COLUMNS_COMPARED = 48
"""Depth images are thinned to about so many columns."""

NEAR_TOLERANCE, FAR_TOLERANCE = 0.03, 0.006
"""How far depth may be from where it should be, m, and how much more per square metre of depth: noise."""

MIN_AGREEING = 0.5
"""A pair in which no reading of the poses makes so large a share of the depth agree tells nothing."""

MIN_DIFFERENCE = 0.05
"""A pair in which all readings of the poses agree alike, so far, tells nothing: the camera stood still."""

MIN_PAIRS = 3
"""Fewest pairs that decide; or all there are, if they are two."""

MIN_GAIN = 0.2
"""By how much of the depth more must agree for a mistake to be told."""

MIN_DEPTH = 0.1
"""What comes nearer to the camera than this, m, is out of view."""

MAX_TILT_DEG = 20.0
"""A floor that is farther from level by its poses, deg, is none, or up is another axis."""

MIN_LEVEL_SHARE, MAX_LEVEL_SHARE = 0.7, 0.3
"""Shares of the frames with a floor that must be level with a mistake undone, and may be without."""

AXIS_TOLERANCE_DEG = 15.0
"""How near to an axis of the map up must be to be called by it, deg; maps of visual SLAM tilt as their first
camera did."""

AS_GIVEN = "as given"

_CAUSES = {
    WXYZ: "the quaternions are in the order qw qx qy qz",
    BODY: "they are poses of the body (x forward, y left, z up), not of the camera's optical frame",
    INVERSE: "they are inverse: from the map to the camera",
    MILLIMETRES: "they are in millimetres",
}


@dataclass(slots=True, kw_only=True)
class _KeptFrame:
    """A frame that waits for later ones to be compared with."""

    stamp_ns: int
    points: Points
    readings: dict[str, Transform]
    num_compared: int = 0
    had_overlap: bool = False

    def is_due(self, stamp_ns: int) -> bool:
        """Whether a frame with this stamp is the next one to compare with."""
        return self.num_compared < len(GAPS_NS) and stamp_ns - self.stamp_ns >= GAPS_NS[self.num_compared]


class PoseWatch:
    """Watches frames with poses pass by and tells what is wrong with the poses.

    Parameters
    ----------
    num_frames
        How many frames there will be.
    map_from_recorded
        (4, 4) turn of the poses as they are written into those given to ``add``.
    max_depth
        Farthest depth that counts, m.
    knows_up
        Whether up was asked of the floor anyway, so that the poses need not know it.
    """

    def __init__(
        self, num_frames: int, *, map_from_recorded: Transform, max_depth: float, knows_up: bool = False
    ) -> None:
        self._stride = max(1, num_frames // NUM_FRAMES_ASKED)
        self._recorded_from_map = invert_transform(map_from_recorded)
        self._max_depth, self._knows_up = max_depth, knows_up
        self._count = 0
        self._num_asked = 0
        self._waiting: list[_KeptFrame] = []
        self._ways: list[float] = []
        self._shares: list[dict[str, float]] = []
        self._ups: list[dict[str, Float64Array]] = []

    def add(self, frame: DepthFrame, map_from_camera: Transform) -> None:
        """Take in a frame with its pose; frames come in the order of their stamps."""
        index, self._count = self._count, self._count + 1
        self._waiting = [
            kept
            for kept in self._waiting
            if kept.num_compared < len(GAPS_NS) and frame.stamp_ns - kept.stamp_ns <= MAX_GAP_NS
        ]
        is_asked = index % self._stride == 0
        due = [kept for kept in self._waiting if kept.is_due(frame.stamp_ns)]
        if not is_asked and not due:
            return
        readings = read_pose(self._recorded_from_map @ map_from_camera)
        for kept in due:
            while kept.is_due(frame.stamp_ns):
                kept.num_compared += 1
            self._compare(kept, frame, readings)
        if is_asked:
            self._num_asked += 1
            points = _thinned_points(frame, self._max_depth)
            self._waiting.append(_KeptFrame(stamp_ns=frame.stamp_ns, points=points, readings=readings))
            image = inverse_depth_from_frame(frame, max_depth=self._max_depth)
            up = estimate_up(fit_surface_normals(image))
            if up is not None:
                self._ups.append({name: pose[:3, :3] @ up for name, pose in readings.items()})

    def mistake(self) -> str | None:
        """Return a sentence about what is wrong with the poses, and what mends it; ``None`` if nothing is."""
        told = self._find_wrong_format()
        if told is None and not self._knows_up:
            return self._find_wrong_up() or self._find_wrong_format(by_floor=True)
        return told

    def _compare(self, earlier: _KeptFrame, later: DepthFrame, readings: dict[str, Transform]) -> None:
        shares: dict[str, float] = {}
        for name, pose in readings.items():
            later_from_earlier = invert_transform(pose) @ earlier.readings[name]
            overlap, agreeing = _find_agreement(later_from_earlier, earlier.points, later)
            shares[name] = agreeing if overlap >= MIN_OVERLAP else 0.0
            if name == AS_GIVEN:
                way = float(np.linalg.norm(later_from_earlier[:3, 3]))
                if overlap >= MIN_OWN_OVERLAP:
                    earlier.had_overlap = True
                elif earlier.had_overlap:
                    return
        most, least = max(shares.values()), min(shares.values())
        if most >= MIN_AGREEING and most - least >= MIN_DIFFERENCE:
            self._shares.append(shares)
            self._ways.append(way)

    def _find_wrong_format(self, *, by_floor: bool = False) -> str | None:
        """The mistake whose undoing makes frames fit together, or, if they tell nothing, the floor level."""
        num_pairs = len(self._shares)
        if num_pairs < min(MIN_PAIRS, self._num_asked - 1) and not by_floor:
            return None
        means = {
            name: float(np.mean([share[name] for share in self._shares])) if num_pairs else 0.0
            for name in (AS_GIVEN, *POSE_FORMATS)
        }
        levels = {name: self._level_share(name) for name in means}
        candidates = []
        for name in POSE_FORMATS:
            if name == MILLIMETRES and (not num_pairs or np.median(self._ways) < MIN_MILLIMETRES):
                continue
            gain = means[name] - means[AS_GIVEN]
            is_level = levels[name] >= MIN_LEVEL_SHARE and levels[AS_GIVEN] <= MAX_LEVEL_SHARE
            if gain >= MIN_GAIN or (by_floor and is_level and num_pairs == 0):
                candidates.append((gain + levels[name], name))
        if not candidates:
            return None
        best = max(candidates)[1]
        reasons = []
        if num_pairs:
            reasons.append(
                f"{100 * means[best]:.0f} % of what two frames see agrees if so, "
                f"{100 * means[AS_GIVEN]:.0f} % otherwise"
            )
        if levels[best] - levels[AS_GIVEN] > 1 - MIN_LEVEL_SHARE:
            reasons.append("the floor is level if so, and not otherwise")
        return f"the poses do not fit the depth images unless {_CAUSES[best]} ({'; '.join(reasons)}); " + (
            f"pass --pose-format {best}"
        )

    def _level_share(self, name: str) -> float:
        """Share of the frames with a floor in which it is level by this reading of the poses."""
        min_cosine = np.cos(np.radians(MAX_TILT_DEG))
        map_z = self._recorded_from_map[:3, 2]
        return float(np.mean([up[name] @ map_z >= min_cosine for up in self._ups])) if self._ups else 0.0

    def _find_wrong_up(self) -> str | None:
        """A sentence if the floor in most of the frames that show one is far from level in the map."""
        ups = np.array([up[AS_GIVEN] for up in self._ups]).reshape(-1, 3) @ self._recorded_from_map[:3, :3]
        try:
            levelling = levelling_from_ups(ups, num_asked=self._num_asked)
        except TrajectoryError:
            return None
        angle_deg = float(np.degrees(levelling.angle))
        if angle_deg < MAX_TILT_DEG:
            return None
        up = self._recorded_from_map[:3, :3] @ levelling.map_from_recorded[2, :3]
        axis = max(UP_AXES, key=lambda name: float(up @ np.array(UP_AXES[name])))
        is_near = up @ np.array(UP_AXES[axis]) >= np.cos(np.radians(AXIS_TOLERANCE_DEG))
        others = [name for name in POSE_FORMATS if self._level_share(name) >= MIN_LEVEL_SHARE]
        # Frames that overlap have told that the poses are otherwise right; without them, it may be the poses.
        doubts = (
            "" if self._shares else "".join(f"; if {_CAUSES[name]}: --pose-format {name}" for name in others)
        )
        return (
            f"by the poses the floor is tilted by {angle_deg:.0f} deg, in {levelling.num_agreeing} of "
            f"{self._num_asked} frames asked: z of the map does not point up; pass "
            f"--up={axis if is_near else UP_AUTO}{doubts}"
        )


def read_pose(recorded_from_camera: Transform) -> dict[str, Transform]:
    """Return a (4, 4) pose as given, and as it would be meant with each of the usual mistakes."""
    as_read = recorded_from_camera[None]
    return {
        AS_GIVEN: recorded_from_camera,
        **{name: poses_from_format(as_read, name)[0] for name in POSE_FORMATS},
    }


def _thinned_points(frame: DepthFrame, max_depth: float) -> Points:
    """(N, 3) points of a frame, camera frame, m."""
    stride = max(1, frame.camera.width // COLUMNS_COMPARED)
    depth = frame.depth[::stride, ::stride]
    points = frame.camera.strided(stride).unproject(depth).reshape(-1, 3)
    return points[np.isfinite(points[:, 2]) & (points[:, 2] < max_depth)]


def _find_agreement(later_from_earlier: Transform, points: Points, later: DepthFrame) -> tuple[float, float]:
    """Compare points of an earlier frame with a later one.

    Returns
    -------
    Share of the (N, 3) points that are in view where the later frame measured something, and share of these
    that lie there.
    """
    if not len(points):
        return 0.0, 0.0
    moved = points @ later_from_earlier[:3, :3].T + later_from_earlier[:3, 3]
    pixels = later.camera.project(moved)
    height, width = later.depth.shape
    with np.errstate(invalid="ignore"):
        inside = (
            (moved[:, 2] > MIN_DEPTH)
            & (pixels[:, 0] >= 0)
            & (pixels[:, 0] <= width - 1)
            & (pixels[:, 1] >= 0)
            & (pixels[:, 1] <= height - 1)
        )
    columns, rows = np.rint(pixels[inside]).astype(np.int64).T
    measured: DepthImage = later.depth[rows, columns]
    expected = moved[inside, 2]
    is_measured = np.isfinite(measured)
    with np.errstate(invalid="ignore"):
        agrees = np.abs(measured - expected) < NEAR_TOLERANCE + FAR_TOLERANCE * expected**2
    num_measured = int(np.count_nonzero(is_measured))
    return num_measured / len(points), float(np.count_nonzero(agrees) / max(num_measured, 1))
