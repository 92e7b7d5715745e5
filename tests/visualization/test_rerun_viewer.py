"""Files for the rerun viewer, read back by rerun's own command."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy as np
import pytest

from stairmap.errors import MissingPackageError, OutputError
from stairmap.visualization.rerun_viewer import RerunViewer
from stairmap.visualization.run_replay import load_run, show_run
from stairmap.visualization.stairway_labels import find_viewpoint


def make_viewer(replay):
    return RerunViewer(
        replay.name,
        viewpoint=find_viewpoint(replay.stairways, replay.positions),
        positions=replay.positions,
        is_map=True,
    )


def write_rrd(run, path):
    replay = load_run(run)
    viewer = make_viewer(replay)
    viewer.save(path)
    show_run(replay, [viewer])
    return replay


def rerun_command(*arguments):
    command = [sys.executable, "-m", "rerun_cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def count_rows(path):
    """Number of rows for each entity and component of a file."""
    rows = {}
    pattern = re.compile(r"with (\d+) rows .*? - (/\S+) - data columns: \[(.*)\]")
    for match in pattern.finditer(rerun_command("rrd", "print", "-v", path)):
        for column in match[3].split():
            rows[column] = rows.get(column, 0) + int(match[1])
    return rows


@pytest.fixture(scope="module")
def written(run_folder, tmp_path_factory):
    pytest.importorskip("rerun")
    path = tmp_path_factory.mktemp("rrd") / "run.rrd"
    return write_rrd(run_folder, path), path


def test_file_is_sound(written):
    _, path = written
    rerun_command("rrd", "verify", path)


def test_every_frame_has_pose_depth_edges_and_a_line(written):
    replay, path = written
    rows = count_rows(path)
    for column in (
        "/map/camera@Transform3D:translation",
        "/map/camera/image/depth@DepthImage:buffer",
        "/map/camera/image/edges@LineStrips2D:strips",
        "/map/edges@LineStrips3D:strips",
        "/map/cloud@Points3D:positions",
        "/log@TextLog:text",
    ):
        assert rows[column] == replay.num_frames, column


def test_stairway_has_surface_nosings_box_and_plots(written):
    replay, path = written
    rows = count_rows(path)
    num_moments = len(replay.history) + 1
    for column in (
        "/map/stairways/1/surface@Mesh3D:vertex_positions",
        "/map/stairways/1/nosings@LineStrips3D:strips",
        "/map/stairways/1/flight_1/box@Boxes3D:half_sizes",
        "/map/stairways/1/flight_1/label@Points3D:labels",
        "/measures/rise/stairway_1@Scalars:scalars",
        "/measures/width/stairway_1@Scalars:scalars",
    ):
        assert rows[column] == num_moments, column
    assert rows["/measures/run/single_frames@Scalars:scalars"] == replay.num_frames


def test_label_tells_the_measures_with_units(written):
    replay, path = written
    flight = replay.stairways[0].flights[0]
    assert f"rise {flight.rise * 1e3:.0f} ± " in rerun_command("rrd", "print", "-vvv", path)


def test_stairway_that_was_merged_into_another_disappears(tmp_path, stairway, turning_stairway):
    pytest.importorskip("rerun")
    viewer = RerunViewer(
        "run", viewpoint=find_viewpoint([stairway], np.empty((0, 3))), positions=np.empty((0, 3)), is_map=True
    )
    viewer.save(tmp_path / "run.rrd")
    viewer.show_stairways([stairway, turning_stairway], 0, 0)
    viewer.show_stairways([stairway], 1, 100)
    viewer.close()
    rows = count_rows(tmp_path / "run.rrd")
    assert rows["/map/stairways/2@Clear:is_recursive"] == 1
    assert "/map/stairways/1@Clear:is_recursive" not in rows
    assert rows["/map/stairways/2/flight_2/box@Boxes3D:half_sizes"] == 1


def test_run_without_a_stairway_gives_a_file_with_its_frames(empty_run_folder, tmp_path):
    pytest.importorskip("rerun")
    write_rrd(empty_run_folder, tmp_path / "run.rrd")
    rows = count_rows(tmp_path / "run.rrd")
    assert rows["/log@TextLog:text"] == 3
    assert not any(column.startswith("/map/stairways") for column in rows)


def test_file_that_cannot_be_written_is_an_error(run_folder, tmp_path):
    pytest.importorskip("rerun")
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write"):
        make_viewer(load_run(run_folder)).save(tmp_path / "file" / "run.rrd")


def test_missing_package_names_its_extra(run_folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(MissingPackageError, match=r"stairmap\[rerun\]"):
        make_viewer(load_run(run_folder))
