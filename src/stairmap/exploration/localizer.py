"""Where the robot is in the map: odometry, corrected by laying what it sees over what it saw before.

small_gicp (extra ``explore``) does the registration, against scans taken nearby, early ones too, so that a
place that is seen again pulls the robot back. Odometry counts as much as it is worth: along a corridor, where
the view does not tell how far the robot went, it alone decides.
"""

from __future__ import annotations

import importlib
import math
from dataclasses import replace
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, Points
from stairmap.errors import MissingPackageError
from stairmap.exploration.odometry import Planar
from stairmap.exploration.scans import FLOOR, Scan
from stairmap.exploration.state_file import State
from stairmap.geometry import wrapped_angle
from stairmap.transforms import invert_transform, vector_from_rotation

VOXEL = 0.10
"""Points are averaged in cubes of this size, m."""

NEIGHBOURHOOD = 5.0
"""Scans taken so near are laid over, m."""

HEIGHTS = 2.0
"""And at most so far above or below, m."""

MAX_SCANS = 30
"""At most so many of them: the nearest."""

SAME_SPOT, SAME_HEADING = 0.3, math.radians(20)
"""Of scans that were taken nearer together than this, m and rad, the first counts: it has drifted least."""

REFRESH_DISTANCE, REFRESH_TURN, REFRESH_SCANS = 0.35, math.radians(20), 4
"""They are gathered anew after this way, m, this turn, rad, or so many scans: a robot that turns comes to
see what no scan before the last one showed."""

MIN_POINTS = 60
"""With fewer points there is nothing to lay over."""

MAX_CORRESPONDENCE = 0.30
"""Farthest pair of points, m."""

MIN_INLIER_SHARE = 0.4
"""Share of the points that must find a partner."""

CORRELATION = 5.0
"""Points of one surface err together: so many count as one."""

MAX_SHIFT, MAX_TURN = 0.30, math.radians(10)
"""A larger correction of one scan is wrong, m and rad."""

PRIOR_SHIFT = (0.01, 0.03)
"""Standard deviation of a move by odometry: m, and m per m."""

PRIOR_TURN = (math.radians(0.3), 0.08, math.radians(1.0))
"""Of its turn: rad, rad per rad of turn, rad per m."""

SEARCH_TURN = math.radians(3.0)
"""Where the heading is less sure than this, rad, registration begins from several, this far apart: a robot
that turned before a wall, too near for its camera, saw nothing on the way. Scans are not kept until one fits
again."""

MAX_SIGMAS = 2.5
"""Corrections of more standard deviations of what odometry tells are not looked for."""

MIN_FOUND_SHARE = 0.75
"""Share of the points that must find a partner then: among several headings a wrong one fits half of them."""

MAX_UNSURE = 8
"""But at most this many scans wait for that: behind a door nothing may be known."""

PRIOR_TILT, PRIOR_HEIGHT = math.radians(0.5), 0.02
"""Of tilt, rad, which the IMU measures, and of height, m, which legs feel."""


