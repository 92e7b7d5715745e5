"""LiDARs: where their beams go, and how well they measure; each number with its source.

A pattern is a function of time, so that a sweep after the other goes on where the last one ended: the beams
of a spinning LiDAR come again, those of a rosette do not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, Vector

SWEEP_PERIOD_NS = 100_000_000
"""All of them give ten sweeps a second, as their drivers do by default."""

MAX_INCIDENCE = float(np.radians(87))
"""Flatter hits give no echo, rad (ours)."""


class Beams(NamedTuple):
    """Beams of a sweep.

    Attributes
    ----------
    offsets_ns
        (N,) when each is sent, nanoseconds after the beginning of the sweep.
    directions
        (N, 3) unit vectors, x forward, y left, z up.
    rings
        (N,) number of the laser.
    """

    offsets_ns: IntArray
    directions: Points
    rings: IntArray


class Lidar(Protocol):
    """A LiDAR."""

    @property
    def name(self) -> str:
        """What ``--sensor`` calls it."""
        ...

    @property
    def frame_id(self) -> str:
        """Coordinate frame that its driver names."""
        ...

    @property
    def topic(self) -> str:
        """Topic of its driver."""
        ...

    @property
    def min_range(self) -> float:
        """Nearest range, m."""
        ...

    @property
    def max_range(self) -> float:
        """Farthest range that is simulated, m."""
        ...

    @property
    def range_std(self) -> float:
        """Standard deviation of single ranges, m."""
        ...

    @property
    def ring_std(self) -> float:
        """Standard deviation of the constant error of each laser's ranges, m."""
        ...

    @property
    def angle_std(self) -> float:
        """Standard deviation of where a beam goes, its width included, rad."""
        ...

    @property
    def num_rings(self) -> int:
        """Number of lasers."""
        ...

    def beams(self, sweep_index: int) -> Beams:
        """Return the beams of a sweep, counted from 0."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class SpinningLidar:
    """Lasers above each other that turn about the upright axis.

    All lasers fire at once at each of ``num_columns`` azimuths, clockwise seen from above, beginning behind.
    For the other attributes see ``Lidar``.

    Attributes
    ----------
    elevations
        (K,) of the lasers, rad.
    num_columns
        Azimuths in a turn.
    """

    name: str
    frame_id: str
    topic: str
    elevations: Vector
    num_columns: int
    min_range: float
    max_range: float
    range_std: float
    ring_std: float
    angle_std: float

    @property
    def num_rings(self) -> int:
        """Number of lasers."""
        return len(self.elevations)

    def beams(self, sweep_index: int) -> Beams:
        """Return the beams of a sweep; every sweep has the same."""
        share = np.arange(self.num_columns) / self.num_columns
        azimuth = np.pi - 2 * np.pi * share
        directions = _directions(azimuth[:, None], np.asarray(self.elevations)[None, :])
        offsets = np.broadcast_to((share * SWEEP_PERIOD_NS)[:, None], directions.shape[:2])
        rings = np.broadcast_to(np.arange(self.num_rings), directions.shape[:2])
        return Beams(offsets.ravel().astype(np.int64), directions.reshape(-1, 3), rings.ravel())


@dataclass(frozen=True, slots=True, kw_only=True)
class RosetteLidar:
    """A beam that a turning mirror and a swinging one send all round, never the same way twice (Livox).

    With t in s and angles in degrees, as MARSIM (Kong et al., RA-L 8(5), 2023; ``use_minicf_pattern``)
    describes the Mid-360: azimuth −62050.63 t + 3.11 cos(314159.2 t) sin(1256.636 t), elevation
    22.5 + 25.5 cos(20 π t) + 4 cos(2 π t / 0.006) cos(10000 π t): −7° to 52°, once down and up in 0.1 s while
    the mirror turns 17.2 times. For the attributes see ``Lidar``.
    """

    name: str
    frame_id: str
    topic: str
    points_per_second: int
    min_range: float
    max_range: float
    range_std: float
    ring_std: float
    angle_std: float

    @property
    def num_rings(self) -> int:
        """Four lasers take turns."""
        return 4

    def beams(self, sweep_index: int) -> Beams:
        """Return the beams of a sweep."""
        num = self.points_per_second // 10
        offsets = np.arange(num) * (SWEEP_PERIOD_NS // num)
        seconds = (sweep_index * SWEEP_PERIOD_NS + offsets) * 1e-9
        azimuth = -62050.63 * seconds + 3.11 * np.cos(314159.2 * seconds) * np.sin(1256.636 * seconds)
        elevation = 22.5 + 25.5 * np.cos(20 * np.pi * seconds)
        elevation += 4 * np.cos(2 * np.pi / 0.006 * seconds) * np.cos(10000 * np.pi * seconds)
        directions = _directions(np.radians(azimuth), np.radians(elevation))
        return Beams(offsets, directions, np.arange(num) % self.num_rings)


VLP_16 = SpinningLidar(
    name="vlp16",
    frame_id="velodyne",
    topic="/velodyne_points",
    elevations=np.radians(np.arange(-15, 16, 2)),
    num_columns=1808,
    min_range=0.4,
    max_range=20.0,
    range_std=0.010,
    ring_std=0.008,
    angle_std=float(np.radians(0.05)),
)
"""Velodyne's manual (63-9243): 16 lasers 2° apart, a firing every 55.296 µs, so 1808 in a turn of 0.1 s;
accuracy ±3 cm, typical. We take that for three deviations: 10 mm from point to point, 8 mm constant for each
laser (ours)."""

OS0_64 = SpinningLidar(
    name="os0_64",
    frame_id="os_sensor",
    topic="/ouster/points",
    elevations=np.radians(np.linspace(45, -45, 64)),
    num_columns=1024,
    min_range=0.3,
    max_range=20.0,
    range_std=0.012,
    ring_std=0.004,
    angle_std=float(np.radians(0.1)),
)
"""Ouster's OS0-64 data sheet: 64 lasers over 90°, 1024 azimuths at 10 Hz, precision of 1 to 2 cm near by. The
constant error of a laser is ours."""

MID_360 = RosetteLidar(
    name="mid360",
    frame_id="livox_frame",
    topic="/livox/lidar",
    points_per_second=200_000,
    min_range=0.1,
    max_range=20.0,
    range_std=0.020,
    ring_std=0.003,
    angle_std=float(np.radians(0.1)),
)
"""Livox's data sheet of the Mid-360: 200,000 points/s, blind below 0.1 m, range σ ≤ 2 cm at 10 m (and ≤ 3 cm
at 0.2 m), angle σ < 0.15°. The constant error of a laser is ours."""

LIDARS: Mapping[str, SpinningLidar | RosetteLidar] = {
    lidar.name: lidar for lidar in (VLP_16, OS0_64, MID_360)
}
"""Every LiDAR by the name that ``--sensor`` takes."""


def _directions(azimuth: Float64Array, elevation: Float64Array) -> Points:
    x, y = np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation)
    return np.stack(np.broadcast_arrays(x, y, np.sin(elevation)), axis=-1)
