"""Edges of the ground in single frames: found to the centimetre, and none where ground goes on."""

from __future__ import annotations

import numpy as np
import pytest

from analytic_stairs import pose_looking
from drop_scenes import deep_dock, deep_well, dock, ramp_down, stairs_down
from solid_scenes import frame_of, room
from stairmap.config import Config
from stairmap.detection.detector import StairEdgeDetector
from stairmap.frame import DepthFrame
from stairmap.simulation.render import RayCaster
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.triangle_mesh import joined, make_block, make_rectangle, make_wall
from stairmap.transforms import transform_points

DETECTOR = StairEdgeDetector(Config())


def look(solid, *, distance, height, down=None, yaw=0.0, detector=DETECTOR):
    """Return the detection of a perfect camera ``distance`` m before x = 0, and its pose."""
    # A low camera looks nearly level, a high one down, so that near ground is in view.
    down = np.radians(12.0 if height < 0.6 else 30.0) if down is None else down
    pose = pose_looking((-distance, 0.0, height), yaw=yaw, down=down)
    return detector.detect(frame_of([solid], pose)), pose


def measured(solid, sensor, *, distance, height):
    """Return the detections of three looks of a sensor with its noise."""
    pose = pose_looking((-distance, 0.0, height), down=np.radians(30.0))
    rendering = RayCaster(solid).render(sensor.camera, pose)
    return [
        DETECTOR.detect(
            DepthFrame(
                stamp_ns=0,
                depth=sensor.measure(rendering, np.random.default_rng(seed)),
                camera=sensor.camera,
                up=pose[2, :3],
            )
        )
        for seed in range(3)
    ]


@pytest.mark.parametrize(
    ("height", "distance"),
    [(0.25, 0.9), (0.25, 1.3), (0.6, 1.0), (0.6, 2.0), (1.0, 1.5), (1.6, 1.8), (1.6, 2.5)],
)
@pytest.mark.parametrize("solid", [dock(0.8), stairs_down()], ids=["dock", "stairs"])
def test_an_edge_is_found_where_it_is_from_low_and_high_cameras(solid, height, distance):
    detection, pose = look(solid, distance=distance, height=height)
    assert detection.drops, detection.ground
    edges = transform_points(pose, np.array([drop.edge for drop in detection.drops]))
    ahead = edges[(edges[..., 1].min(axis=1) < 0.5) & (edges[..., 1].max(axis=1) > -0.5)]
    assert np.abs(ahead[..., 0]).max() < 0.05
    assert np.abs(ahead[..., 2]).max() < 0.02


@pytest.mark.parametrize("height", [0.25, 0.45, 0.9, 1.6])
def test_the_height_of_the_camera_is_that_above_the_ground_it_stands_on(height):
    detection, _ = look(dock(0.8), distance=1.6, height=height)
    assert detection.ground is not None
    assert detection.ground.height == pytest.approx(height, abs=0.005)


def test_the_left_end_comes_first_and_depth_is_that_of_what_is_seen_behind():
    detection, pose = look(dock(0.5), distance=1.2, height=1.0)
    (drop,) = detection.drops
    first, last = transform_points(pose, drop.edge)
    assert first[1] > last[1]
    assert last[1] < -0.4 and first[1] > 0.4
    assert drop.depth == pytest.approx(0.5, abs=0.03)
    assert drop.distance == pytest.approx(np.hypot(1.2, 1.0), abs=0.03)


@pytest.mark.parametrize(
    ("depth", "is_told"),
    [(0.06, False), (0.08, False), (0.09, False), (0.11, True), (0.12, True), (0.13, True), (0.2, True)],
)
@pytest.mark.parametrize(("height", "distance"), [(0.25, 0.7), (0.5, 1.2), (1.0, 1.2), (1.4, 1.4)])
def test_a_kerb_is_no_drop_and_what_is_deeper_is(depth, is_told, height, distance):
    detection, _ = look(dock(depth), distance=distance, height=height)
    assert bool(detection.drops) is is_told
    assert detection.ground is not None
    if depth > 0.07:  # of less, a frame may take both for one ground
        assert detection.ground.height == pytest.approx(height, abs=0.012)


@pytest.mark.parametrize("sensor_name", ["kinect_v1", "kinect_v2", "d435"])
def test_every_camera_shows_an_edge_of_twelve_centimetres(sensor_name):
    detections = measured(dock(0.12), make_sensor(sensor_name, factor=0.5), distance=1.3, height=1.0)
    assert all(detection.drops for detection in detections)


@pytest.mark.parametrize("slope_deg", [3, 5, 8, 12])
@pytest.mark.parametrize("height", [0.6, 1.0, 1.6])
@pytest.mark.parametrize("distance", [0.6, 1.2])
def test_a_ramp_that_leads_down_is_no_drop(slope_deg, height, distance):
    detection, _ = look(ramp_down(slope_deg), distance=distance, height=height)
    assert detection.drops == ()


@pytest.mark.parametrize("height", [0.25, 0.6, 1.3])
def test_a_room_with_things_in_it_has_no_drop(height):
    table = joined(
        [make_block((-0.2, -1.5, 0.68), (0.9, -0.4, 0.72)), make_block((0.1, 0.3, 0), (0.6, 0.9, 0.4))]
    )
    for yaw in (0.0, 0.5, -0.5):
        detection, _ = look(joined([room(), table]), distance=2.0, height=height, yaw=yaw)
        assert detection.drops == ()
        assert detection.ground is not None


