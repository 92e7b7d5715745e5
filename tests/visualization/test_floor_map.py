"""Maps of floors and the picture of verdicts: what they must show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stairmap.navigation.codes import check_code, load_code
from stairmap.navigation.exploration import Candidate
from stairmap.navigation.floors import find_floors
from stairmap.navigation.occupancy import FREE, UNKNOWN, OccupancyGrid
from stairmap.navigation.planner import FloorPlanner
from stairmap.navigation.portals import make_portals
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.traversability import assess
from stairmap.visualization.floor_map import draw_floor_maps
from stairmap.visualization.verdicts import draw_verdicts
from walkable_stairways import make_flight, make_stairway

STAIRWAY = make_stairway(make_flight(base=(4, 5, 0), rise=3.0 / 18, num_risers=18))


def texts(figure):
    """Return every text of a figure."""
    found = [text.get_text() for axes in figure.axes for text in axes.texts]
    found += [axes.get_title() for axes in figure.axes]
    return " | ".join(found + [text.get_text() for legend in figure.legends for text in legend.get_texts()])


@pytest.fixture
def building():
    floors = find_floors([STAIRWAY])
    grid = OccupancyGrid(cells=np.zeros((100, 100), dtype=np.int8), resolution=0.1, origin=(0, 0))
    return floors, make_portals([STAIRWAY], floors, load_robot("spot")), {0: grid, 1: grid}


def test_each_floor_is_drawn_with_its_stairs_costs_and_the_way(building):
    floors, portals, grids = building
    route = FloorPlanner(grids, portals, load_robot("spot")).find_route(0, (1, 1), 1, (1, 9))
    figure = draw_floor_maps(floors, [STAIRWAY], portals, grids=grids, route=route)
    text = texts(figure)
    assert len(figure.axes) == 2
    assert "floor 0 at 0.00 m, not explored" in text
    assert "to floor 1" in text
    for name in ("planned way", "start", "goal", "passable for Boston Dynamics Spot", "stairs, arrow up"):
        assert name in text
    assert figure.axes[0].get_xlabel() == "map x, m"


def test_maps_are_cropped_to_what_is_known(building):
    floors, portals, _ = building
    cells = np.full((400, 400), UNKNOWN, dtype=np.int8)
    cells[150:250, 160:240] = FREE
    grid = OccupancyGrid(cells=cells, resolution=0.1, origin=(-16.0, -15.0))
    axes = draw_floor_maps(floors, [STAIRWAY], portals, grids={0: grid}).axes[0]
    # The free cells reach from 0 to 8 m and from 0 to 10 m, the stairs to x = 9.1 m; 1 m of margin.
    assert axes.get_xlim()[0] == pytest.approx(-1.0) and 8.9 < axes.get_xlim()[1] < 12.0
    assert axes.get_ylim() == pytest.approx((-1.0, 11.0))


def test_an_end_that_nobody_saw_is_told_on_its_floor(building):
    assert "may go on" not in texts(draw_floor_maps(building[0], [STAIRWAY], building[1]))
    stairway = replace(
        STAIRWAY, flights=(*STAIRWAY.flights[:-1], replace(STAIRWAY.flights[-1], top_seen=False))
    )
    floors = find_floors([stairway])
    text = texts(draw_floor_maps(floors, [stairway], make_portals([stairway], floors, load_robot("spot"))))
    assert text.count("may go on here") == 1
    assert text.count("or beyond:\nthe end of its stairs was not seen") == 1


def test_places_to_explore_are_numbered_with_their_cost(building):
    floors, portals, _ = building
    place = Candidate(kind="frontier", level=0, position=(2.0, 3.0), cost=12.0, size=1.0)
    assert "1: 12 s" in texts(draw_floor_maps(floors, [STAIRWAY], portals, candidates=[place]))


def test_verdicts_stand_in_words_with_the_measure_that_decides():
    robots = [load_robot(name) for name in ("spot", "go2", "anymal")]
    figure = draw_verdicts(
        [STAIRWAY],
        [assess(STAIRWAY, robot) for robot in robots],
        [check_code(STAIRWAY, load_code("ibc_dwelling"))],
    )
    text = texts(figure)
    for word in (
        "passable",
        "impassable",
        "unknown",
        "keeps",
        "not published",
        "≤ 160 mm",
        "18 risers of 167 mm",
    ):
        assert word in text
