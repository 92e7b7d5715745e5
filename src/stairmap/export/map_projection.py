"""Universal Transverse Mercator on WGS 84: where building models and surveyors put a place on the earth.

The series of Krueger to the third order in n (Karney, "Transverse Mercator with an accuracy of a few
nanometers", J. Geod. 85, 2011, eq. 35): better than a millimetre within a zone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

_RADIUS, _FLATTENING = 6_378_137.0, 1 / 298.257223563
_SCALE, _FALSE_EASTING, _FALSE_NORTHING = 0.9996, 500_000.0, 10_000_000.0
_ZONE_WIDTH_DEG = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GridPlace:
    """A place on a projected grid.

    Attributes
    ----------
    epsg
        Code of the coordinate reference system: 326zz in the north, 327zz in the south.
    easting, northing
        m.
    convergence
        Angle from true north to the grid's north, clockwise, rad.
    """

    epsg: int
    easting: float
    northing: float
    convergence: float


def utm_from_degrees(latitude: float, longitude: float) -> GridPlace:
    """Return the place of a latitude and longitude, deg, on the grid of its own zone."""
    zone = int((longitude + 180.0) // _ZONE_WIDTH_DEG) % 60 + 1
    central = math.radians(zone * _ZONE_WIDTH_DEG - 183.0)
    phi, lam = math.radians(latitude), math.radians(longitude) - central
    n = _FLATTENING / (2 - _FLATTENING)
    excentricity = math.sqrt(_FLATTENING * (2 - _FLATTENING))
    sine = math.sin(phi)
    tau = math.sinh(math.atanh(sine) - excentricity * math.atanh(excentricity * sine))
    xi, eta = math.atan2(tau, math.cos(lam)), math.asinh(math.sin(lam) / math.hypot(tau, math.cos(lam)))
    alpha = (
        n / 2 - 2 * n**2 / 3 + 5 * n**3 / 16,
        13 * n**2 / 48 - 3 * n**3 / 5,
        61 * n**3 / 240,
    )
    radius = _RADIUS / (1 + n) * (1 + n**2 / 4)
    east, north = eta, xi
    for order, factor in enumerate(alpha, start=1):
        east += factor * math.cos(2 * order * xi) * math.sinh(2 * order * eta)
        north += factor * math.sin(2 * order * xi) * math.cosh(2 * order * eta)
    return GridPlace(
        epsg=(32600 if latitude >= 0 else 32700) + zone,
        easting=_FALSE_EASTING + _SCALE * radius * east,
        northing=_SCALE * radius * north + (0.0 if latitude >= 0 else _FALSE_NORTHING),
        convergence=math.atan(math.tan(lam) * sine),
    )