def test_an_edge_at_the_side_and_a_corner_are_told_as_straight_pieces():
    corner = joined([make_block((-8, -4, -1), (0, 0.5, 0.0)), make_rectangle((-8, -4), (8, 6), -1.0)])
    detection, pose = look(corner, distance=1.6, height=1.3)
    edges = transform_points(pose, np.array([drop.edge for drop in detection.drops]))
    is_front = np.abs(edges[..., 0]).max(axis=1) < 0.05
    is_side = np.abs(edges[..., 1] - 0.5).max(axis=1) < 0.06
    assert is_front.any() and is_side.any()


def test_a_hole_that_a_wheel_does_not_fall_into_is_no_drop():
    near, far = make_block((-8, -4, -1), (0, 4, 0)), make_block((0.03, -4, -1), (6, 4, 0))
    slot = joined([near, far, make_rectangle((-1, -1), (1, 1), -1.0)])
    assert look(slot, distance=1.2, height=0.6)[0].drops == ()


def test_a_camera_whose_height_is_known_takes_no_table_for_its_ground():
    """A table's edge from above is the edge of a dock, but for a camera that does not stand on tables."""
    table = joined([room(), make_block((-1.6, -1.2, 0.70), (0.0, 1.2, 0.75))])
    unaware, _ = look(table, distance=1.5, height=1.3, down=np.radians(25))
    assert unaware.drops
    aware = StairEdgeDetector(Config.model_validate({"detection": {"camera_height": 1.3}}))
    assert look(table, distance=1.5, height=1.3, down=np.radians(25), detector=aware)[0].drops == ()
    assert look(dock(0.8), distance=1.5, height=1.3, detector=aware)[0].drops


@pytest.mark.parametrize("sensor_name", ["kinect_v1", "kinect_v2", "d435", "phone_lidar"])
@pytest.mark.parametrize("height", [0.35, 1.3])
def test_every_sensor_shows_stairs_that_lead_down(sensor_name, height):
    sensor = make_sensor(sensor_name, factor=0.5)
    pose = pose_looking((-1.0, 0.0, height), down=np.radians(15 if height < 0.6 else 35))
    depth = sensor.measure(RayCaster(stairs_down()).render(sensor.camera, pose), np.random.default_rng(1))
    frame = DepthFrame(stamp_ns=0, depth=depth, camera=sensor.camera, up=pose[2, :3])
    edges = [transform_points(pose, drop.edge) for drop in DETECTOR.detect(frame).drops]
    assert edges
    assert max(float(np.abs(edge[:, 0]).max()) for edge in edges) < 0.08


@pytest.mark.parametrize("sensor_name", ["kinect_v1", "kinect_v2", "d435", "phone_lidar"])
@pytest.mark.parametrize("solid", [deep_dock(), deep_well()], ids=["dock", "well"])
def test_ground_that_ends_before_nothing_measured_is_a_void_and_no_drop(solid, sensor_name):
    for detection in measured(solid, make_sensor(sensor_name, factor=0.5), distance=1.3, height=1.0):
        assert detection.drops == ()
        # From the camera's foot, which lies under it.
        edges = np.array([void.edge for void in detection.voids]) @ detection.ground.forward
        assert len(edges) and np.abs(edges - 1.3).max() < 0.08
        assert np.isnan(detection.voids[0].depth)


@pytest.mark.parametrize("height", [0.25, 0.6, 1.3])
@pytest.mark.parametrize(
    "solid", [room(), dock(0.06), dock(0.6), stairs_down()], ids=["room", "kerb", "dock", "stairs"]
)
def test_ground_that_goes_on_or_lies_lower_is_no_void(solid, height):
    for distance in (0.9, 1.5):
        assert look(solid, distance=distance, height=height)[0].voids == ()


def test_a_thing_with_a_dark_foot_is_no_void():
    cabinet = joined([make_rectangle((-8, -4), (0, 4), 0.0), make_wall((0.05, -4), (0.05, 4), 0.35, 2.0)])
    detection, _ = look(cabinet, distance=1.3, height=1.0)
    assert detection.ground is not None and detection.voids == ()


def test_a_thing_before_nothing_measured_is_no_void():
    parapet = joined([make_rectangle((-8, -4), (0, 4), 0.0), make_block((-0.4, -4, 0), (0, 4, 0.3))])
    detection, _ = look(parapet, distance=1.6, height=1.0)
    assert detection.ground is not None and detection.voids == ()


def test_a_dark_patch_that_a_robot_steps_over_is_no_void():
    near, far = make_rectangle((-8, -4), (0, 4), 0.0), make_rectangle((0.4, -4), (8, 4), 0.0)
    assert look(joined([near, far]), distance=1.3, height=1.0)[0].voids == ()


def test_a_frame_tells_its_drops_in_its_line():
    detection, _ = look(dock(0.5), distance=1.2, height=1.0)
    line = detection.to_dict()
    assert line["camera_height"] == pytest.approx(1.0, abs=0.005)
    assert np.shape(line["drops"][0]["edge"]) == (2, 3)
    assert line["drops"][0]["depth"] == pytest.approx(0.5, abs=0.03)
    void = look(deep_dock(), distance=1.2, height=1.0)[0].to_dict()["drops"]
    assert [edge["depth"] for edge in void] == [None]
