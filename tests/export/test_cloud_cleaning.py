"""Maps written with exact stairs: what is in the file, point by point."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cloud_files import POINTS, write_binary_pcd
from stairmap.errors import OutputError
from stairmap.export.cloud_cleaning import write_clean_cloud
from stairmap.export.stair_points import points_from_stairways
from stairmap.recordings.clouds.open import open_cloud
from stairmap.transforms import transform_points
from walkable_stairways import make_flight, make_stairway

STAIRWAY = make_stairway(make_flight(base=(1.0, 0.0, 0.0), num_risers=5))
SHIFT = np.array([[0.0, -1.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, -0.25], [0.0, 0.0, 0.0, 1.0]])
SMEARED = np.array([[1.42, 0.1, 0.33], [1.7, -0.3, 0.55]])
"""Points on the second and third tread, in the map."""


def clean(tmp_path: Path, name: str, shift: float = 0.0) -> tuple[bytes, tuple[int, int], list[int]]:
    """The file that is written for a cloud, what is said of it, and how far it was said to be."""
    inverse = np.linalg.inv(SHIFT)
    source = tmp_path / "map.pcd"
    points = np.concatenate(
        [POINTS + np.array([0.0, 0.0, shift]), transform_points(inverse, SMEARED), [[np.nan] * 3]]
    )
    write_binary_pcd(source, points)
    told: list[int] = []
    counts = write_clean_cloud(
        tmp_path / name, [open_cloud(source)], SHIFT, [STAIRWAY], on_points=told.append
    )
    return (tmp_path / name).read_bytes(), counts, told


@pytest.mark.parametrize(("name", "kind"), [("clean.ply", "<f8"), ("clean.PLY", "<f8"), ("clean.pcd", "<f4")])
def test_a_clean_map_holds_what_was_kept_and_the_exact_stairs(tmp_path: Path, name: str, kind: str) -> None:
    data, (num_removed, num_added), told = clean(tmp_path, name)
    end = b"end_header\n" if kind == "<f8" else b"DATA binary\n"
    header, body = data.split(end, 1)
    found = np.frombuffer(body, kind).reshape(-1, 3)
    added = points_from_stairways([STAIRWAY]).points
    kept = transform_points(SHIFT, POINTS.astype("<f4").astype(np.float64))
    assert (num_added, sum(told)) == (len(added), len(POINTS) + 3)
    assert num_removed >= 2
    assert len(found) == len(kept) + 2 - num_removed + num_added
    np.testing.assert_allclose(found[-num_added:], added, atol=1e-6)
    assert (np.abs(found[:-num_added, None] - SMEARED).max(axis=2) > 0.01).all()
    assert (np.abs(found[:-num_added, None] - kept).max(axis=2).min(axis=1) < 1e-5).all()
    count = f"{len(found):012d}".encode()
    assert header.count(count) == (1 if kind == "<f8" else 2)


def test_a_pcd_holds_nothing_beyond_10_km(tmp_path: Path) -> None:
    clean(tmp_path, "near.pcd", shift=9_990.0)
    with pytest.raises(OutputError, match="beyond 10000 m"):
        clean(tmp_path, "far.pcd", shift=10_010.0)
    assert not list(tmp_path.glob("far*"))
    clean(tmp_path, "far.ply", shift=10_010.0)


def test_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"ends in \.ply or \.pcd"):
        write_clean_cloud(tmp_path / "clean.xyz", [], np.eye(4), [STAIRWAY])
