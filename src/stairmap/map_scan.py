"""Find the stairways of a finished map: one or several files of points.

    scan = MapScan([open_cloud(path) for path in paths])
    scan.read()
    result = scan.find_stairways()

The map's unit and up are found from its points where they are not given. Results are in metres, z up, with
the file's own origin and axes; only a map whose z is not up is turned, and ``map_from_file`` says how.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Points, Transform, Vector, readonly
from stairmap.clouds.detector import detect_flights
from stairmap.clouds.flight import observation_from_flight
from stairmap.clouds.levelling import find_level_direction, find_up_axis, is_camera_view
from stairmap.clouds.thinning import ThinnedCloud
from stairmap.clouds.units import UNITS, find_unit
from stairmap.config import Config
from stairmap.detection.observation import Rejection, StairObservation
from stairmap.errors import RecordingError
from stairmap.modeling.single_views import stairways_from_observations
from stairmap.recordings.clouds.cloud import Cloud, is_measured
from stairmap.recordings.clouds.sampling import sample_points
from stairmap.recordings.map_up import UP_AUTO, UP_AXES, map_from_recorded_with_up
from stairmap.stairway import Stairway
from stairmap.transforms import rotation_between, transform_from_parts

MIN_LEAN = np.radians(0.25)
"""A map that leans less than this is taken for level, rad: a floor says no more, and its places stay as they
are."""

MAX_LEAN = np.radians(6.0)
"""A map whose floors lean more than this against its axis is not levelled unless it is told to, rad."""

MAX_CAMERA_LEAN = np.radians(50.0)
"""How far one depth camera may look down or up, and a map with ``auto`` may lean, rad."""

MIN_POINTS = 100
"""Fewest points of a map."""

Z_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanResult:
    """What was found in a map.

    Attributes
    ----------
    stairways
        The stairways, in the map.
    observations
        The flights as they were seen, in the map.
    rejections
        Why other candidates were refused.
    map_from_file
        (4, 4) the file's coordinates in the map: its unit, and the turn that makes z up.
    up
        (3,) unit vector opposite to gravity in the map, as its floors tell.
    num_points, num_invalid, num_kept
        Points read, those among them without coordinates, and points that were looked at.
    unit
        Unit of the files.
    notes
        What was found out about the files, a sentence each.
    """

    stairways: tuple[Stairway, ...]
    observations: tuple[StairObservation, ...]
    rejections: tuple[Rejection, ...]
    map_from_file: Transform
    up: Vector
    num_points: int
    num_invalid: int
    num_kept: int
    unit: str
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        object.__setattr__(self, "map_from_file", readonly(self.map_from_file))
        object.__setattr__(self, "up", readonly(self.up))


class MapScan:
    """Reads a finished map of points and finds its stairways.

    Parameters
    ----------
    clouds
        The files; together they are one map.
    up
        Axis of the files that points up, such as ``+z``; ``auto``: from the floors, whatever the axes;
        ``None``: z, unless the points clearly show another axis.
    unit
        Unit of the files, a key of ``UNITS``; ``None``: judged by the height of the map.
    config
        Uses the sections ``envelope`` and ``detection``.

    Attributes
    ----------
    map_from_file
        (4, 4) the files' coordinates in the map.
    notes
        What was found out about the files, a sentence each.

    Raises
    ------
    RecordingError
        If there is nothing to read.
    """

    def __init__(
        self,
        clouds: Sequence[Cloud],
        *,
        up: str | None = None,
        unit: str | None = None,
        config: Config | None = None,
    ) -> None:
        self._clouds = tuple(clouds)
        self._config = Config() if config is None else config
        sample = np.concatenate([sample_points(cloud) for cloud in self._clouds])
        if len(sample) < MIN_POINTS:
            names = ", ".join(cloud.path.name for cloud in self._clouds)
            raise RecordingError(
                f"expected at least {MIN_POINTS} points with coordinates in {names}, got {len(sample)}"
            )
        self.notes: list[str] = []
        is_metric = all(cloud.is_metric for cloud in self._clouds)
        axis = find_up_axis(sample) if up in (None, UP_AUTO) else str(up)
        self.unit = unit or ("m" if is_metric else find_unit(sample @ np.abs(UP_AXES[axis])))
        scale = UNITS[self.unit]
        if up in (None, UP_AUTO) and self.unit != "m":
            axis = find_up_axis(sample * scale)
        self._is_camera = up in (None, UP_AUTO) and is_camera_view(sample)
        turn = map_from_recorded_with_up(axis)
        self._max_lean = MAX_CAMERA_LEAN if up == UP_AUTO or self._is_camera else MAX_LEAN
        self.map_from_file = turn.copy()
        self.map_from_file[:3, :3] *= scale
        self._note_frame(axis, given_up=up, given_unit=unit)
        middle = np.median(sample, axis=0) @ self.map_from_file[:3, :3].T
        # Whole metres, so that places of the map are exact in it.
        self._cloud = ThinnedCloud(np.round(middle))
        self._num_invalid = 0

    def _note_frame(self, axis: str, *, given_up: str | None, given_unit: str | None) -> None:
        if self.unit != "m":
            why = "as given" if given_unit else "by the height of the map; --unit tells another"
            self.notes.append(f"coordinates are in {self.unit} ({why}); results are in m")
        if axis != "+z":
            if given_up in UP_AXES:
                why = "as given"
            elif self._is_camera:
                why = "the points are one depth camera's view; --up tells another"
            else:
                why = "most points share few heights along it; --up tells another"
            self.notes.append(
                f"the map was turned so that its {axis} axis is z ({why}); all results are in the turned map"
            )
        if self._is_camera and len(self._clouds) == 1 and self._clouds[0].shape is not None:
            name = self._clouds[0].path.name
            self.notes.append(f"the points are an image's: stairmap detect {name} measures it more exactly")

    @property
    def num_points(self) -> int | None:
        """How many points the files say they hold; ``None`` where one does not say."""
        counts = [cloud.num_points for cloud in self._clouds]
        return None if None in counts else sum(count for count in counts if count is not None)

    @property
    def origin(self) -> Vector:
        """(3,) where the coordinates of ``kept_points`` begin, map, m."""
        return self._cloud.origin

    def kept_points(self) -> Float32Array:
        """Return the (N, 3) points that were kept, relative to ``origin``, map axes, m."""
        return self._cloud.points()

    def read(
        self,
        *,
        on_points: Callable[[int], None] = lambda _: None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Read all files.

        Parameters
        ----------
        on_points
            Told how many more points were read.
        should_stop
            Asked before each chunk; reading ends there when it says so.

        Raises
        ------
        RecordingError
            If a file cannot be read to its end.
        """
        for cloud in self._clouds:
            for chunk in cloud.chunks():
                if should_stop():
                    self.notes.append("the scan was interrupted: the rest of the points was not read")
                    return
                on_points(self._add(chunk))

    def _add(self, chunk: Points) -> int:
        valid = is_measured(chunk)
        num_valid = int(np.count_nonzero(valid))
        self._num_invalid += len(chunk) - num_valid
        if num_valid:
            points = chunk if num_valid == len(chunk) else chunk[valid]
            self._cloud.add(transformed(self.map_from_file, points))
        return len(chunk)

    def find_stairways(self) -> ScanResult:
        """Find the stairways among the points read so far.

        Raises
        ------
        RecordingError
            If too few of them have coordinates.
        """
        points = self._cloud.points()
        if self._cloud.num_added < MIN_POINTS:
            raise RecordingError(
                f"expected at least {MIN_POINTS} points with coordinates, got {self._cloud.num_added}"
            )
        lean = self._find_lean(points)
        level_from_map = rotation_between(lean, Z_UP) if lean is not None else np.eye(3)
        if lean is not None and self._is_tilted_camera(lean):
            self._turn_map(level_from_map)
            points, level_from_map, lean = self._cloud.points(), np.eye(3), None
        level = points if lean is None else (points @ level_from_map.T.astype(np.float32))
        flights, rejections = detect_flights(level, config=self._config)
        # Flights are relative to the cloud's origin in the levelled axes about it.
        observations = tuple(
            _moved(observation_from_flight(flight, np.zeros(3), level_from_map, 0), self._cloud.origin)
            for flight in flights
        )
        if self._num_invalid:
            self.notes.append(f"{self._num_invalid:,} points have no coordinates and were left out")
        return ScanResult(
            stairways=stairways_from_observations(observations),
            observations=observations,
            rejections=tuple(rejections),
            map_from_file=self.map_from_file,
            up=level_from_map.T @ Z_UP,
            num_points=self._cloud.num_added + self._num_invalid,
            num_invalid=self._num_invalid,
            num_kept=len(points),
            unit=self.unit,
            notes=tuple(self.notes),
        )

    def _find_lean(self, points: Float32Array) -> Vector | None:
        """Up in the map, where its level surfaces say that it is not z."""
        found = find_level_direction(points, Z_UP, max_turn=self._max_lean)
        if found is None:
            if self._max_lean > MAX_LEAN:
                self.notes.append(
                    "no level surface tells which way is up; the map's z is taken for it; pass --up AXIS"
                )
            return None
        angle = float(np.arccos(np.clip(found.up @ Z_UP, -1.0, 1.0)))
        if angle < MIN_LEAN:
            return None
        self.notes.append(
            f"the map leans by {np.degrees(angle):.1f} deg: steps are measured along the up that its level "
            "surfaces tell"
        )
        return found.up

    def _is_tilted_camera(self, lean: Vector) -> bool:
        return bool(lean @ Z_UP < np.cos(MAX_LEAN))

    def _turn_map(self, turn: Float64Array) -> None:
        """Turn the map itself: places in a map that leans far say little."""
        self.map_from_file = transform_from_parts(turn, np.zeros(3)) @ self.map_from_file
        turned = ThinnedCloud(np.round(turn @ self._cloud.origin))
        turned.add((self._cloud.points() + self._cloud.origin) @ turn.T)
        turned.num_added = self._cloud.num_added
        self._cloud = turned
        self.notes[-1] += "; all results are in the turned map"


def transformed(map_from_file: Transform, points: Points) -> Points:
    """Return (N, 3) points of a file in the map; a plain copy where neither unit nor axes differ."""
    linear = map_from_file[:3, :3]
    return points if np.array_equal(linear, np.eye(3)) else np.asarray(points @ linear.T)


def _moved(observation: StairObservation, shift: Vector) -> StairObservation:
    """The observation in coordinates whose origin lies at ``-shift``."""
    return replace(
        observation,
        edges=tuple(replace(edge, nosing=edge.nosing + shift) for edge in observation.edges),
        origin=observation.origin + shift,
        points=observation.points + shift,
    )
