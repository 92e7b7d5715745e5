"""Thirty drives of low and high robots to stairs, docks and wells, by all sensors: those of the benchmark."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.nightly


@pytest.mark.parametrize("kind", ["stairs", "dock", "well"])
def test_edges_are_known_in_time_and_no_mask_is_free_before_them(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(Path(__file__).resolve().parents[2] / "benchmarks")
    edges = importlib.import_module("edges")
    drives = [edges.run_drive(kind, number) for number in range(10)]
    assert len({drive.robot for drive in drives}) > 3
    assert {drive.sensor for drive in drives} == set(edges.SENSORS)
    for drive in drives:
        assert drive.known_at >= 0.5, drive
        assert (drive.num_invented, drive.num_free) == (0, 0), drive
        assert np.abs(drive.floor_error) <= 0.030, drive
    sys.modules.pop("edges")
