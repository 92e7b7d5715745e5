"""What planners are told of a dock and of stairs: edges at once, then masks, floors and portals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analytic_stairs import pose_looking
from drop_scenes import dock, stairs_down
from solid_scenes import frame_of
from stairmap.config import Config
from stairmap.detection.drops import DropEdge
from stairmap.detection.observation import Detection
from stairmap.modeling.landings import top_of
from stairmap.navigation.robot_profile import load_robot
from stairmap.simulation.triangle_mesh import TriangleMesh, make_rectangle
from stairmap.transforms import transform_points
from stairmap_ros.floor_answers import (
    EMPTY_MASK,
    FloorAnswer,
    answer_floors,
    find_current_level,
    passable_ids,
)
from stairmap_ros.obstacle_points import obstacle_points
from stairmap_ros.stairway_map import MapAnswer, StairwayMap

HEIGHT = 0.6


class Drive:
    """A map that a robot makes on its way towards x = 0."""

    def __init__(self, *, views_per_place: int = 10, height: float = HEIGHT, down_deg: float = 25.0) -> None:
        self._height, self._down_deg = height, down_deg
        self.map = StairwayMap(Config(), method="stairmap", views_per_place=views_per_place)
        self.detection: Detection | None = None
        self.pose = np.eye(4)

    def look(self, solid: TriangleMesh, distance: float) -> None:
        self.pose = pose_looking((-distance, 0.0, self._height), down=np.radians(self._down_deg))
        image = frame_of([solid], self.pose, has_up=False)
        frame = self.map.frame(image.depth, image.camera)
        self.detection = self.map.detect(frame, self.pose)
        self.map.add(frame, self.detection, frame.stamp_ns, self.pose)
        self.map._next_query = 0.0

    def points(self, passable: tuple[int, ...] = ()) -> np.ndarray:
        return obstacle_points(self.map.answer(), passable, self.detection, self.pose)


@pytest.fixture(scope="module")
def at_dock() -> Drive:
    drive = Drive()
    for distance in np.linspace(2.4, 0.9, 8):
        drive.look(dock(0.8), float(distance))
    return drive


@pytest.fixture(scope="module")
def at_stairs() -> Drive:
    """From 1.4 m above the ground, where treads are seen."""
    drive = Drive(height=1.4, down_deg=40.0)
    for distance in np.linspace(1.6, 0.6, 9):
        drive.look(stairs_down(), float(distance))
    return drive


def near_middle(points: np.ndarray) -> np.ndarray:
    """Of (N, 2 or 3) points those near the robot's way."""
    return points[np.abs(points[:, 1]) < 0.2]


def test_an_edge_is_an_obstacle_from_the_first_image() -> None:
    drive = Drive()
    drive.look(dock(0.8), 1.5)
    assert drive.map.answer().drops == ()
    points = near_middle(drive.points())
    assert len(points) > 10
    assert np.abs(points[:, 0]).max() < 0.06
    assert points[:, 2].min() > 0.02


def test_an_edge_of_the_map_is_an_obstacle_when_no_image_shows_it(at_dock: Drive) -> None:
    points = obstacle_points(at_dock.map.answer(), (), None, at_dock.pose)
    assert np.abs(near_middle(points)[:, 0]).max() < 0.06


def test_edges_of_another_floor_are_no_obstacles(at_dock: Drive) -> None:
    above = at_dock.pose.copy()
    above[2, 3] += 3.0
    assert len(obstacle_points(at_dock.map.answer(), (), None, above)) == 0
    below = at_dock.pose.copy()
    below[2, 3] -= 3.0
    assert len(obstacle_points(at_dock.map.answer(), (), None, below)) == 0


def test_nothing_is_told_before_the_first_image() -> None:
    assert len(obstacle_points(MapAnswer(), (), None, None)) == 0


def test_the_mask_holds_before_the_edge_of_a_dock(at_dock: Drive) -> None:
    answer = answer_floors(at_dock.map.answer(), at_dock.map.trajectory, None, FloorAnswer())
    assert answer.floors is not None
    (floor,) = answer.floors.floors
    assert floor.height == pytest.approx(0.0, abs=0.03)
    mask = answer.masks[floor.level]
    rows, columns = np.nonzero(mask.cells == 100)
    forbidden = near_middle(mask.centers(rows, columns))
    assert forbidden[:, 0].min() < -0.27
    assert find_current_level(answer, at_dock.pose[:3, 3]) == floor.level


