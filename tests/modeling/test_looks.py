"""A frame sees a modelled flight, or misses it; what hides it is no evidence against it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, pose_looking
from ideal_observations import make_flight
from solid_scenes import frame_of, room, stairs_solid
from stairmap.arrays import Transform
from stairmap.frame import DepthFrame
from stairmap.modeling.looks import (
    MIN_TELLING_RAYS,
    Look,
    look_at,
    look_at_flights,
)
from stairmap.simulation.stair_shapes import FlightShape
from stairmap.simulation.stairs import build_flight
from stairmap.simulation.triangle_mesh import make_block
from stairmap.stairway import Flight, FlightStd

STD = FlightStd(rise=0.001, run=0.001, width=0.01, pitch=0.005, heading=0.003, base=np.full(3, 0.01))
STAIRS = AnalyticStairs()
FLIGHT = make_flight(base=np.zeros(3), std=STD)
FRONT = pose_looking((-1.5, 0.1, 0.8), yaw=-0.03, down=0.15)
LOW = pose_looking((-1.3, 0.0, 0.35), down=-0.1)
ABOVE = pose_looking((8 * 0.28 + 0.5, 0.0, 8 * 0.17 + 1.0), yaw=np.pi, down=0.75)


def look(
    *solids: Any, pose: Transform = FRONT, flight: Flight = FLIGHT, standing: bool = True, noise: float = 0.0
) -> Look:
    """The look of a frame that shows a room with the stairs, or without them, and other solids."""
    stairs = [stairs_solid(STAIRS)] if standing else []
    frame = frame_of([room(), *stairs, *solids], pose)
    if noise:
        random = np.random.default_rng(3)
        depth = frame.depth + noise * frame.depth**2 * random.normal(size=frame.depth.shape)
        frame = DepthFrame(stamp_ns=5, depth=depth.astype(np.float32), camera=frame.camera)
    found = look_at(flight, frame, pose)
    assert found is not None
    return found


@pytest.mark.parametrize("pose", [FRONT, LOW, ABOVE], ids=["front", "low", "above"])
def test_a_flight_that_is_there_is_seen_and_one_that_is_gone_is_missed(pose: Transform) -> None:
    there, gone = look(pose=pose), look(pose=pose, standing=False)
    assert there.is_present and not there.is_absent
    assert there.num_on > 0.95 * (there.num_telling + there.num_hidden)
    assert gone.is_absent and not gone.is_present
    assert gone.num_on == 0


def test_noise_of_a_poor_sensor_does_not_hide_a_flight() -> None:
    assert look(noise=0.004).is_present
    assert look(noise=0.004, standing=False).is_absent


@pytest.mark.parametrize("shift", [(0.1, 0, 0), (-0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.07), (0, 0, -0.07)])
def test_a_pose_that_is_a_little_off_still_sees_the_flight(shift: tuple[float, float, float]) -> None:
    found = look(flight=make_flight(base=np.array(shift, dtype=float), std=STD))
    assert found.is_present


def test_a_place_that_is_uncertain_widens_what_counts_as_seen() -> None:
    vague = FlightStd(rise=0.001, run=0.001, width=0.01, pitch=0.005, heading=0.003, base=np.full(3, 0.15))
    far_off = np.array([0.35, 0.0, 0.0])
    sure = look(flight=make_flight(base=far_off, std=STD))
    unsure = look_at(
        make_flight(base=far_off, std=vague), frame_of([room(), stairs_solid(STAIRS)], FRONT), FRONT
    )
    assert sure.num_hidden > 0.5 * (sure.num_on + sure.num_hidden)
    assert unsure is not None
    assert unsure.num_hidden == 0 and unsure.num_on > 0


def test_who_stands_before_the_stairs_hides_them_and_is_no_evidence_against_them() -> None:
    crowd = make_block([-0.7, -1.0, 0.0], [-0.4, 1.0, 1.8])
    for standing in (True, False):
        found = look(crowd, standing=standing)
        assert found.num_hidden > 0.9 * (found.num_telling + found.num_hidden)
        assert not found.is_absent and not found.is_present and not found.is_telling


def test_what_shows_beside_a_person_still_tells() -> None:
    person = make_block([-0.7, -0.5, 0.0], [-0.4, 0.05, 1.8])
    assert look(person).is_present
    gone = look(person, standing=False)
    assert gone.num_hidden > 20
    assert gone.is_absent


def test_a_wall_before_a_flight_hides_it() -> None:
    assert not look(make_block([-0.3, -3, 0], [-0.2, 3, 3]), standing=False).is_telling


def test_what_was_not_measured_says_nothing() -> None:
    frame = frame_of([room()], FRONT)
    depth = np.full_like(frame.depth, np.nan)
    found = look_at(FLIGHT, DepthFrame(stamp_ns=0, depth=depth, camera=frame.camera), FRONT)
    assert found is not None
    assert (found.num_on, found.num_hidden, found.num_through) == (0, 0, 0)
    assert found.num_unmeasured > 50
    assert not found.is_telling


@pytest.mark.parametrize("pose", [FRONT, LOW, ABOVE], ids=["front", "low", "above"])
def test_open_risers_that_one_sees_through_are_no_missing_flight(pose: Transform) -> None:
    shape = FlightShape(rise=0.17, run=0.28, width=1.2, num_risers=8, open_risers=True)
    mesh, _ = build_flight(shape, base=np.zeros(3), heading=0.0, random=np.random.default_rng(0))
    found = look(mesh, pose=pose, standing=False)
    assert found.num_through > 0 or pose is ABOVE
    assert not found.is_absent


def test_nosings_that_overhang_are_on_the_flight() -> None:
    frame = frame_of([room(), stairs_solid(STAIRS, overhang=0.04)], FRONT)
    found = look_at(make_flight(base=np.zeros(3), std=STD, overhang=0.04), frame, FRONT)
    assert found is not None
    assert found.num_on > 0.95 * found.num_telling


@pytest.mark.parametrize(
    "pose",
    [
        pose_looking((-1.5, 0.0, 0.8), yaw=np.pi),
        pose_looking((-9.0, 0.0, 0.8)),
        pose_looking((-1.5, 0.0, 0.8), yaw=1.5),
        pose_looking((1.1, 0.0, -3.0), down=1.5),
    ],
    ids=["behind the camera", "too far", "beside the image", "under the floor"],
)
def test_no_ray_goes_to_a_flight_that_is_not_in_view(pose: Transform) -> None:
    assert look_at(FLIGHT, frame_of([room()], pose), pose) is None


@pytest.mark.parametrize(("distance", "is_asked"), [(3.9, True), (4.1, False)])
def test_a_flight_is_asked_for_within_4_m(distance: float, is_asked: bool) -> None:
    pose = pose_looking((-distance, 0.0, 0.8))
    found = look_at(FLIGHT, frame_of([room(), stairs_solid(STAIRS)], pose), pose)
    assert (found is not None) is is_asked


def test_steps_so_low_that_the_floor_lies_just_behind_them_tell_nothing() -> None:
    kerb = make_flight(base=np.zeros(3), std=STD, rise=0.10, run=0.3, num_risers=2)
    found = look_at(kerb, frame_of([room()], FRONT), FRONT)
    assert found is None or not found.is_telling


def test_a_step_behind_another_is_not_asked_for() -> None:
    # From above and behind, the treads below the first ones are hidden by these.
    flat = pose_looking((8 * 0.28 + 1.6, 0.0, 8 * 0.17 + 0.5), yaw=np.pi, down=0.25)
    found = look_at(FLIGHT, frame_of([room(ahead=8.0), stairs_solid(STAIRS)], flat), flat)
    assert found is None or found.num_hidden == 0


def test_a_look_says_where_it_looked_in_the_camera_frame() -> None:
    found = look()
    middle = FRONT[:3, :3] @ found.middle + FRONT[:3, 3]
    np.testing.assert_allclose(middle, [3.5 * 0.28, 0.0, 4.5 * 0.17], atol=1e-9)
    np.testing.assert_allclose(FRONT[:3, :3] @ found.forward, [1.0, 0.0, 0.0], atol=1e-9)


def test_turned_and_shifted_together_flight_and_camera_give_the_same_look() -> None:
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(2.0), -np.sin(2.0)], [np.sin(2.0), np.cos(2.0)]]
    turn[:3, 3] = (5.0, -3.0, 1.0)
    frame = frame_of([room(), stairs_solid(STAIRS)], FRONT)
    here = look_at(FLIGHT, frame, FRONT)
    there = look_at(make_flight(base=turn[:3, 3], heading=2.0, std=STD), frame, turn @ FRONT)
    assert here is not None and there is not None
    assert there.num_on == pytest.approx(here.num_on, abs=3)
    np.testing.assert_allclose(there.middle, here.middle, atol=1e-9)


def make_look(num_on: int, num_through: int, num_hidden: int = 0, num_unmeasured: int = 0) -> Look:
    return Look(
        stamp_ns=0,
        middle=np.zeros(3),
        forward=np.array([1.0, 0, 0]),
        num_on=num_on,
        num_hidden=num_hidden,
        num_through=num_through,
        num_unmeasured=num_unmeasured,
    )


@pytest.mark.parametrize(
    ("counts", "is_telling"),
    [
        ((MIN_TELLING_RAYS, 0), True),
        ((MIN_TELLING_RAYS - 1, 0), False),
        ((0, MIN_TELLING_RAYS), True),
        ((20, 30, 150), True),
        ((20, 30, 151), False),
        ((20, 30, 0, 151), False),
        ((20, 30, 75, 75), True),
    ],
)
def test_a_look_counts_when_enough_rays_must_have_seen_the_flight(
    counts: tuple[int, ...], is_telling: bool
) -> None:
    assert make_look(*counts).is_telling is is_telling


@pytest.mark.parametrize(
    ("num_on", "is_absent", "is_present"),
    [(0, True, False), (8, True, False), (9, False, False), (29, False, False), (30, False, True)],
)
def test_few_rays_on_the_flight_miss_it_and_many_see_it(
    num_on: int, is_absent: bool, is_present: bool
) -> None:
    found = make_look(num_on, 100 - num_on)
    assert (found.is_absent, found.is_present) == (is_absent, is_present)


def test_a_look_that_does_not_tell_is_neither() -> None:
    assert not make_look(0, MIN_TELLING_RAYS - 1).is_absent
    assert not make_look(MIN_TELLING_RAYS - 1, 0).is_present


def test_the_looks_of_a_frame_are_those_that_tell_at_every_flight_in_view() -> None:
    behind = make_flight(base=np.array([-8.0, 0.0, 0.0]), heading=np.pi, std=STD)
    frame = frame_of([room(), stairs_solid(STAIRS)], FRONT, camera=KINECT_CAMERA)
    looks = look_at_flights([FLIGHT, behind, FLIGHT], frame, FRONT)
    assert [item.is_present for item in looks] == [True, True]
    blind = DepthFrame(stamp_ns=0, depth=np.full_like(frame.depth, np.nan), camera=frame.camera)
    assert look_at_flights([FLIGHT], blind, FRONT) == ()
