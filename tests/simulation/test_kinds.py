"""Views of each kind show what the kind is named after."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from stairmap.simulation.kinds import (
    FAR_DISTANCES,
    FAR_SENSORS,
    KINDS,
    NUM_ROLLS,
    OVERHANGS,
    SMOOTHING_SENSORS,
    VIEW_SENSORS,
    ViewSpec,
    make_view,
)
from stairmap.simulation.look_alikes import LOOK_ALIKES
from stairmap.simulation.more_look_alikes import MORE_LOOK_ALIKES
from stairmap.simulation.views import View, take_view
from stairmap.stairway import Flight

NUM = 30


def views_of(kind: str, num: int = NUM) -> list[View]:
    return [make_view(ViewSpec(kind=kind, index=index)) for index in range(num)]


def flight_of(view: View) -> Flight:
    assert view.flight is not None
    return view.flight


def eye_of(view: View) -> np.ndarray:
    return np.asarray(view.map_from_camera[:3, 3])


@pytest.mark.parametrize("kind", KINDS)
def test_a_spec_gives_the_same_frame_bit_for_bit_and_another_seed_another(kind: str) -> None:
    first, again = (make_view(ViewSpec(kind=kind, index=4)) for _ in range(2))
    other = make_view(ViewSpec(kind=kind, index=4, seed=1))
    assert first.kind == kind and (first.flight is not None) == KINDS[kind].has_stairs
    assert take_view(first)[0].tobytes() == take_view(again)[0].tobytes()
    assert not np.array_equal(first.map_from_camera, other.map_from_camera)


@pytest.mark.parametrize(
    ("kind", "sensors"),
    [("overhang", VIEW_SENSORS), ("descending", VIEW_SENSORS), ("smoothing", SMOOTHING_SENSORS),
     ("far", FAR_SENSORS), ("look-alikes", VIEW_SENSORS)],
)  # fmt: skip
def test_every_sensor_has_its_turn(kind: str, sensors: tuple[tuple[str, int | None], ...]) -> None:
    specs = [make_view(ViewSpec(kind=kind, index=index)) for index in range(0, KINDS[kind].num_views, 7)]
    seen = {(view.sensor.name, view.sensor.camera.width) for view in specs}
    assert len(seen) == len(sensors)
    assert {name for name, _ in seen} == {name for name, _ in sensors}


def test_overhangs_are_dealt_out_evenly() -> None:
    views = views_of("overhang", 8)
    assert [flight_of(view).overhang for view in views] == [*OVERHANGS, *OVERHANGS]
    assert all(0.35 <= eye_of(view)[2] <= 1.4 for view in views)


def test_one_place_is_seen_at_every_roll_and_by_portrait_images() -> None:
    views = views_of("roll", NUM_ROLLS + 2)
    upright = views[0].map_from_camera
    for index, view in enumerate(views[:NUM_ROLLS]):
        np.testing.assert_allclose(view.map_from_camera[:3, 2:], upright[:3, 2:], atol=1e-12)
        turn = upright[:3, :3].T @ view.map_from_camera[:3, :3]
        angle = np.arctan2(turn[1, 0], turn[0, 0])
        assert np.cos(angle - np.radians(15 * index)) == pytest.approx(1.0)
    assert [view.camera.height > view.camera.width for view in views[-3:]] == [False, True, True]
    np.testing.assert_allclose(views[-1].map_from_camera, upright)
    groups = Counter(view.group for view in views)
    assert groups == {"upright": 1, "90° and 270°": 2, "180°": 1, "other": 20, "portrait": 2}


def test_slopes_go_to_four_percent_in_every_way() -> None:
    lowest = {}
    for view in views_of("sloping", 13):
        nosing = flight_of(view).steps[0].nosing
        lowest.setdefault(view.group, []).append(abs(nosing[0, 2] - nosing[1, 2]) / flight_of(view).width)
    assert {group: len(values) for group, values in lowest.items()} == {
        "level": 1, "floor and treads, to the front": 4, "floor and treads, sideways": 4, "treads alone": 4,
    }  # fmt: skip
    np.testing.assert_allclose(lowest["floor and treads, sideways"], [0.01, 0.02, 0.03, 0.04])
    assert np.abs([*lowest["level"], *lowest["treads alone"]]).max() < 1e-12


def test_descending_views_stand_where_they_say() -> None:
    views = views_of("descending", 60)
    eyes = np.array([eye_of(view) for view in views])
    assert 0.3 <= eyes[:, 2].min() < 0.45 and 1.35 < eyes[:, 2].max() <= 1.5
    assert 0.4 <= -eyes[:, 0].max() < 0.5 and 1.9 < -eyes[:, 0].min() <= 2.0
    assert 40 < np.degrees(np.arctan2(np.abs(eyes[:, 1]), -eyes[:, 0])).max() <= 45
    assert {flight_of(view).num_risers for view in views} == set(range(3, 15))
    for view in views:
        assert view.map_from_camera[:3, 2] @ flight_of(view).forward < 0
        assert flight_of(view).steps[-1].nosing[0, 2] == pytest.approx(0.0)


def test_cameras_on_the_stairs_stand_over_a_tread() -> None:
    for view in views_of("on-stairs"):
        flight, eye = flight_of(view), eye_of(view)
        step = int((eye - flight.base) @ flight.forward / flight.run)
        assert 0.35 <= eye[2] - flight.steps[step].nosing[0, 2] <= 1.4
        assert (view.map_from_camera[:3, 2] @ flight.forward < 0) == (view.group == "looking down")


def test_free_standing_stairs_are_seen_twice_from_the_same_place() -> None:
    views = views_of("free-standing", 10)
    for walled, free in zip(views[::2], views[1::2], strict=True):
        np.testing.assert_array_equal(walled.map_from_camera, free.map_from_camera)
        assert walled.seed == free.seed and walled.sensor == free.sensor
        assert flight_of(walled).edges().tobytes() == flight_of(free).edges().tobytes()
        top = flight_of(free).steps[-1].nosing[0, 2]
        assert free.scene.mesh.vertices[:, 2].max() == pytest.approx(top)
        assert walled.scene.mesh.vertices[:, 2].max() > top + 2
        assert (walled.group, free.group) == ("wall behind", "nothing behind")


def test_wide_steps_are_few_and_wide() -> None:
    flights = [flight_of(view) for view in views_of("wide")]
    assert {flight.num_risers for flight in flights} == {2, 3, 4}
    assert min(flight.width for flight in flights) >= 3 and max(flight.width for flight in flights) <= 5


def test_far_views_are_three_to_six_metres_away() -> None:
    for index, view in enumerate(views_of("far", 9)):
        assert np.hypot(*eye_of(view)[:2]) == pytest.approx(FAR_DISTANCES[index])
        assert view.group == f"{FAR_DISTANCES[index]:g} m"


def test_escalators_are_seen_from_both_ends_and_their_ends_are_open() -> None:
    for view in views_of("escalator", 4):
        assert not view.ends_are_known
        assert view.spare_below.shape == view.spare_above.shape == (2, 2, 3)
        is_up = view.map_from_camera[:3, 2] @ flight_of(view).forward > 0
        assert view.group == ("from below" if is_up else "from above")


def test_every_second_irregular_flight_has_one_odd_riser() -> None:
    for view in views_of("irregular", 12):
        rises = np.diff([0.0, *(step.nosing[0, 2] for step in flight_of(view).steps)])
        odd = np.abs(rises - np.median(rises))
        assert odd.max() == pytest.approx(0.012 if view.group == "one riser odd" else 0.0)
        assert np.count_nonzero(odd > 1e-9) == (view.group == "one riser odd")
        assert np.hypot(*eye_of(view)[:2]) == pytest.approx(1.5)


def test_every_look_alike_is_shown() -> None:
    names = {*LOOK_ALIKES, *MORE_LOOK_ALIKES}
    assert {view.group for view in views_of("look-alikes", len(names))} == names


def test_unknown_kinds_are_refused() -> None:
    with pytest.raises(ValueError, match="overhang"):
        make_view(ViewSpec(kind="castle", index=0))
