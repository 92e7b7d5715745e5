"""How often a single frame shows what is there: recall and false detections over distance and view angle.

Each cell of the grid is one sensor at one camera height, distance and view angle. The camera aims at
a stairway's lower half; position, direction and tilt vary a little from view to view, and so do the
stairways. The same views of look-alikes give the rate of false detections. Up is known as an IMU tells
it. A cell counts all its views, also those from which too few steps can be seen at all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, Transform, readonly
from stairmap.config import Config
from stairmap.evaluation.drift import find_observed_flight
from stairmap.evaluation.workers import make_worker_pool
from stairmap.frame import DepthFrame
from stairmap.pipeline import make_detector
from stairmap.simulation.flight_scenes import make_feature_scene
from stairmap.simulation.render import RayCaster
from stairmap.simulation.scene import Scene
from stairmap.simulation.scenes import SCENE_GROUPS, make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.viewpoints import look_at
from stairmap.transforms import rotation_from_vector

STAIR_SCENES = ("free_standing", "railings", "wide")
"""Stairs that can be seen from any side; all in halls."""

AIM_HEIGHT = 0.5
"""Height above the foot of the stairs that the camera aims at, m."""

UP_STD = float(np.radians(0.4))
"""Error of up as an IMU tells it, rad; as in ``simulation.odometry``."""

STAIR_HALL = (8.0, 7.5)
"""Length and half width of the halls of stairs, m: no camera stands behind a wall."""

_HALL_SIDE, _HALL_BACK = 3.7, 5.7
"""Farthest that a camera may stand aside and back in the look-alikes' room, m; its walls are at 4 and 6."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RateGrid:
    """Where the rates are taken.

    Attributes
    ----------
    distances
        Horizontal distances from the first nosing's middle, m.
    angles
        View angles, 0 straight before the stairs, rad.
    sensors
        Names and widths (px; ``None``: full).
    heights
        Camera heights, m.
    num_views
        Views per cell of stairs, and as many of look-alikes.
    seed
        Seed of everything that varies.
    """

    distances: tuple[float, ...] = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0)
    angles: tuple[float, ...] = tuple(float(np.radians(angle)) for angle in (0, 15, 30, 45, 60, 75))
    sensors: tuple[tuple[str, int | None], ...] = (
        ("kinect_v1", 320),
        ("kinect_v2", None),
        ("d435", 320),
        ("phone_lidar", None),
        ("ideal", 320),
    )
    heights: tuple[float, ...] = (0.3, 0.6, 1.3)
    num_views: int = 6
    seed: int = 0

    def panels(self) -> tuple[tuple[tuple[str, int | None], float], ...]:
        """Return each sensor with each height: the parts that can be measured apart."""
        return tuple(product(self.sensors, self.heights))


