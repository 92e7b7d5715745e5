"""Scans fall into treads and risers."""

from __future__ import annotations

import numpy as np

from stairmap.detection.elevation import Elevation
from stairmap.detection.profile_segments import label_cells


def test_cells_without_a_measurement_get_no_label_even_where_there_is_no_noise() -> None:
    slope = np.linspace(0.5, -0.8, 120, dtype=np.float32)
    q = np.full((120, 3), 0.5, np.float32)
    q[:40] = 0.0
    elevation = Elevation(slope=slope, inverse_distance=q, lateral=np.zeros_like(q), row_density=120 / 1.3)
    labels = label_cells(elevation, noise=0.0)
    assert not labels[:40].any()
    assert labels[60:100].all()
