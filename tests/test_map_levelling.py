"""Levelling a map by what frames say is up."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from small_recordings import write_recording
from stairmap.errors import TrajectoryError
from stairmap.map_levelling import find_level_map, levelling_from_ups
from stairmap.recordings.frame_iterators import placed_frames
from stairmap.recordings.open import open_recording
from stairmap.session import MapSession
from stairmap.transforms import rotation_from_vector

UP = np.array([0.0, 0.0, 1.0])


def tilted(degrees, direction=0.0):
    angle = np.radians(degrees)
    return np.array([np.sin(angle) * np.cos(direction), np.sin(angle) * np.sin(direction), np.cos(angle)])


@settings(max_examples=50)
@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3))
def test_any_tilt_is_undone(vector):
    up = rotation_from_vector(vector) @ UP
    levelling = levelling_from_ups(np.tile(up, (5, 1)), num_asked=5)
    assert np.allclose(levelling.map_from_recorded[:3, :3] @ up, UP, atol=1e-9)
    assert levelling.angle == pytest.approx(np.arccos(np.clip(up[2], -1, 1)), abs=1e-6)


def test_tables_and_ramps_are_outvoted():
    ups = np.array([tilted(1, angle) for angle in np.arange(0, 6, 1)] + [tilted(25), tilted(60, 2)])
    levelling = levelling_from_ups(ups, num_asked=30)
    assert (levelling.num_agreeing, levelling.num_with_floor, levelling.num_asked) == (6, 8, 30)
    assert np.degrees(levelling.angle) < 0.5
    assert np.degrees(levelling.spread) == pytest.approx(1.0, abs=0.3)


def test_level_map_stays_as_it_is():
    levelling = levelling_from_ups(np.tile(UP, (4, 1)), num_asked=4)
    assert np.array_equal(levelling.map_from_recorded, np.eye(4))


def test_frames_that_disagree_are_refused():
    ups = np.array([tilted(0), tilted(30), tilted(60), tilted(30, 2), tilted(60, 4)])
    with pytest.raises(TrajectoryError, match=r"5 show a floor and 1 agree; name the axis"):
        levelling_from_ups(ups, num_asked=10)


def test_two_of_many_frames_are_too_few():
    with pytest.raises(TrajectoryError, match="at least 3 frames"):
        levelling_from_ups(np.tile(UP, (2, 1)), num_asked=30)


def test_no_floor_is_refused():
    with pytest.raises(TrajectoryError, match="0 show a floor"):
        levelling_from_ups(np.zeros((0, 3)), num_asked=30)


def test_single_frame_is_enough_for_a_recording_of_one():
    levelling = levelling_from_ups(tilted(20)[None], num_asked=1)
    assert np.degrees(levelling.angle) == pytest.approx(20)


def test_a_recording_whose_map_lies_on_its_side_is_levelled_by_the_floor(tmp_path):
    turn = rotation_from_vector([0.4, -1.2, 0.3])
    folder = write_recording(tmp_path / "lying", recorded_from_map=turn)
    recording = open_recording(folder, up="auto")
    level_map = find_level_map(recording, "auto")
    angle = np.degrees(np.arccos(np.clip((level_map.map_from_recorded[:3, :3] @ turn)[2, 2], -1.0, 1.0)))
    assert angle < 1.0
    assert "the map was turned by" in level_map.note
    session = MapSession()
    for frame, map_from_camera in placed_frames(recording, level_map.trajectory):
        session.add(frame, map_from_camera)
    (stairway,) = session.stairways()
    assert stairway.flights[0].rise == pytest.approx(0.17, abs=0.003)


def test_a_level_recording_keeps_its_map(tmp_path):
    recording = open_recording(write_recording(tmp_path / "level", num_frames=2))
    level_map = find_level_map(recording)
    assert np.array_equal(level_map.map_from_recorded, np.eye(4))
    assert level_map.note is None
    assert np.array_equal(level_map.trajectory.map_from_camera, recording.check_poses().map_from_camera)


def test_an_axis_that_is_named_is_told(tmp_path):
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    folder = write_recording(tmp_path / "y_down", num_frames=2, recorded_from_map=turn)
    level_map = find_level_map(open_recording(folder, up="-y"), "-y")
    assert "so that its -y axis is z" in level_map.note
    assert np.allclose((level_map.map_from_recorded[:3, :3] @ turn)[2], [0, 0, 1])