QUICK_GRID = RateGrid(
    distances=(1.0, 2.5, 4.0),
    angles=(0.0, float(np.radians(45))),
    sensors=(("kinect_v1", 160),),
    heights=(0.45,),
    num_views=3,
)
"""A few cells, for a first look and for tests."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RatePanel:
    """Rates of one method, sensor and height.

    Attributes
    ----------
    method, sensor, width, height
        Of what.
    recall
        (num_angles, num_distances) share of views with an observation of the stairway.
    false_rate
        (num_angles, num_distances) share of views of look-alikes with an observation.
    """

    method: str
    sensor: str
    width: int | None
    height: float
    recall: Float64Array
    false_rate: Float64Array

    def __post_init__(self) -> None:
        for name in ("recall", "false_rate"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    def to_dict(self) -> dict[str, Any]:
        """Return the panel as JSON types."""
        return {
            "method": self.method, "sensor": self.sensor, "width": self.width, "height": self.height,
            "recall": self.recall.tolist(), "false_rate": self.false_rate.tolist(),
        }  # fmt: skip


def measure_panel(
    grid: RateGrid,
    sensor_setting: tuple[str, int | None],
    height: float,
    methods: Sequence[str],
    *,
    config: Config | None = None,
) -> tuple[RatePanel, ...]:
    """Return the rates of methods with one sensor at one height, all on the same frames.

    Parameters
    ----------
    grid
        Distances, angles, views.
    sensor_setting
        Name and width of the sensor.
    height
        Of the camera, m.
    methods
        Keys of ``stairmap.pipeline.METHODS``.
    config
        Configuration of all methods.
    """
    name, width = sensor_setting
    native = make_sensor(name).camera.width
    sensor = make_sensor(name, factor=(width or native) / native)
    detectors = [make_detector(config, method=method) for method in methods]
    place = [list(grid.sensors).index(sensor_setting), list(grid.heights).index(height)]
    hits = np.zeros((2, len(methods), len(grid.angles), len(grid.distances)))
    for is_look_alike, stages in enumerate(make_stages(grid.seed)):
        random = np.random.default_rng([grid.seed, 3, is_look_alike, *place])
        turn = 0
        for row, column in np.ndindex(len(grid.angles), len(grid.distances)):
            for _ in range(grid.num_views):
                stage = stages[turn % len(stages)]
                turn += 1
                pose = stage.sample_pose(grid.distances[column], grid.angles[row], height, random)
                depth = sensor.measure(stage.caster.render(sensor.camera, pose), random)
                up = rotation_from_vector(random.normal(0, UP_STD, 3)) @ pose[2, :3]
                frame = DepthFrame(stamp_ns=turn, depth=depth, camera=sensor.camera, up=up)
                for index, detector in enumerate(detectors):
                    observations = detector.detect(frame).observations
                    found = [find_observed_flight(seen, pose, stage.flights) for seen in observations]
                    hit = bool(found) if is_look_alike else 0 in found
                    hits[is_look_alike, index, row, column] += hit
    rates = hits / grid.num_views
    return tuple(
        RatePanel(
            method=method, sensor=name, width=width, height=height,
            recall=rates[0, index], false_rate=rates[1, index],
        )
        for index, method in enumerate(methods)
    )  # fmt: skip


def measure_panels(
    grid: RateGrid,
    methods: Sequence[str],
    *,
    config: Config | None = None,
    num_workers: int,
    on_panel: Callable[[RatePanel], None] | None = None,
) -> tuple[RatePanel, ...]:
    """Return the rates of methods over a whole grid, its panels shared out among processes.

    ``on_panel`` is called as panels come in, once for all methods; the rest see ``measure_panel``.
    """
    panels: list[RatePanel] = []
    with make_worker_pool(num_workers) as pool:
        futures = [
            pool.submit(measure_panel, grid, setting, height, methods, config=config)
            for setting, height in grid.panels()
        ]
        for future in futures:
            found = future.result()
            panels += found
            if on_panel is not None:
                on_panel(found[0])
    return tuple(panels)


def make_stages(seed: int) -> tuple[tuple[_Stage, ...], tuple[_Stage, ...]]:
    """Return the scenes of stairs and the look-alikes, ready for cameras."""
    stairs = tuple(
        _Stage(make_feature_scene(name, np.random.default_rng([seed, 1]), hall=STAIR_HALL))
        for name in STAIR_SCENES
    )
    return stairs, tuple(_Stage(make_scene(name, seed)) for name in SCENE_GROUPS["look-alikes"])


class _Stage:
    """A scene with the place that cameras aim at."""

    def __init__(self, scene: Scene) -> None:
        self.caster = RayCaster(scene.mesh)
        self.flights = tuple(flight for stairway in scene.stairways for flight in stairway.flights)

    def sample_pose(
        self, distance: float, angle: float, height: float, random: np.random.Generator
    ) -> Transform:
        """Return a (4, 4) pose near a distance and angle, either side, that looks at the stairs' foot."""
        side = 1.0 if random.random() < 0.5 else -1.0
        angle = side * (angle + random.normal(0, np.radians(2)))
        distance *= 1 + random.normal(0, 0.03)
        eye = np.array([-distance * np.cos(angle), distance * np.sin(angle), height])
        if not self.flights:
            eye[:2] = np.maximum(eye[:2], [-_HALL_BACK, -_HALL_SIDE])
            eye[1] = min(eye[1], _HALL_SIDE)
        aim = np.array([0.0, 0.0, AIM_HEIGHT]) + random.normal(0, 0.05, 3)
        return look_at(eye, aim, roll=random.normal(0, np.radians(2)))
