"""Planning over floors, and exploration: cheap frontiers first, then the stairs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stairmap.navigation.exploration import find_candidates, find_frontiers
from stairmap.navigation.floors import Floor, FloorError, FloorStack, find_floors
from stairmap.navigation.footprints import stair_rectangles
from stairmap.navigation.keepout import ForbiddenGround, block_stairs, cover_mask, make_keepout_mask
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.navigation.planner import FloorPlanner
from stairmap.navigation.portals import make_portals
from stairmap.navigation.robot_profile import load_robot
from walkable_stairways import make_flight, make_half_turn, make_stairway


def building(num_floors, robot="spot", rise=3.0 / 18, run=0.29):
    """Return portals of a tower whose stairs turn at each floor, 20 by 20 m."""
    stairways = [
        make_stairway(
            make_flight(
                base=(4.0 if level % 2 == 0 else 14.0, 2.0 + 3 * level, 3.0 * level),
                heading=0.0 if level % 2 == 0 else math.pi, rise=rise, run=run, num_risers=round(3.0 / rise),
            ),
            stairway_id=level + 1,
        )
        for level in range(num_floors - 1)
    ]  # fmt: skip
    if not stairways:
        return [], None, ()
    floors = find_floors(stairways)
    return stairways, floors, make_portals(stairways, floors, load_robot(robot))


def empty_grid(side=100, resolution=0.2):
    return OccupancyGrid(cells=np.zeros((side, side), dtype=np.int8), resolution=resolution, origin=(0, 0))


def planner(num_floors=4, robot="spot", grids=None, **options):
    _, _, portals = building(num_floors, robot)
    grids = {level: empty_grid() for level in range(num_floors)} if grids is None else grids
    return FloorPlanner(grids, portals, load_robot(robot), **options)


def test_a_route_over_four_floors_takes_all_three_stairways():
    route = planner().find_route(0, (1, 1), 3, (18, 18))
    assert [leg.kind for leg in route.legs] == ["floor", "up", "floor", "up", "floor", "up", "floor"]
    assert [leg.stairway_id for leg in route.legs if leg.stairway_id] == [1, 2, 3]
    assert route.cost == pytest.approx(sum(leg.cost for leg in route.legs))


def test_the_way_down_is_the_way_up_backwards():
    tower = planner()
    down = tower.find_route(3, (18, 18), 0, (1, 1))
    assert [leg.kind for leg in down.legs][1::2] == ["down"] * 3
    assert down.cost > tower.find_route(0, (1, 1), 3, (18, 18)).cost


def test_a_straight_way_costs_its_time():
    route = planner(1, grids={0: empty_grid()}).find_route(0, (1.1, 1.1), 0, (11.1, 1.1))
    assert route.cost == pytest.approx(10.0 / 0.5)


def test_stairs_that_the_robot_cannot_climb_are_not_used_and_the_route_says_so():
    route = planner(robot="wheeled").find_route(0, (1, 1), 3, (18, 18))
    assert not route
    assert "stairway 1 (floor 0 to 1) is impassable for wheeled robot: rise" in route.reason


def test_unknown_stairs_are_used_only_if_allowed():
    assert not planner(robot="anymal").find_route(0, (1, 1), 1, (18, 18))
    assert planner(robot="anymal", allow_unknown=True).find_route(0, (1, 1), 1, (18, 18))


def test_a_way_around_is_taken_instead_of_stairs():
    # Two floors and a wall across the lower one: a gap far away is still cheaper than up and down.
    cells = np.zeros((100, 100), dtype=np.int8)
    cells[:95, 50] = 100
    grids = {0: OccupancyGrid(cells=cells, resolution=0.2, origin=(0, 0)), 1: empty_grid()}
    route = planner(2, grids=grids).find_route(0, (8, 8), 0, (12, 8))
    assert {leg.kind for leg in route.legs} == {"floor"}


def test_the_robot_keeps_its_width_from_obstacles():
    cells = np.zeros((100, 100), dtype=np.int8)
    cells[:, 50] = 100
    cells[48:50, 50] = 0  # 0.4 m: too narrow for 0.6 m
    grids = {0: OccupancyGrid(cells=cells, resolution=0.2, origin=(0, 0))}
    assert not planner(1, grids=grids).find_route(0, (5, 5), 0, (15, 5))


def test_a_portal_that_ends_in_an_obstacle_is_explained():
    cells = np.zeros((100, 100), dtype=np.int8)
    cells[5:15, 12:22] = 100
    grids = {0: OccupancyGrid(cells=cells, resolution=0.2, origin=(0, 0)), 1: empty_grid()}
    route = planner(2, grids=grids).find_route(0, (10, 10), 1, (10, 10))
    assert "stairway 1 (floor 0 to 1) ends where the robot cannot be on floor 0" in route.reason


def test_an_end_without_map_or_ground_is_told():
    with pytest.raises(FloorError, match="the goal is on floor 9, which has no map; maps are of floors 0, 1"):
        planner(2).find_route(0, (1, 1), 9, (1, 1))
    with pytest.raises(FloorError, match=r"the start \(-9.00, 0.00\) on floor 0 is not within 0.5 m"):
        planner(2).find_route(0, (-9, 0), 1, (1, 1))
    with pytest.raises(FloorError, match="no map of any floor"):
        FloorPlanner({}, [])


def unknown_right_half(grid):
    cells = grid.cells.copy()
    cells[:, 60:] = -1
    return OccupancyGrid(cells=cells, resolution=grid.resolution, origin=grid.origin)


def test_exploration_takes_the_frontier_of_this_floor_first_then_the_stairs():
    candidates = find_candidates(planner(2, grids={0: unknown_right_half(empty_grid())}), 0, (2.0, 2.0))
    assert [candidate.kind for candidate in candidates] == ["frontier", "stairs"]
    assert candidates[0].cost < candidates[1].cost
    assert candidates[1].stairway_id == 1


def test_when_a_floor_is_explored_only_the_stairs_are_left():
    (only,) = find_candidates(planner(2, grids={0: empty_grid()}), 0, (2.0, 2.0))
    assert (only.kind, only.level) == ("stairs", 0)
    assert not find_candidates(planner(2, robot="wheeled", grids={0: empty_grid()}), 0, (2.0, 2.0))


def test_the_frontiers_of_another_floor_cost_the_stairs_too():
    grids = {0: empty_grid(), 1: unknown_right_half(empty_grid())}
    (frontier,) = find_candidates(planner(2, grids=grids), 0, (2.0, 2.0))
    assert (frontier.kind, frontier.level) == ("frontier", 1)
    assert frontier.cost > 60


def test_stairs_cover_the_floor_below_them_up_to_headroom_and_the_well_above():
    stairways, floors, _ = building(2)
    (below,) = stair_rectangles(stairways[0], floors, 0)
    (above,) = stair_rectangles(stairways[0], floors, 1)
    assert below.length == pytest.approx(12 * 0.29 + 0.05, abs=0.3)
    assert above.length == pytest.approx(17 * 0.29 + 2 * 0.30)
    assert below.width == above.width == pytest.approx(1.2)


def test_the_descending_edge_is_forbidden_and_the_ground_behind_it_is_not():
    stairways, floors, _ = building(2)
    mask = make_keepout_mask(ForbiddenGround(stairways=tuple(stairways)), floors, 1)
    edge = 4.0 + 17 * 0.29
    assert mask.value_at((edge + 0.2, 2.0)) == 100
    assert mask.value_at((edge - 0.2, 2.0)) == 100
    assert mask.value_at((edge + 0.5, 2.0)) == -1
    # The well's sides are edges as well: 0.3 m beside its 1.2 m of width.
    assert mask.value_at((edge + 0.2, 2.8)) == 100
    assert mask.value_at((edge + 0.2, 2.95)) == -1


def test_a_floor_that_no_stairway_touches_needs_no_mask():
    _, floors, _ = building(4)
    assert make_keepout_mask(ForbiddenGround(), floors, 2) is None


def test_a_mask_takes_the_extent_of_the_map():
    stairways, floors, _ = building(2)
    grid = empty_grid()
    mask = make_keepout_mask(ForbiddenGround(stairways=tuple(stairways)), floors, 0, like=grid)
    assert mask.cells.shape == grid.cells.shape
    assert np.count_nonzero(mask.cells == 100) == np.count_nonzero(
        cover_mask(grid, stair_rectangles(stairways[0], floors, 0))
    )


def test_a_half_turn_covers_both_flights_its_landing_and_its_eye_on_the_upper_floor():
    stairway = make_half_turn()
    assert len(stair_rectangles(stairway, find_floors([stairway]), 1)) == 4


def test_the_only_way_over_stairs_is_their_portal():
    stairways, floors, portals = building(2)
    grids = {level: block_stairs(empty_grid(), stairways, floors, level) for level in (0, 1)}
    assert grids[0].value_at((5.0, 2.0)) == 100
    assert FloorPlanner(grids, portals, load_robot("spot")).find_route(0, (1, 1), 1, (18, 18))


def test_each_leg_tells_where_it_begins_what_it_costs_and_its_way():
    _, _, portals = building(2)
    (portal,) = portals
    tower = planner(2)
    first, up, last = tower.find_route(0, (2.1, 2.1), 1, (12.1, 2.1)).legs
    assert (first.kind, first.level, up.kind, up.level, last.level) == ("floor", 0, "up", 0, 1)
    assert first.points[0] == pytest.approx([2.1, 2.1])
    assert first.points[-1] == pytest.approx(portal.lower.position[:2], abs=0.11)
    assert first.cost == pytest.approx(np.linalg.norm(np.diff(first.points, axis=0), axis=1).sum() / 0.5)
    assert np.array_equal(up.points, portal.way)
    assert up.cost == portal.cost_up
    assert last.points[0] == pytest.approx(portal.upper.position[:2], abs=0.11)
    assert last.points[-1] == pytest.approx([12.1, 2.1])
    back, down, _ = tower.find_route(1, (12.1, 2.1), 0, (2.1, 2.1)).legs
    assert (back.level, down.kind, down.level, down.stairway_id) == (1, "down", 1, 1)
    assert np.array_equal(down.points, portal.way[::-1])
    assert down.cost == portal.cost_down


def test_stairs_whose_ends_meet_are_taken_one_after_the_other_with_a_stop_on_the_floor_between():
    """The second begins where the first arrives, within a cell."""
    flights = [make_flight(base=(2.0, 5.1, 0.0), rise=1.7 / 10)]
    top = 2.0 + 9 * 0.28
    flights.append(make_flight(base=(top + 1.2, 5.1, 1.7)))
    stairways = [make_stairway(flight, stairway_id=number) for number, flight in enumerate(flights, start=1)]
    portals = make_portals(stairways, find_floors(stairways), load_robot("spot"))
    legs = (
        FloorPlanner({level: empty_grid() for level in range(3)}, portals, load_robot("spot"))
        .find_route(0, (1.3, 5.1), 2, (9.5, 5.1))
        .legs
    )
    assert [(leg.kind, leg.level) for leg in legs] == [
        ("floor", 0), ("up", 0), ("floor", 1), ("up", 1), ("floor", 2)
    ]  # fmt: skip
    assert len(legs[2].points) == 1
    assert legs[2].cost == 0


def test_a_route_of_no_way_at_all_is_one_leg():
    route = planner(1, grids={0: empty_grid()}).find_route(0, (1.1, 1.1), 0, (1.1, 1.1))
    assert route
    assert route.cost == 0
    assert [len(leg.points) for leg in route.legs] == [1]


def test_without_stairs_that_could_be_blamed_the_way_is_said_to_be_unseen():
    cells = np.zeros((100, 100), dtype=np.int8)
    cells[:, 50] = -1
    grids = {0: OccupancyGrid(cells=cells, resolution=0.2, origin=(0, 0))}
    route = planner(1, grids=grids).find_route(0, (5, 5), 0, (15, 5))
    assert route.reason == "there is no way to floor 0: no free way was seen"
    assert route.cost == math.inf


@pytest.mark.parametrize(("num_cells", "is_worth_it"), [(1, False), (2, True)])
def test_a_frontier_is_worth_a_visit_from_0_4_m(num_cells, is_worth_it):
    cells = np.full((9, 9), -1, dtype=np.int8)
    cells[4, 4 : 4 + num_cells] = 0
    grid = OccupancyGrid(cells=cells, resolution=0.2, origin=(0, 0))
    assert len(find_frontiers(grid, cells == 0)) == int(is_worth_it)


def test_a_frontier_is_the_free_and_open_cells_beside_unknown_ones_also_diagonally():
    cells = np.zeros((9, 9), dtype=np.int8)
    cells[0, :5], cells[8, 8] = -1, -1
    cells[1, 1] = 100
    is_open = cells == 0
    is_open[1, 0] = False
    grid = OccupancyGrid(cells=cells, resolution=0.5, origin=(0, 0))
    first, second = find_frontiers(grid, is_open)
    assert first.tolist() == [[0, 5], [1, 2], [1, 3], [1, 4], [1, 5]]
    assert second.tolist() == [[7, 7], [7, 8], [8, 7]]


def test_a_frontier_is_gone_to_where_it_is_nearest_and_told_with_its_length():
    (frontier,) = [
        candidate
        for candidate in find_candidates(
            planner(1, grids={0: unknown_right_half(empty_grid())}), 0, (2.1, 7.1)
        )
        if candidate.kind == "frontier"
    ]
    assert frontier.position == pytest.approx([11.9, 7.1])
    assert frontier.size == pytest.approx(100 * 0.2)
    assert frontier.cost == pytest.approx((11.9 - 2.1) / 0.5)
    assert frontier.stairway_id is None
    assert frontier.to_dict() == {
        "kind": "frontier", "level": 0, "position": frontier.position.tolist(), "cost": frontier.cost,
        "size": frontier.size, "stairway": None,
    }  # fmt: skip


def test_a_frontier_that_cannot_be_reached_is_no_candidate():
    cells = np.zeros((100, 100), dtype=np.int8)
    cells[:, 40:44], cells[:, 60:] = 100, -1
    grids = {0: OccupancyGrid(cells=cells, resolution=0.2, origin=(0, 0))}
    assert find_candidates(planner(1, grids=grids), 0, (2.1, 7.1)) == ()


def test_stairs_cost_the_way_to_them_and_the_climb_up_or_down():
    _, _, (portal,) = building(2)
    (up,) = find_candidates(planner(2, grids={0: empty_grid()}), 0, portal.lower.position[:2])
    assert up.cost == pytest.approx(portal.cost_up)
    assert up.position == pytest.approx(portal.lower.position[:2])
    assert math.isnan(up.size)
    x, y, _ = portal.upper.position
    (down,) = find_candidates(planner(2, grids={1: empty_grid()}), 1, (x + 0.2, y))
    assert (down.kind, down.level, down.stairway_id) == ("stairs", 1, 1)
    assert down.cost == pytest.approx(portal.cost_down + 0.2 / 0.5)
    assert down.position == pytest.approx(portal.upper.position[:2])


def test_stairs_of_unknown_verdict_are_candidates_only_where_the_planner_would_use_them():
    grids = {0: empty_grid()}
    assert find_candidates(planner(2, robot="anymal", grids=grids), 0, (2, 2)) == ()
    assert len(find_candidates(planner(2, robot="anymal", grids=grids, allow_unknown=True), 0, (2, 2))) == 1
    assert find_candidates(planner(2, robot="wheeled", grids=grids, allow_unknown=True), 0, (2, 2)) == ()


def test_stairs_behind_others_and_stairs_that_cannot_be_reached_are_told_apart():
    """Stairs 1 lead to floor 1, which has a map; stairs 2 lead on from there. Floor 3 is behind those."""
    (only,) = find_candidates(planner(4, grids={0: empty_grid(), 1: empty_grid()}), 0, (2, 2))
    assert (only.stairway_id, only.level) == (2, 1)
    cells = np.zeros((100, 100), dtype=np.int8)
    cells[:15, 12:22] = 100
    blocked = {0: OccupancyGrid(cells=cells, resolution=0.2, origin=(0, 0))}
    assert find_candidates(planner(2, grids=blocked), 0, (10, 10)) == ()


def test_candidates_come_cheapest_first():
    """From the upper floor, the frontier of the lower one costs the stairs too."""
    grids = {0: unknown_right_half(empty_grid()), 1: unknown_right_half(empty_grid())}
    costs = [candidate.cost for candidate in find_candidates(planner(2, grids=grids), 1, (2.0, 2.0))]
    assert len(costs) == 2
    assert costs == sorted(costs)


def test_stairs_that_cannot_be_used_do_not_hide_those_after_them():
    """Of four: too steep, between two known floors, ending in an obstacle, good."""
    flights = [
        make_flight(base=(2.0, 16.1, 0.0), rise=0.25, num_risers=12), make_flight(base=(2.0, 2.1, -1.7)),
        make_flight(base=(10.0, 6.1, 0.0)), make_flight(base=(2.0, 10.1, 0.0)),
    ]  # fmt: skip
    floors = FloorStack(
        floors=tuple(Floor(level=level, height=1.7 * level, is_explored=False) for level in (-1, 0, 1)),
        levels={1: (0, 1), 2: (-1, 0), 3: (0, 1), 4: (0, 1)},
    )
    stairways = [make_stairway(flight, stairway_id=number) for number, flight in enumerate(flights, start=1)]
    cells = np.zeros((100, 100), dtype=np.int8)
    cells[25:35, 40:60] = 100
    grids = {-1: empty_grid(), 0: OccupancyGrid(cells=cells, resolution=0.2, origin=(0, 0))}
    spot = load_robot("spot")
    candidates = find_candidates(FloorPlanner(grids, make_portals(stairways, floors, spot), spot), 0, (2, 14))
    assert [candidate.stairway_id for candidate in candidates] == [4]


def test_a_frontier_beside_an_obstacle_ends_where_the_robot_cannot_be():
    """Spot is 0.6 m wide: the centres of the two nearest cells of 0.2 m beside the obstacle are too near."""
    cells = unknown_right_half(empty_grid()).cells.copy()
    cells[40:50, 57:60] = 100
    grids = {0: OccupancyGrid(cells=cells, resolution=0.2, origin=(0, 0))}
    found = [
        item for item in find_candidates(planner(1, grids=grids), 0, (2.1, 9.1)) if item.kind == "frontier"
    ]
    assert sorted(item.size for item in found) == pytest.approx([39 * 0.2, 49 * 0.2])