class ScanStore:
    """What scans showed besides the floor, in the map: one scan a spot and heading, so it grows with the area
    only."""

    def __init__(self) -> None:
        self._keys: set[tuple[int, int, int, int]] = set()
        self._places: list[Float64Array] = []
        self._clouds: list[Points] = []

    def __len__(self) -> int:
        return len(self._clouds)

    def add(self, scan: Scan, pose: Planar) -> None:
        """Keep a scan unless one of its spot and heading is known: the first has drifted least."""
        key = (
            int(pose.x // SAME_SPOT),
            int(pose.y // SAME_SPOT),
            int(pose.z // SAME_SPOT),
            int(pose.heading % (2 * math.pi) // SAME_HEADING),
        )
        if key not in self._keys:
            self._keys.add(key)
            self._places.append(pose.place)
            self._clouds.append(thinned(scan.placed(pose)[scan.kinds != FLOOR]))

    def near(self, pose: Planar) -> Points:
        """Return the (N, 3) points of the scans nearest to a pose, at most ``MAX_SCANS`` scans, m, map."""
        if not self._clouds:
            return np.empty((0, 3))
        offsets = np.array(self._places) - pose.place
        apart = np.hypot(offsets[:, 0], offsets[:, 1])
        near = np.flatnonzero((apart < NEIGHBOURHOOD) & (np.abs(offsets[:, 2]) < HEIGHTS))
        chosen = near[np.argsort(apart[near], kind="stable")][:MAX_SCANS]
        return np.concatenate([np.empty((0, 3)), *(self._clouds[int(index)] for index in chosen)])

    def state(self) -> State:
        """Return all scans, to go on from."""
        return {
            "keys": np.array(sorted(self._keys), dtype=np.int64).reshape(-1, 4),
            "places": np.array(self._places).reshape(-1, 3),
            "points": np.concatenate([np.empty((0, 3)), *self._clouds]),
            "sizes": np.array([len(cloud) for cloud in self._clouds], dtype=np.int64),
        }

    def restore(self, state: State) -> None:
        """Go on from a state.

        Raises
        ------
        ValueError
            If its arrays do not belong together.
        """
        keys, places, sizes = (np.array(state[name]) for name in ("keys", "places", "sizes"))
        points = np.array(state["points"], dtype=np.float64).reshape(-1, 3)
        if not len(keys) == len(places) == len(sizes) or sizes.sum() != len(points):
            raise ValueError(
                f"{len(sizes)} scans have {len(places)} places, {len(keys)} keys and {len(points)} points"
            )
        self._keys = {(int(a), int(b), int(c), int(d)) for a, b, c, d in keys}
        self._places = list(places.astype(np.float64))
        self._clouds = np.split(points, np.cumsum(sizes)[:-1]) if len(sizes) else []


def thinned(points: Points) -> Points:
    """Return the means of (N, 3) points in cubes of ``VOXEL``."""
    if not len(points):
        return points
    cells = np.floor(points / VOXEL).astype(np.int64)
    cells -= cells.min(axis=0)
    keys = (cells[:, 0] << 40) | (cells[:, 1] << 20) | cells[:, 2]
    _, index, counts = np.unique(keys, return_inverse=True, return_counts=True)
    sums = [np.bincount(index, weights=points[:, axis]) for axis in range(3)]
    return np.asarray(np.stack(sums, axis=1) / counts[:, None], dtype=np.float64)


class Localizer:
    """Follows the robot's place in the map.

    Parameters
    ----------
    start
        Where the robot begins, in map and odometry alike.
    is_perfect
        Whether odometry makes no error; nothing is corrected then.

    Raises
    ------
    MissingPackageError
        Without the package small_gicp, unless odometry is perfect.
    """

    def __init__(self, start: Planar, *, is_perfect: bool) -> None:
        self._odometry = self._pose = start
        self._library: Any = None if is_perfect else _import_gicp()
        self._target: tuple[Any, Any] | None = None
        self._target_pose = np.full(4, np.inf)
        self._target_age = 0
        self.num_corrected, self.num_refused = 0, 0
        self._variance = np.zeros(6)
        self._num_unsure = 0

    @property
    def is_sure(self) -> bool:
        """Whether the last scan lies well enough in the map to be kept."""
        return self._num_unsure == 0 or self._num_unsure > MAX_UNSURE

    def state(self) -> State:
        """Return where the robot was last seen to be and how sure that is, to go on from."""
        return {
            "odometry": self._odometry.to_row(),
            "pose": self._pose.to_row(),
            "variance": self._variance.copy(),
            "num_corrected": self.num_corrected,
            "num_refused": self.num_refused,
            "num_unsure": self._num_unsure,
        }

    def restore(self, state: State) -> None:
        """Go on from a state.

        Raises
        ------
        ValueError, TypeError
            If it is none.
        """
        self._odometry, self._pose = Planar.from_row(state["odometry"]), Planar.from_row(state["pose"])
        self._variance = np.array(state["variance"], dtype=np.float64).reshape(6)
        self.num_corrected, self.num_refused = int(state["num_corrected"]), int(state["num_refused"])
        self._num_unsure = int(state["num_unsure"])
        self._target, self._target_age = None, 0
        self._target_pose = np.full(4, np.inf)

    def predict(self, odometry: Planar) -> Planar:
        """Return where the robot is when odometry says where it is."""
        if self._library is None:
            return odometry
        forward, left, turn = _between(self._odometry, odometry)
        cosine, sine = math.cos(self._pose.heading), math.sin(self._pose.heading)
        return Planar(
            x=self._pose.x + cosine * forward - sine * left,
            y=self._pose.y + sine * forward + cosine * left,
            z=odometry.z,
            heading=self._pose.heading + turn,
        )

    def correct(self, scan: Scan, odometry: Planar, known: ScanStore) -> Planar:
        """Take in a scan; return where it was taken, by odometry and by the scans that are known."""
        predicted = self.predict(odometry)
        pose = predicted
        if self._library is not None:
            self._variance += _prior_std(_between(self._odometry, odometry)) ** 2
            found = self._correction(scan, predicted, known)
            is_unsure = found is None and math.sqrt(self._variance[2]) > SEARCH_TURN
            self._num_unsure = self._num_unsure + 1 if is_unsure else 0
            shift, turn = (np.zeros(2), 0.0) if found is None else found
            cosine, sine = math.cos(predicted.heading), math.sin(predicted.heading)
            pose = replace(
                predicted,
                x=predicted.x + cosine * shift[0] - sine * shift[1],
                y=predicted.y + sine * shift[0] + cosine * shift[1],
                heading=predicted.heading + turn,
            )
        self._odometry, self._pose = odometry, pose
        return pose

    def _correction(
        self, scan: Scan, predicted: Planar, known: ScanStore
    ) -> tuple[Float64Array, float] | None:
        """Return shift (m, ahead and left) and turn (rad) of a scan against where odometry puts it.

        ``None``: it does not fit. What shows next to nothing is left where odometry puts it.
        """
        nothing = np.zeros(2), 0.0
        points = scan.points[scan.kinds != FLOOR].astype(np.float64)
        self._refresh_target(predicted, known)
        if self._target is None or len(points) < MIN_POINTS:
            return nothing
        source, _ = self._library.preprocess_points(points, downsampling_resolution=VOXEL, num_neighbors=10)
        if len(source) < MIN_POINTS:
            return nothing
        is_search = math.sqrt(self._variance[2]) > SEARCH_TURN
        result = self._align(source, predicted, is_search=is_search)
        if result.num_inliers < (MIN_FOUND_SHARE if is_search else MIN_INLIER_SHARE) * len(source):
            self.num_refused += 1
            return None
        change = invert_transform(_matrix(predicted)) @ np.asarray(result.T_target_source)
        twist = np.concatenate([vector_from_rotation(change[:3, :3]), change[:3, 3]])
        # Turns about x, y, z and shifts along x, y, z in the robot's frame, as in the library's information.
        information = np.asarray(result.H) / CORRELATION
        posterior = np.linalg.solve(information + np.diag(1 / self._variance), information @ twist)
        turn, shift = float(posterior[2]), posterior[3:5]
        most = MAX_SIGMAS * np.sqrt(self._variance)
        if np.hypot(*shift) > max(MAX_SHIFT, most[3]) or abs(turn) > max(MAX_TURN, most[2]):
            self.num_refused += 1
            return None
        self.num_corrected += 1
        self._variance = np.zeros(6)
        return shift, turn

    def _align(self, source: Any, predicted: Planar, *, is_search: bool) -> Any:
        """Lay a scan over the known ones; return what the library found from the best start."""
        cloud, tree = self._target or (None, None)
        reach = MAX_SIGMAS * math.sqrt(self._variance[2])
        starts = [0.0]
        if is_search:
            starts += [sign * turn for turn in np.arange(SEARCH_TURN, reach, SEARCH_TURN) for sign in (1, -1)]
        results = [
            self._library.align(
                cloud,
                source,
                tree,
                init_T_target_source=_matrix(replace(predicted, heading=predicted.heading + start)),
                registration_type="GICP",
                max_correspondence_distance=MAX_CORRESPONDENCE,
                max_iterations=20,
            )
            for start in starts
        ]
        return max(results, key=lambda result: result.num_inliers)

    def _refresh_target(self, pose: Planar, known: ScanStore) -> None:
        self._target_age += 1
        moved = np.abs(pose.to_row() - self._target_pose)
        if (
            self._target_age < REFRESH_SCANS
            and np.hypot(moved[0], moved[1]) < REFRESH_DISTANCE
            and moved[2] < HEIGHTS / 4
            and moved[3] < REFRESH_TURN
        ):
            return
        self._target_age, self._target_pose, self._target = 0, pose.to_row(), None
        every = known.near(pose)
        if len(every) >= MIN_POINTS:
            self._target = self._library.preprocess_points(
                every, downsampling_resolution=VOXEL, num_neighbors=10
            )


def _import_gicp() -> Any:
    try:
        return importlib.import_module("small_gicp")
    except ImportError as error:
        raise MissingPackageError("small_gicp", "explore", "exploring with odometry that drifts") from error


def _prior_std(moved: tuple[float, float, float]) -> Float64Array:
    """Standard deviations of turns about x, y, z (rad) and of shifts (m) by IMU and odometry over a move."""
    way, turn = math.hypot(moved[0], moved[1]), abs(moved[2])
    heading = PRIOR_TURN[0] + PRIOR_TURN[1] * turn + PRIOR_TURN[2] * way
    shift = PRIOR_SHIFT[0] + PRIOR_SHIFT[1] * way
    return np.array([PRIOR_TILT, PRIOR_TILT, heading, shift, shift, PRIOR_HEIGHT])


def _between(first: Planar, second: Planar) -> tuple[float, float, float]:
    """Return the move from one pose to another in the first one's frame: ahead, left (m), turn (rad)."""
    dx, dy = second.x - first.x, second.y - first.y
    cosine, sine = math.cos(first.heading), math.sin(first.heading)
    return (
        cosine * dx + sine * dy,
        cosine * dy - sine * dx,
        float(wrapped_angle(second.heading - first.heading)),
    )


def _matrix(pose: Planar) -> Float64Array:
    matrix = np.eye(4)
    cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
    matrix[:2, :2] = [[cosine, -sine], [sine, cosine]]
    matrix[:3, 3] = pose.place
    return matrix
