"""Cells of an edge: what frames say for it and against it, and where they put it."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.detection.drops import DropEdge
from stairmap.detection.ground import NUM_RANGE_BINS, GroundView
from stairmap.modeling.drop_cells import DropCells
from stairmap.modeling.drop_map import group_cells, split_straight
from stairmap.modeling.ground_table import GroundTable
from stairmap.transforms import transform_from_parts

HEIGHT = 0.6


def frame_with(edges, *, seen_to=0.0, stamp_ns=0, height=HEIGHT):
    """View and edges of a frame that saw all ground up to a distance ahead; axes forward, left and up."""
    is_seen = np.zeros((48, NUM_RANGE_BINS), dtype=bool)
    is_seen[:, : int(seen_to / 0.125)] = True
    view = GroundView(
        height=height, up=[0, 0, 1], forward=[1, 0, 0], bearing=np.linspace(1, -1, 48), is_seen=is_seen
    )
    table = GroundTable()
    table.add(stamp_ns, view, tuple(edges))
    return table.views[0], table.edges


def edge_ahead(distance, *, half=0.015, depth=0.5, up=-HEIGHT, left=0.0):
    """An edge across the view, so short that it is of one cell."""
    ends = [[distance, left + half, up], [distance, left - half, up]]
    return DropEdge(edge=np.array(ends), depth=depth, num_rays=9)


def at(x=0.0, y=0.0, z=HEIGHT):
    return transform_from_parts(np.eye(3), [x, y, z])


def one_cell(*distances, depth=0.5):
    """Cells after frames that saw one edge, at x = 2, from these distances."""
    cells = DropCells()
    for stamp_ns, distance in enumerate(distances):
        frame = frame_with([edge_ahead(distance, half=0.021, depth=depth)], stamp_ns=stamp_ns)
        cells.add(*frame, at(2.0 - distance))
    return cells


@pytest.mark.parametrize(("axis", "reach"), [(0, 0.10), (1, 0.10), (2, 0.30)])
@pytest.mark.parametrize("sign", [1, -1])
def test_places_are_of_one_cell_within_10_cm_in_plan_and_30_cm_in_height(axis, reach, sign):
    # Square to the shift, so that all places of the edge are as far from those before.
    half = np.array([0.0, 0.021, 0.0]) if axis != 1 else np.array([0.021, 0.0, 0.0])
    edge = DropEdge(edge=np.array([half, -half]), depth=0.5, num_rays=9)
    # Wherever a border of a grid lies: the cell's own place counts.
    for start in np.linspace(0.005, 0.095, 4):
        for share, num_cells in ((0.95, 1), (1.05, 2)):
            cells = DropCells()
            for shift in (0.0, sign * share * reach):
                cells.add(*frame_with([edge]), at(*(start + shift * np.eye(3)[axis])))
            assert len(cells) == num_cells


def test_a_frame_counts_one_for_a_cell_however_many_places_of_its_edge_are_in_it():
    cells = DropCells()
    cells.add(*frame_with([edge_ahead(1.0, half=0.021), edge_ahead(1.0, half=0.021)]), at())
    assert cells.num_seen.tolist() == [1]
    cells.add(*frame_with([edge_ahead(1.0, half=0.021)]), at())
    assert cells.num_seen.tolist() == [2]


@pytest.mark.parametrize(("length", "is_kept"), [(0.038, False), (0.042, True)])
def test_an_edge_shorter_than_4_cm_in_plan_is_passed_over(length, is_kept):
    cells = DropCells()
    cells.add(*frame_with([edge_ahead(1.0, half=length / 2)]), at())
    assert bool(len(cells)) is is_kept


def test_near_frames_place_an_edge_with_the_fourth_power_of_their_distance():
    cells = DropCells()
    for distance, place in ((1.0, 1.0), (2.0, 1.08)):
        cells.add(*frame_with([edge_ahead(distance, half=0.021, up=0.0)]), at(place - distance))
    assert cells.place[0, 0] == pytest.approx((1.0 + 1.08 / 16) / (1 + 1 / 16), abs=1e-4)
    # Nearer than 0.3 m, no frame knows it better.
    cells = DropCells()
    for distance, place in ((0.15, 1.0), (0.3, 1.08)):
        cells.add(*frame_with([edge_ahead(distance, half=0.021, up=0.0)]), at(place - distance))
    assert cells.place[0, 0] == pytest.approx(1.04, abs=1e-3)


def test_a_cell_tells_which_way_the_ground_falls_and_how_high_the_cameras_were():
    cells = DropCells()
    for stamp_ns, height in ((5, 0.6), (9, 0.7)):
        cells.add(*frame_with([edge_ahead(1.0, half=0.021)], stamp_ns=stamp_ns, height=height), at())
    assert cells.outward[0] == pytest.approx([1, 0, 0], abs=1e-9)
    assert cells.camera_height[0] == pytest.approx(0.65)
    assert (cells.first_seen_ns[0], cells.last_seen_ns[0]) == (5, 9)


def test_the_depth_is_that_of_the_nearest_frame_that_saw_anything_below():
    for frames, depth in (
        (((1.5, 0.5), (1.0, 0.8), (2.0, 0.3)), 0.8),
        (((1.5, np.nan), (2.0, 0.3)), 0.3),
        (((1.5, 0.5), (1.0, np.nan)), 0.5),
        (((1.0, 0.5), (1.0, 0.6)), 0.6),
    ):
        cells = DropCells()
        for distance, told in frames:
            cells.add(*frame_with([edge_ahead(distance, half=0.021, depth=told)]), at(2.0 - distance))
        assert cells.depth[0] == pytest.approx(depth)


def test_an_edge_with_nothing_behind_it_must_be_seen_from_distances_that_differ_by_30_cm():
    # Distances are those of the camera, 0.6 m above the ground.
    for nearer, is_sure in ((np.sqrt(2.35**2 - 0.36), False), (np.sqrt(2.25**2 - 0.36), True)):
        farther = np.sqrt(2.6**2 - 0.36)
        for order in ((nearer, farther), (farther, nearer)):
            assert bool(len(one_cell(*order, depth=np.nan).confirmed(2))) is is_sure
    assert len(one_cell(2.0, 2.0).confirmed(2)) == 1


def test_confirmed_are_cells_for_which_so_many_more_frames_speak():
    assert len(one_cell(2.0, 1.9, 1.8).confirmed(3)) == 1
    assert len(one_cell(2.0, 1.9, 1.8).confirmed(4)) == 0


@pytest.mark.parametrize(("seen_to", "speaks"), [(1.5, True), (1.25, False)])
def test_ground_seen_20_and_35_cm_behind_an_edge_speaks_against_it(seen_to, speaks):
    """The edge lies 1.02 m ahead: the farther place, at 1.37 m, must have been seen as well."""
    cells = DropCells()
    for _ in range(3):
        cells.add(*frame_with([edge_ahead(1.02, half=0.021)]), at())
    cells.add(*frame_with([], seen_to=seen_to), at())
    assert bool(len(cells.confirmed(3))) is not speaks
    assert len(cells.confirmed(2)) == 1


def frames_to_withdraw(num_for, *, num_against_first=0):
    """How many frames that see ground across an edge take a cell below a score of 3."""
    cells = DropCells()
    cells.add(*frame_with([edge_ahead(1.0, half=0.021)]), at())
    for _ in range(num_against_first):
        cells.add(*frame_with([], seen_to=2.0), at())
    for _ in range(num_for):
        cells.add(*frame_with([edge_ahead(1.0, half=0.021)]), at())
    num = 0
    while len(cells.confirmed(3)):
        cells.add(*frame_with([], seen_to=2.0), at())
        num += 1
    return num


def test_ten_frames_withdraw_what_was_seen_however_often():
    assert frames_to_withdraw(4) == 3
    assert frames_to_withdraw(11) == frames_to_withdraw(40) == 10


def test_nine_frames_bring_back_what_was_spoken_against_however_often():
    assert frames_to_withdraw(8, num_against_first=40) == 0
    assert frames_to_withdraw(9, num_against_first=40) == 1
    assert frames_to_withdraw(9, num_against_first=7) == 1
    assert frames_to_withdraw(9, num_against_first=6) == 2


def along_y(*places):
    return np.array([[0.0, y, 0.0] for y in places])


def test_cells_of_one_edge_lie_within_25_cm_and_fall_the_same_way():
    fall = np.tile([1.0, 0.0, 0.0], (3, 1))
    assert [len(group) for group in group_cells(along_y(0.0, 0.24, 0.5), fall)] == [2, 1]
    for degrees, num in ((36.0, 1), (38.0, 2)):
        turned = np.array([[1, 0, 0], [np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0]])
        assert len(group_cells(along_y(0.0, 0.1), turned)) == num
    assert group_cells(np.zeros((0, 3)), np.zeros((0, 3))) == []


@pytest.mark.parametrize(("bend", "num_pieces"), [(0.095, 1), (0.105, 2)])
def test_an_edge_within_10_cm_of_a_line_is_straight(bend, num_pieces):
    places = np.array([[0, 0, 0], [bend, 1.0, 0], [0, 2.0, 0], [0, 1.9, 0], [0, 0.1, 0]])
    assert len(split_straight(places)) == num_pieces
    # Three cells are never split.
    assert len(split_straight(np.array([[0, 0, 0], [0.3, 1.0, 0], [0, 2.0, 0]]))) == 1