def test_ground_alone_tells_of_a_floor_and_its_mask_is_empty() -> None:
    drive = Drive()
    for distance in np.linspace(5.0, 3.5, 6):
        drive.look(make_rectangle((-8, -4), (8, 4), 0.0), float(distance))
    assert drive.map.answer().camera_height == pytest.approx(HEIGHT, abs=0.02)
    answer = answer_floors(drive.map.answer(), drive.map.trajectory, None, FloorAnswer())
    assert answer.floors is not None
    assert answer.masks == {0: EMPTY_MASK}


def test_images_of_ground_from_one_place_do_not_fill_the_memory() -> None:
    drive = Drive(views_per_place=10)
    for _ in range(20):
        drive.look(make_rectangle((-8, -4), (8, 4), 0.0), 3.0)
    assert len(drive.map.viewpoints) == 3


def test_stairs_down_are_forbidden_to_wheels_and_a_way_for_who_climbs_them(at_stairs: Drive) -> None:
    answer = at_stairs.map.answer()
    assert len(answer.stairways) == 1
    spot = load_robot("spot")
    passable = passable_ids(answer, spot)
    assert passable == (answer.stairways[0].id,)
    assert passable_ids(answer, None) == ()
    wheels = answer_floors(answer, at_stairs.map.trajectory, None, FloorAnswer())
    legs = answer_floors(answer, at_stairs.map.trajectory, spot, FloorAnswer())
    assert (wheels.masks[0].cells == 100).any()
    assert [portal.verdict for portal in legs.portals] == ["passable"]
    num_forbidden = [np.count_nonzero(near_cells(floors)) for floors in (wheels, legs)]
    assert num_forbidden[0] > 20
    assert num_forbidden[1] == 0
    assert len(near_middle(at_stairs.points())) > 10
    assert len(near_middle(at_stairs.points(passable))) == 0


def test_the_side_of_a_well_is_an_obstacle_to_who_climbs_its_stairs(at_stairs: Drive) -> None:
    """Edges of a first image within 0.4 m of the stairs were taken for theirs, whichever way they ran."""
    answer = at_stairs.map.answer()
    (flight,) = answer.stairways[0].flights
    passable = passable_ids(answer, load_robot("spot"))
    left = np.array([-flight.forward[1], flight.forward[0], 0.0])
    ends = {
        "side": (0.6 * left, 0.6 * left - flight.forward),
        "front": (0.5 * left, -0.5 * left),
        "platform": (0.5 * left, -3.5 * left),
    }
    camera_from_map = np.linalg.inv(at_stairs.pose)
    for name, offsets in ends.items():
        edge = transform_points(camera_from_map, top_of(flight) + np.array(offsets))
        seen = replace(
            at_stairs.detection,
            observations=(),
            drops=(DropEdge(edge=edge, depth=1.0, num_rays=9),),
        )
        points = obstacle_points(replace(answer, drops=()), passable, seen, at_stairs.pose)
        assert (len(points) > 20) == (name != "front")


def near_cells(answer: FloorAnswer) -> np.ndarray:
    """Which cells on the robot's way to the stairs the mask of floor 0 forbids."""
    mask = answer.masks[0]
    rows, columns = np.nonzero(mask.cells == 100)
    return near_middle(mask.centers(rows, columns))


def test_floors_keep_their_ids_and_the_robot_its_floor_on_stairs(at_stairs: Drive) -> None:
    first = answer_floors(at_stairs.map.answer(), at_stairs.map.trajectory, None, FloorAnswer())
    again = answer_floors(at_stairs.map.answer(), at_stairs.map.trajectory, None, first)
    assert first.floors is not None
    assert again.floors is not None
    assert [floor.id for floor in again.floors.floors] == [floor.id for floor in first.floors.floors]
    assert find_current_level(first, np.array([-1.0, 0.0, 1.4])) == 0
    on_floor = FloorAnswer(floors=first.floors, masks=first.masks, current_level=0)
    assert find_current_level(on_floor, np.array([1.0, 0.0, 0.4])) == 0
