"""Grids of heights that NumPy saved."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from command_line import stairmap
from elevation_bags import stair_heights
from stairmap.errors import RecordingError
from stairmap.recordings.clouds.open import open_cloud


def test_a_saved_grid_is_scanned_like_a_map(tmp_path: Path) -> None:
    path = tmp_path / "heights.npz"
    np.savez(path, heights=stair_heights(0.03), resolution=0.03, origin=[100.0, 200.0])
    outcome = stairmap("scan", path, "-o", tmp_path / "run", "--json")
    assert outcome.code == 0, outcome.stderr
    ((flight,),) = (stairway["flights"] for stairway in json.loads(outcome.stdout)["stairways"])
    assert flight["rise"] == pytest.approx(0.17, abs=0.003)
    assert flight["run"] == pytest.approx(0.28, abs=0.005)
    np.testing.assert_allclose(flight["base"], [101.49, 202.25, 0.0], atol=0.04)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"z": np.zeros((4, 4))}, "but it has z"),
        ({"heights": np.zeros((4, 4)), "resolution": -1.0}, "got shape .4, 4. and -1.0 m"),
        ({"heights": np.zeros(4), "resolution": 0.1}, "expected a grid of heights"),
        ({"heights": np.zeros((4, 4)), "resolution": [0.1, 0.2]}, "expected heights"),
        ({"heights": np.array([["a"]]), "resolution": 0.1}, "expected heights"),
        ({"heights": np.zeros((4, 4)), "resolution": 0.1, "origin": 3.0}, "origin as two numbers"),
    ],
)
def test_what_is_no_grid_is_refused(tmp_path: Path, content: dict[str, object], message: str) -> None:
    path = tmp_path / "heights.npz"
    np.savez(path, **content)
    with pytest.raises(RecordingError, match=message):
        open_cloud(path)


def test_a_file_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "heights.npz"
    np.savez(path, heights=np.zeros((40, 40)), resolution=0.1)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(RecordingError, match="expected heights"):
        open_cloud(path)
