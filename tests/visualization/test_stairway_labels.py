"""Labels, colours and viewpoints of stairways."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from stairmap.visualization.stairway_labels import (
    STAIRWAY_COLORS,
    ascent_arrow,
    find_viewpoint,
    flight_measures,
    flight_title,
    height_colors,
    measures_markdown,
    stairway_color,
)


def test_measures_have_units_and_deviations(flight):
    text = " | ".join(flight_measures(flight))
    rise, std = flight.rise * 1e3, flight.std.rise * 1e3
    assert f"rise {rise:.0f} ± {std:.0f} mm" in text
    assert f"{flight.num_risers} risers" in text
    assert "°" in text


def test_width_with_an_unseen_end_is_a_lower_bound(flight):
    cut = dataclasses.replace(flight, right_bounded=False)
    assert "width ≥ " in flight_measures(cut)[-1]
    assert "≥" not in flight_measures(flight)[-1]


def test_risers_of_a_flight_with_an_unseen_end_are_a_lower_bound(flight):
    open_above = dataclasses.replace(flight, bottom_seen=True, top_seen=False)
    closed = dataclasses.replace(flight, bottom_seen=True, top_seen=True)
    assert flight_measures(open_above)[0].startswith(f"≥ {flight.num_risers} risers")
    assert flight_measures(closed)[0].startswith(f"{flight.num_risers} risers")


def test_flights_are_counted_only_where_there_are_several(stairway, turning_stairway):
    assert flight_title(stairway, 0) == "stairway 1"
    assert flight_title(turning_stairway, 1) == "stairway 2, flight 2 of 2"


def test_table_has_a_line_for_each_flight(stairway, turning_stairway):
    lines = measures_markdown([stairway, turning_stairway]).splitlines()
    rows = [line for line in lines if line.startswith("| ")][1:]
    assert [row.split("|")[1].strip() for row in rows] == ["1", "2", "2"]
    assert len({row.count("|") for row in lines[:2] + rows}) == 1
    assert measures_markdown([]) == "No stairway was found."


def test_neighbouring_stairways_differ_in_colour():
    colors = [stairway_color(number) for number in range(1, 6)]
    assert len(set(colors[:4])) == len(STAIRWAY_COLORS) == 4
    assert colors[4] == colors[0]


def test_arrow_points_up_the_flight_above_its_nosings(flight):
    start, end = ascent_arrow(flight)
    rise, along = end[2] - start[2], (end - start) @ flight.forward
    assert rise / along == pytest.approx(flight.rise / flight.run)
    assert start[2] > flight.base[2] + flight.rise


def test_arrow_of_a_single_step_has_a_length(flight):
    start, end = ascent_arrow(dataclasses.replace(flight, num_risers=1))
    assert (end - start) @ flight.forward == pytest.approx(flight.run)


def test_viewer_stands_before_the_stairs_above_and_at_the_side(stairway):
    viewpoint = find_viewpoint([stairway], np.empty((0, 3)))
    flight = stairway.flights[0]
    local = np.linalg.inv(flight.map_from_flight) @ np.append(viewpoint.eye, 1)
    assert local[0] < -0.5
    assert local[1] < -0.5
    assert local[2] > flight.num_risers * flight.rise
    corners = stairway.surface()[0]
    spread = np.linalg.norm(corners - viewpoint.target, axis=1).max()
    assert spread < viewpoint.distance < 4 * spread


def test_without_stairways_the_way_is_looked_at():
    way = np.array([[10.0, 5.0, 1.0], [14.0, 5.0, 1.0]])
    assert np.allclose(find_viewpoint([], way).target, [12, 5, 1])
    assert np.isfinite(find_viewpoint([], np.empty((0, 3))).eye).all()


def test_higher_points_are_paler():
    colors = height_colors(np.array([-1.0, 0.0, 1.0, 2.0, 9.0]), 0.0, 2.0).astype(int).sum(axis=1)
    assert (np.diff(colors) >= 0).all()
    assert colors[0] == colors[1] < colors[2] < colors[3] == colors[4]
