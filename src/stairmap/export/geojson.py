"""Stairways as GeoJSON with OpenStreetMap's tags: a way up for each flight, and one over each landing.

GeoJSON knows only longitude and latitude (RFC 7946), so a map needs an anchor on the earth. Its third
coordinate is the height above the WGS 84 ellipsoid: it is there only where the anchor knows that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stairmap.arrays import Float64Array
from stairmap.errors import ConfigError
from stairmap.modeling.landings import top_of
from stairmap.navigation.floors import FloorStack
from stairmap.stairway import Flight, Stairway

_EQUATOR_RADIUS = 6_378_137.0
_ECCENTRICITY_SQUARED = 6.69437999014e-3
"""WGS 84."""


MAX_HEIGHT = 20_000.0
"""Farthest that a map lies above or below the ellipsoid, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthAnchor:
    """Where the origin of a map lies on the earth.

    Attributes
    ----------
    latitude, longitude
        Of the map's origin, WGS 84, deg.
    bearing
        Where the map's x axis points: deg from north, clockwise; 90 is east.
    height
        Height of the map's z = 0 above the WGS 84 ellipsoid, m; ``None`` where not known.

    Raises
    ------
    ConfigError
        If the latitude is not between -89 and 89 or the longitude not between -180 and 180, or the height is
        farther than 20 km from the ellipsoid.
    """

    latitude: float
    longitude: float
    bearing: float = 90.0
    height: float | None = None

    def __post_init__(self) -> None:
        if not abs(self.latitude) <= 89 or not abs(self.longitude) <= 180 or not math.isfinite(self.bearing):
            raise ConfigError(
                f"an anchor needs a latitude of -89 to 89 and a longitude of -180 to 180 deg, "
                f"got {self.latitude:g}, {self.longitude:g}"
            )
        if self.height is not None and not abs(self.height) <= MAX_HEIGHT:
            raise ConfigError(
                f"an anchor's height is that above the WGS 84 ellipsoid, at most {MAX_HEIGHT:g} m, "
                f"got {self.height:g}"
            )

    def degrees_from_map(self, points: ArrayLike) -> Float64Array:
        """Return (N, 2) longitude and latitude, deg, of (N, 2 or 3) map points, m.

        On the tangent plane of the ellipsoid at the anchor: good to a millimetre within a kilometre.
        """
        east, north = (np.asarray(points, dtype=np.float64)[..., :2] @ self._east_north().T).T
        meridian, parallel = self._radii()
        return np.stack(
            [self.longitude + np.degrees(east / parallel), self.latitude + np.degrees(north / meridian)],
            axis=-1,
        )

    def map_from_degrees(self, degrees: ArrayLike) -> Float64Array:
        """Return (N, 2) map points, m, of (N, 2) longitude and latitude, deg."""
        offset = np.radians(np.asarray(degrees, dtype=np.float64) - [self.longitude, self.latitude])
        meridian, parallel = self._radii()
        return np.asarray((offset * [parallel, meridian]) @ self._east_north())

    def _east_north(self) -> Float64Array:
        """(2, 2) turn from map x, y to east, north."""
        sine, cosine = math.sin(math.radians(self.bearing)), math.cos(math.radians(self.bearing))
        return np.array([[sine, -cosine], [cosine, sine]])

    def _radii(self) -> tuple[float, float]:
        """Radius of the meridian and of the parallel, m."""
        latitude = math.radians(self.latitude)
        flatness = 1.0 - _ECCENTRICITY_SQUARED * math.sin(latitude) ** 2
        prime = _EQUATOR_RADIUS / math.sqrt(flatness)
        return prime * (1.0 - _ECCENTRICITY_SQUARED) / flatness, prime * math.cos(latitude)


def osm_from_stairways(
    stairways: Sequence[Stairway], floors: FloorStack, anchor: EarthAnchor
) -> dict[str, Any]:
    """Return stairways as a GeoJSON feature collection with OpenStreetMap's tags.

    Flights are ``highway=steps`` with ``step_count`` (risers), ``incline=up`` (ways lead up), ``width``
    (where both ends were seen; else ``est_width``, a lower bound), ``step:height``, ``step:length`` and
    ``level``; landings are ``highway=footway``. Handrails are left out: they are not looked for.
    """
    features = []
    for stairway in stairways:
        lower, upper = floors.levels[stairway.id]
        level = {"level": f"{lower};{upper}", "indoor": "yes"}
        for flight in stairway.flights:
            points = np.array([flight.base, top_of(flight)])
            features.append(_feature(anchor, points, {**_step_tags(flight), **level}))
        for below, above in pairwise(stairway.flights):
            points = np.array([top_of(below), above.base])
            features.append(_feature(anchor, points, {"highway": "footway", **level}))
    return {"type": "FeatureCollection", "features": features}


def _feature(anchor: EarthAnchor, points: Float64Array, tags: Mapping[str, str]) -> dict[str, Any]:
    # 1e-9 deg are 0.1 mm.
    coordinates = np.round(anchor.degrees_from_map(points), 9)
    if anchor.height is not None:
        coordinates = np.column_stack([coordinates, np.round(anchor.height + points[:, 2], 4)])
    return {
        "type": "Feature",
        "properties": dict(tags),
        "geometry": {"type": "LineString", "coordinates": coordinates.tolist()},
    }


def _step_tags(flight: Flight) -> dict[str, str]:
    is_bounded = flight.left_bounded and flight.right_bounded
    return {
        "highway": "steps",
        "step_count": str(flight.num_risers),
        "incline": "up",
        "width" if is_bounded else "est_width": f"{flight.width:.2f}",
        "step:height": f"{flight.rise:.3f}",
        "step:length": f"{flight.run:.3f}",
    }
