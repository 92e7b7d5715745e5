"""Whole missions in a small house of two floors, by the command line, and what goes wrong with them."""

from __future__ import annotations

import json

import numpy as np
import pytest
from small_worlds import stairs

from command_line import check_refused, stairmap
from full_disk import FullDisk
from stairmap.exploration.layer_map import RESOLUTION
from stairmap.exploration.strategies import VALUE_OF_AREA
from stairmap.navigation.occupancy import FREE, load_map
from stairmap.simulation.storeys import make_partition, make_shell
from stairmap.simulation.triangle_mesh import joined

DISK_SIZE = 4_000_000
"""Of a disk that the recording of the small house fills, bytes; 2 MiB of it are kept free for results."""


def write_mesh(folder, mesh):
    """Write what ``building:NAME`` needs."""
    faces = np.zeros(len(mesh.triangles), dtype=[("num", "u1"), ("corners", "<i4", 3)])
    faces["num"], faces["corners"] = 3, mesh.triangles
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    folder.mkdir(parents=True)
    content = header.encode() + mesh.vertices.astype("<f4").tobytes() + faces.tobytes()
    (folder / "mesh.ply").write_bytes(content)


@pytest.fixture(scope="module")
def buildings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("buildings")
    mesh, _ = stairs()
    write_mesh(folder / "house", joined([mesh, make_shell((0.0, 0.0, 6.6, 4.0), -0.1, 3.0)]))
    write_mesh(folder / "wall", make_partition((0.0, 0.0), (4.0, 0.0), 0.0, 2.0))
    return folder


def explore(buildings, world, *arguments):
    options = ("--buildings", buildings, "--perfect-odometry", "--no-report")
    return stairmap("explore", f"building:{world}", *options, *arguments)


def events(folder, name):
    lines = (folder / "decisions.jsonl").read_text(encoding="utf-8").splitlines()
    return [entry for entry in map(json.loads, lines) if entry["event"] == name]


@pytest.fixture(scope="module")
def mission(buildings, tmp_path_factory):
    """Run folder of a mission and what the command said."""
    folder = tmp_path_factory.mktemp("missions") / "run"
    return folder, explore(buildings, "house", "--start", "1,2,0", "-o", folder, "--json")


def test_a_robot_finishes_its_floor_climbs_and_maps_the_next(mission):
    folder, outcome = mission
    assert outcome.code == 0, outcome.stderr
    result = json.loads((folder / "exploration.json").read_text(encoding="utf-8"))
    assert json.loads(outcome.stdout)["floors_reached"] == result["floors_reached"] == 2
    assert result["stopped"] == "nothing reachable is left"
    assert result["falls"] == result["collisions"] == 0
    assert [level["height"] for level in result["levels"]] == pytest.approx([0.0, 0.9], abs=0.03)
    assert len(events(folder, "climb")) == result["stairs_climbed"] == 1
    # The lower floor has 22.6 m² beside the flight, the upper one 12 m².
    for number, least in ((0, 16.0), (1, 11.0)):
        grid = load_map(folder / "maps" / f"level_{number}.yaml")
        assert np.count_nonzero(grid.cells == FREE) * RESOLUTION**2 > least


def test_no_stairs_are_used_while_something_on_the_floor_is_worth_its_way(mission):
    chosen = [
        entry for entry in events(mission[0], "decision") if (entry["chosen"] or {}).get("kind") == "stairs"
    ]
    assert chosen
    for entry in chosen:
        others = [task for task in entry["tasks"] if task["kind"] != "stairs"]
        assert not [task for task in others if task["cost"] < VALUE_OF_AREA * task["gain"]]


def test_with_a_full_disk_and_a_robot_that_climbs_nothing_the_floor_is_mapped_and_the_results_are_kept(
    buildings, tmp_path, monkeypatch
):
    folder = tmp_path / "run"
    FullDisk(monkeypatch, tmp_path, DISK_SIZE)
    outcome = explore(buildings, "house", "--start", "1,2,0", "--robot", "wheeled", "-o", folder)
    assert outcome.code == 1
    assert "No space left on device" in outcome.stderr
    assert "Traceback" not in outcome.stderr
    result = json.loads((folder / "exploration.json").read_text(encoding="utf-8"))
    assert result["stopped"] == "nothing reachable is left"
    assert result["floors_reached"] == 1
    assert result["stairs_climbed"] == result["falls"] == result["collisions"] == 0
    assert json.loads((folder / "stairways.json").read_text(encoding="utf-8"))["schema"]


def test_a_world_without_a_floor_is_refused(buildings, tmp_path):
    check_refused(explore(buildings, "wall", "-o", tmp_path / "run"), "a world with a floor", "--start")


@pytest.mark.parametrize(
    ("start", "flaw"),
    [("0.15,0.5,0", "in a wall"), ("1,2,30", "no ground"), ("2.9,2,0.45", "stairs"), ("nan,2,0", "finite")],
)
def test_a_start_where_nobody_can_stand_is_refused(buildings, tmp_path, start, flaw):
    outcome = explore(buildings, "house", "--start", start, "-o", tmp_path / "run")
    assert outcome.code in (1, 2)
    assert flaw in outcome.stderr
    assert not (tmp_path / "run").exists()
