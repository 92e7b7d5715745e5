"""Scenes hold what they promise."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from stairmap.simulation.look_alikes import LOOK_ALIKES
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import SCENE_GROUPS, SCENES, make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.simulate import Simulation
from stairmap.simulation.visibility import measure_visibility

WITH_STAIRS = sorted(set(SCENES) - set(LOOK_ALIKES))


@pytest.mark.parametrize("name", sorted(SCENES))
def test_a_scene_and_its_seed_give_the_same_mesh_bit_for_bit(name: str) -> None:
    first, again = make_scene(name, 11), make_scene(name, 11)
    assert first.name == name
    assert first.mesh.vertices.tobytes() == again.mesh.vertices.tobytes()
    assert [stairway.id for stairway in first.stairways] == list(range(1, len(first.stairways) + 1))


@pytest.mark.parametrize("name", sorted(LOOK_ALIKES))
def test_look_alikes_have_no_truth(name: str) -> None:
    assert make_scene(name, 0).stairways == ()
    assert make_scene(name, 0).optional_stairways == ()


@pytest.mark.parametrize("name", WITH_STAIRS)
def test_the_route_shows_every_stairway_to_a_robot(name: str) -> None:
    scene = make_scene(name, 2)
    sensor = make_sensor("ideal", factor=0.5)
    simulation = Simulation(scene, sensor, ROBOTS["spot"], seed=0)
    for stairway in scene.stairways:
        seen = [
            measure_visibility(flight, simulation.caster, sensor.camera, simulation.true_poses, 5.0)
            for flight in stairway.flights
        ]
        assert max(visibility.num_frames_within(5.0, np.radians(60)) for visibility in seen) >= 10


@pytest.mark.parametrize("name", sorted(SCENES))
def test_the_robot_never_drives_through_anything(name: str) -> None:
    simulation = Simulation(make_scene(name, 2), make_sensor("ideal"), ROBOTS["packbot"], seed=0)
    centers = simulation.true_poses[:, :3, 3]
    for start, end in pairwise(centers):
        if np.linalg.norm(end - start) > 1e-3:
            assert simulation.caster.is_visible(start, end[None])[0]


def test_table_1_has_the_reports_dimensions() -> None:
    flight = make_scene("davis_rear", 0).stairways[0].flights[0]
    assert (flight.rise, flight.run, flight.width) == pytest.approx((0.165, 0.292, 1.175), abs=0.004)
    assert len(SCENE_GROUPS["table1"]) == 5


def test_groups_cover_all_scenes_once() -> None:
    assert sorted(name for group in SCENE_GROUPS.values() for name in group) == sorted(SCENES)


def test_random_scenes_differ_by_seed() -> None:
    assert (
        make_scene("random", 1).stairways[0].flights[0].rise
        != make_scene("random", 2).stairways[0].flights[0].rise
    )


def test_unknown_scenes_and_buildings_without_a_folder_are_refused() -> None:
    with pytest.raises(ValueError, match="davis_rear"):
        make_scene("atlantis", 0)
    with pytest.raises(ValueError, match="needs the folder"):
        make_scene("building:duplex_a", 0)
