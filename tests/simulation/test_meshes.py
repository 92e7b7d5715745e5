"""Buildings' truth agrees with their meshes."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from stairmap.errors import RecordingError
from stairmap.evaluation.data_folder import DATA_FOLDER
from stairmap.simulation.meshes import load_building_scenes, load_ply
from stairmap.simulation.render import RayCaster
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scene import Scene
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.simulate import Simulation
from stairmap.simulation.visibility import measure_visibility

BUILDINGS = Path(__file__).resolve().parents[2] / DATA_FOLDER / "buildings"
PLANAR = {"acad2010": 3, "duplex_a": 2, "gz_nist_stairs_120": 1, "hospital": 6, "institute_var2": 12,
          "office_a": 4, "testmodel_ifc4add2": 1}  # fmt: skip
"""Flights with free floor or landing before them that must be found."""

needs_buildings = pytest.mark.skipif(not BUILDINGS.is_dir(), reason=f"no buildings at {BUILDINGS}")


def load(name: str) -> tuple[Scene, ...]:
    return load_building_scenes(BUILDINGS / name)


@needs_buildings
@pytest.mark.parametrize("name", sorted(PLANAR))
def test_treads_of_the_mesh_lie_at_the_true_heights(name: str) -> None:
    scene = load(name)[0]
    caster = RayCaster(scene.mesh)
    assert sum(len(stairway.flights) for stairway in scene.stairways) == PLANAR[name]
    for flight in (flight for stairway in scene.stairways for flight in stairway.flights):
        for step in flight.steps[:-1]:
            middle = step.nosing.mean(axis=0) + 0.05 * flight.forward
            column = middle + np.outer([0.12, 0.008, -0.008], [0.0, 0.0, 1.0])
            assert caster.is_visible(column[0], column[1:]).tolist() == [True, False]


@needs_buildings
@pytest.mark.parametrize("name", sorted(PLANAR))
def test_truth_agrees_with_the_table_of_measures(name: str) -> None:
    data = json.loads((BUILDINGS / name / "stairs.json").read_text())
    entries = [entry for stair in data["stairs"] for entry in stair["flights"] if entry["usable"]]
    flights = [flight for stairway in load(name)[0].stairways for flight in stairway.flights]
    assert len(entries) == len(flights)
    for flight in flights:
        entry = min(
            entries, key=lambda entry: np.linalg.norm(np.array(entry["first_edge_mid"]) - flight.base)
        )
        assert len(flight.steps) == flight.num_risers == entry["n_risers"]
        assert flight.base[2] + entry["total_rise"] == pytest.approx(flight.steps[-1].nosing[0, 2], abs=2e-3)
        top = flight.base + flight.forward * flight.run * (entry["n_treads"] - 1)
        np.testing.assert_allclose(top[:2], entry["last_edge_mid"][:2], atol=0.01)


@needs_buildings
@pytest.mark.parametrize("name", ["niedri", "export1", "fzk_haus_adt"])
def test_winding_stairs_hold_no_flight_that_must_be_found(name: str) -> None:
    (scene,) = load(name)
    assert scene.stairways == ()


@needs_buildings
@pytest.mark.parametrize("name", sorted(PLANAR))
def test_every_route_shows_its_flight(name: str) -> None:
    sensor = make_sensor("ideal", factor=0.5)
    for scene in load(name)[:6]:
        simulation = Simulation(scene, sensor, ROBOTS["spot"], seed=0)
        best = max(
            measure_visibility(
                flight, simulation.caster, sensor.camera, simulation.true_poses, 5.0
            ).num_frames_within(3.0, np.radians(60))
            for stairway in scene.stairways
            for flight in stairway.flights
        )
        assert best >= 5, scene.name


@needs_buildings
def test_buildings_are_scenes_by_name() -> None:
    assert make_scene("building:duplex_a/2", 0, buildings=BUILDINGS).name == "building:duplex_a/2"
    with pytest.raises(ValueError, match="numbered 1 to 2"):
        make_scene("building:duplex_a/3", 0, buildings=BUILDINGS)


def test_a_ply_of_triangles_is_read(tmp_path: Path) -> None:
    path = tmp_path / "mesh.ply"
    path.write_bytes(ply(b"\x03"))
    mesh = load_ply(path)
    np.testing.assert_allclose(mesh.vertices, [[0, 0, 0], [1, 0, 0], [0, 2, 0]])
    assert mesh.triangles.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"solid cube", "binary little-endian PLY"),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nend_header\n", "x y z"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "mesh.ply"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=message):
        load_ply(path)


def test_other_polygons_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "mesh.ply"
    path.write_bytes(ply(b"\x04"))
    with pytest.raises(RecordingError, match="three corners"):
        load_ply(path)


def test_a_missing_building_is_a_recording_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot read the mesh"):
        load_building_scenes(tmp_path / "nowhere")
    (tmp_path / "mesh.ply").write_bytes(ply(b"\x03"))
    (tmp_path / "stairs.json").write_text("{}")
    with pytest.raises(RecordingError, match="measured stairs"):
        load_building_scenes(tmp_path)


def ply(count: bytes) -> bytes:
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return (
        header.encode() + struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 2, 0) + count + struct.pack("<3i", 0, 1, 2)
    )
