"""Trajectories survive TUM files, and a bad pose is named by its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.errors import OutputError, TrajectoryError
from stairmap.recordings.tum_trajectory import dump_tum_trajectory, load_tum_trajectory
from stairmap.trajectory import Trajectory
from stairmap.transforms import rotation_from_quat, transform_from_parts

GOOD = "1 0 0 0 0 0 0 1\n"


@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.sampled_from([1.0, 1e3, 5e6]))
def test_trajectories_survive_the_file(
    tmp_path_factory: pytest.TempPathFactory, seed: int, num_poses: int, extent: float
) -> None:
    random = np.random.default_rng(seed)
    trajectory = Trajectory(
        stamps_ns=np.cumsum(random.integers(1, 10**18, num_poses)),
        map_from_camera=np.array(
            [
                transform_from_parts(
                    rotation_from_quat(random.normal(size=4)), random.uniform(-extent, extent, 3)
                )
                for _ in range(num_poses)
            ]
        ),
    )
    path = tmp_path_factory.getbasetemp() / "trajectory.tum"
    dump_tum_trajectory(path, trajectory)
    again = load_tum_trajectory(path)
    np.testing.assert_array_equal(again.stamps_ns, trajectory.stamps_ns)
    np.testing.assert_allclose(again.map_from_camera, trajectory.map_from_camera, rtol=0, atol=2e-9)


def test_the_columns_are_those_of_tum(tmp_path: Path) -> None:
    path = tmp_path / "groundtruth.txt"
    path.write_text("# comment\n1305031098.6659 1.3563 0.6305 1.6380 0.0 0.0 0.7071 0.7071\n")
    trajectory = load_tum_trajectory(path)
    assert trajectory.stamps_ns.tolist() == [1305031098665900000]
    np.testing.assert_allclose(
        trajectory.map_from_camera[0],
        [[0, -1, 0, 1.3563], [1, 0, 0, 0.6305], [0, 0, 1, 1.638], [0, 0, 0, 1]],
        atol=1e-12,
    )


def test_a_rounded_quaternion_is_normalised(tmp_path: Path) -> None:
    path = tmp_path / "trajectory.txt"
    path.write_text("0 0 0 0 0 0 0.71 0.71\n")
    rotation = load_tum_trajectory(path).map_from_camera[0, :3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("2 0 0 0 0 0 0 nan", "expected finite numbers .* got 'nan'"),
        ("2 inf 0 0 0 0 0 1", "expected finite numbers .* got 'inf'"),
        ("2 0 0 x 0 0 0 1", "expected finite numbers .* got 'x'"),
        ("nan 0 0 0 0 0 0 1", "expected a stamp in seconds, got 'nan'"),
        ("2 0 0 0 0 0 0 0", "unit quaternion qx qy qz qw, got one of length 0;"),
        ("2 0 0 0 0 0 0 1.02", "unit quaternion .* of length 1.02"),
        ("2 0 0 0 1 1 0 1", "check the order of the columns"),
        ("2 0 0 0 1e200 1e200 0 1", "unit quaternion .* of length inf"),
        ("2 1e8 0 0 0 0 0 1", r"within 1e\+07 m of the map's origin, got 1e\+08 m"),
        ("2 1 0 0 0 0 1 0 0 0 0 1 0", "expected 8 columns .* got 13"),
        ("2 1 0 0 0", "expected 8 columns 'stamp_s tx ty tz qx qy qz qw', got 5"),
        ("2,0,0,0,0,0,0,1", "spaces, not commas"),
        ("1.000 0 0 0 0 0 0 1", "same as that of line 1"),
        ("0.5 0 0 0 0 0 0 1", "before that of line 1"),
    ],
)
def test_a_bad_pose_is_named(tmp_path: Path, line: str, message: str) -> None:
    path = tmp_path / "groundtruth.txt"
    path.write_text(f"{GOOD}{line}\n9 0 0 0 0 0 0 1\n")
    with pytest.raises(TrajectoryError, match=f"groundtruth.txt:2: .*{message}"):
        load_tum_trajectory(path)


def test_a_file_without_poses_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "groundtruth.txt"
    path.write_text("# ground truth trajectory\n")
    with pytest.raises(TrajectoryError, match="it has none"):
        load_tum_trajectory(path)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(TrajectoryError, match=r"cannot read .*none.tum: No such file"):
        load_tum_trajectory(tmp_path / "none.tum")


def test_a_folder_that_is_not_there_cannot_be_written(tmp_path: Path) -> None:
    trajectory = Trajectory(stamps_ns=np.array([0]), map_from_camera=np.eye(4)[None])
    with pytest.raises(OutputError, match=r"cannot write .*trajectory\.tum"):
        dump_tum_trajectory(tmp_path / "none" / "trajectory.tum", trajectory)
