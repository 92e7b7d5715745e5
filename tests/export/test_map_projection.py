"""UTM against PROJ 9, to a millimetre."""

from __future__ import annotations

import math

import pytest

from stairmap.export.map_projection import utm_from_degrees


@pytest.mark.parametrize(
    ("degrees", "epsg", "easting", "northing", "convergence_deg"),
    [
        ((48.2628, 11.6681), 32632, 698007.2777, 5348951.4485, 1.991596),
        ((-33.9, 18.4), 32734, 259583.2217, 6245888.0454, 1.450833),
        ((0.5, -179.5), 32601, 221734.2217, 55318.0400, -0.021830),
        ((60.1, 5.2), 32631, 622325.2644, 6664584.3093, 1.907407),
    ],
)
def test_places_on_the_grid_are_those_of_proj(degrees, epsg, easting, northing, convergence_deg):
    place = utm_from_degrees(*degrees)
    assert place.epsg == epsg
    assert place.easting == pytest.approx(easting, abs=1e-3)
    assert place.northing == pytest.approx(northing, abs=1e-3)
    assert math.degrees(place.convergence) == pytest.approx(convergence_deg, abs=1e-4)
