"""Kinds of stairs, and of what is none, that single frames are judged on: each with its views.

A kind makes any number of views by number and seed. What decides (overhang, roll, slope, distance) is dealt
out in turn by the number, so that few views already show all of it; the rest is drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from stairmap.arrays import Float64Array, Transform
from stairmap.simulation.kind_scenes import (
    make_ascending_scene,
    make_descending_scene,
    make_escalator_scene,
    make_sloping_scene,
)
from stairmap.simulation.look_alikes import LOOK_ALIKES
from stairmap.simulation.more_look_alikes import MORE_LOOK_ALIKES
from stairmap.simulation.scene import Scene
from stairmap.simulation.sensors import Sensor, make_sensor
from stairmap.simulation.stair_shapes import FlightShape
from stairmap.simulation.viewpoints import look_at
from stairmap.simulation.views import View, with_roll

ViewSensor = tuple[str, int | None]
"""Name of a sensor and the width it is read out at, px (``None``: full)."""

VIEW_SENSORS: tuple[ViewSensor, ...] = (
    ("kinect_v1", 320),
    ("kinect_v2", None),
    ("d435", 320),
    ("phone_lidar", None),
    ("d435", None),
)
"""Sensors of most kinds. Kinect v1 at full size sees what it sees at 320 px and renders four times longer."""

FAR_SENSORS: tuple[ViewSensor, ...] = (*VIEW_SENSORS, ("kinect_v1", None), ("ideal", 320))
SMOOTHING_SENSORS: tuple[ViewSensor, ...] = (
    ("d435", 320), ("d435", None), ("phone_lidar", None), ("phone_lidar", 640),
)  # fmt: skip

OVERHANGS = (0.0, 0.015, 0.030, 0.045)
LIPS = (0.020, 0.030, 0.045)
"""Overhangs and thicknesses of lips, m."""

ROLL_STEP = float(np.radians(15))
NUM_ROLLS = 24
PORTRAIT_TURNS = (1, 3)
"""Images turned by a quarter to either side, as of a sensor on its side whose driver turns the image."""

SLOPES = (0.01, 0.02, 0.03, 0.04)
FAR_DISTANCES = (3.0, 3.5, 4.0, 4.0, 4.0, 4.5, 5.0, 5.5, 6.0)
"""Horizontal distances of the first nosing, m; 4 m is where recall has its goal."""

ODD_RISER = 0.012
"""How much higher or lower the odd riser of an irregular flight is, m."""

REGULAR = "regular"
"""Group of the flights without an odd riser."""

IRREGULAR_DISTANCE = 1.5
"""Distance from which single steps are judged, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewSpec:
    """Names one view; equal specs give equal frames, bit for bit."""

    kind: str
    index: int
    seed: int = 0

    def folder_name(self) -> str:
        """Return a name for its files."""
        return f"{self.kind}_{self.seed}_{self.index:04d}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of scene.

    Attributes
    ----------
    make
        Makes the view of a spec.
    num_views
        Number of views in a full run.
    has_stairs
        Whether there is something to find.
    """

    make: Callable[[ViewSpec], View]
    num_views: int
    has_stairs: bool = True


def make_view(spec: ViewSpec) -> View:
    """Return a view of a kind.

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    if spec.kind not in KINDS:
        raise ValueError(f"unknown kind {spec.kind!r}; choose one of: {', '.join(KINDS)}")
    return KINDS[spec.kind].make(spec)


def _overhang(spec: ViewSpec) -> View:
    random = _random(spec)
    overhang = OVERHANGS[spec.index % len(OVERHANGS)]
    shape = _draw_shape(random, overhang=overhang, lip=float(random.choice(LIPS)))
    scene = make_ascending_scene("overhang", shape, random, is_walled=bool(random.random() < 0.5))
    pose = _pose_below(shape, random, distance=random.uniform(0.8, 2.2), height=random.uniform(0.35, 1.4))
    return _view(
        spec, f"{1e3 * overhang:.0f} mm", scene, pose, _dealt(spec.index // len(OVERHANGS), VIEW_SENSORS)
    )


def _roll(spec: ViewSpec) -> View:
    """All rolls of one scene and place and its portrait images, then the next place."""
    num = NUM_ROLLS + len(PORTRAIT_TURNS)
    place, turn = divmod(spec.index, num)
    random = _random(spec, place)
    shape = _draw_shape(random)
    if place % 3 == 2:
        scene = make_descending_scene("roll", shape, random)
        pose = _pose_above(shape, random, distance=random.uniform(0.4, 1.0), height=random.uniform(1.0, 1.5))
    else:
        scene = make_ascending_scene("roll", shape, random)
        pose = _pose_below(shape, random, distance=random.uniform(1.0, 2.0), height=random.uniform(0.35, 1.4))
    sensor = _dealt(place, VIEW_SENSORS)
    if turn >= NUM_ROLLS:
        portrait = PORTRAIT_TURNS[turn - NUM_ROLLS]
        return replace(_view(spec, "portrait", scene, pose, sensor), quarter_turns=portrait)
    angle = turn * ROLL_STEP
    group = {0: "upright", 90: "90° and 270°", 180: "180°", 270: "90° and 270°"}.get(15 * turn, "other")
    return with_roll(_view(spec, group, scene, pose, sensor), angle)


def _sloping(spec: ViewSpec) -> View:
    choices = [("level", 0.0)] + [
        (group, slope)
        for group in ("floor and treads, to the front", "floor and treads, sideways", "treads alone")
        for slope in SLOPES
    ]
    random = _random(spec)
    group, slope = choices[spec.index % len(choices)]
    shape = _draw_shape(random)
    along, across = 0.0, 0.0
    if group == "treads alone":
        scene = make_ascending_scene("sloping", replace(shape, tread_slope=slope), random)
    else:
        along = slope if group.endswith("front") else 0.0
        across = slope * random.choice([-1.0, 1.0]) if group.endswith("sideways") else 0.0
        scene = make_sloping_scene("sloping", shape, random, along=along, across=across)
    pose = _pose_below(
        shape, random, distance=random.uniform(0.8, 2.2), height=random.uniform(0.35, 1.4),
        ground=np.array([along, across]),
    )  # fmt: skip
    return _view(spec, group, scene, pose, _dealt(spec.index // len(choices), VIEW_SENSORS))


def _descending(spec: ViewSpec) -> View:
    random = _random(spec)
    shape = replace(_draw_shape(random), num_risers=int(random.integers(3, 15)))
    scene = make_descending_scene("descending", shape, random, is_walled=spec.index % 2 == 0)
    height = random.uniform(0.3, 1.5)
    pose = _pose_above(shape, random, distance=random.uniform(0.4, 2.0), height=height)
    group = "camera below 0.9 m" if height < 0.9 else "camera above 0.9 m"
    return _view(spec, group, scene, pose, _dealt(spec.index // 2, VIEW_SENSORS))


def _on_stairs(spec: ViewSpec) -> View:
    random = _random(spec)
    shape = replace(_draw_shape(random), num_risers=14, left="wall", right="wall")
    scene = make_ascending_scene("on-stairs", shape, random)
    step = int(random.integers(5, 10))
    height = random.uniform(0.35, 1.4)
    eye = np.array(
        [
            (step + random.uniform(0.2, 0.8)) * shape.run,
            random.uniform(-0.25, 0.25) * shape.width,
            (step + 1) * shape.rise + height,
        ]
    )
    is_down = spec.index % 2 == 0
    # Two or three steps below one's own, or three or four above it.
    target = step - random.uniform(2, 3) if is_down else step + random.uniform(3, 4)
    aim = np.array([target * shape.run, 0.0, (target + 1) * shape.rise]) + random.normal(0, 0.05, 3)
    return _view(
        spec, "looking down" if is_down else "looking up", scene,
        look_at(eye, aim, roll=_small_roll(random)), _dealt(spec.index // 2, VIEW_SENSORS),
    )  # fmt: skip


def _free_standing(spec: ViewSpec) -> View:
    """The same stairs, place and noise twice: with a wall behind the landing, and with nothing there."""
    pair, is_free = divmod(spec.index, 2)
    random = _random(spec, pair)
    shape = replace(_draw_shape(random), num_risers=int(random.integers(3, 7)))
    pose = _pose_below(shape, random, distance=random.uniform(0.8, 2.0), height=random.uniform(0.3, 0.6))
    scene = make_ascending_scene("free-standing", shape, random, is_walled=not is_free)
    view = _view(
        spec, "nothing behind" if is_free else "wall behind", scene, pose, _dealt(pair, VIEW_SENSORS)
    )
    return replace(view, seed=(spec.seed, pair, _KIND_NUMBERS[spec.kind]))


def _wide(spec: ViewSpec) -> View:
    random = _random(spec)
    num = 2 + spec.index % 3
    shape = replace(_draw_shape(random), num_risers=num, width=random.uniform(3.0, 5.0))
    scene = make_ascending_scene("wide", shape, random, is_walled=bool(random.random() < 0.5))
    pose = _pose_below(shape, random, distance=random.uniform(0.8, 2.5), height=random.uniform(0.35, 1.4))
    return _view(spec, f"{num} risers", scene, pose, _dealt(spec.index // 3, VIEW_SENSORS))


def _far(spec: ViewSpec) -> View:
    random = _random(spec)
    distance = FAR_DISTANCES[spec.index % len(FAR_DISTANCES)]
    shape = replace(_draw_shape(random), num_risers=int(random.integers(6, 14)))
    scene = make_ascending_scene("far", shape, random)
    pose = _pose_below(shape, random, distance=distance, height=random.uniform(0.35, 1.4), max_azimuth=20.0)
    return _view(spec, f"{distance:g} m", scene, pose, _dealt(spec.index // len(FAR_DISTANCES), FAR_SENSORS))


def _escalator(spec: ViewSpec) -> View:
    random = _random(spec)
    scene, below, above = make_escalator_scene("escalator", random)
    flight = scene.stairways[0].flights[0]
    is_up = spec.index % 2 == 0
    side = random.uniform(-0.1, 0.1)
    height = random.uniform(0.6, 1.5)
    first, last = below[0].mean(axis=0), above[-1].mean(axis=0)
    if is_up:
        floor = first[2] - flight.rise / 4
        eye = np.array([first[0] - random.uniform(0.6, 1.8), side, floor + height])
        aim = flight.steps[1].nosing.mean(axis=0)
    else:
        eye = np.array([last[0] + random.uniform(0.2, 1.0), side, last[2] + max(height, 1.0)])
        aim = flight.steps[-2].nosing.mean(axis=0)
    view = _view(
        spec, "from below" if is_up else "from above", scene,
        look_at(eye, aim + random.normal(0, 0.05, 3), roll=_small_roll(random)),
        _dealt(spec.index // 2, VIEW_SENSORS),
    )  # fmt: skip
    return replace(view, spare_below=below, spare_above=above, ends_are_known=False)


def _irregular(spec: ViewSpec) -> View:
    random = _random(spec)
    is_odd = spec.index % 2 == 1
    offset = ODD_RISER * float(random.choice([-1.0, 1.0]))
    # Among the lowest four, which a camera before the stairs sees best; the first one shows no step below.
    odd = ((int(random.integers(1, 4)), offset),) if is_odd else ()
    shape = replace(_draw_shape(random), num_risers=8, odd_risers=odd)
    scene = make_ascending_scene("irregular", shape, random)
    pose = _pose_below(shape, random, distance=IRREGULAR_DISTANCE, height=random.uniform(0.35, 1.4))
    return _view(
        spec, "one riser odd" if is_odd else REGULAR, scene, pose, _dealt(spec.index // 2, VIEW_SENSORS)
    )


def _smoothing(spec: ViewSpec) -> View:
    random = _random(spec)
    setting = _dealt(spec.index, SMOOTHING_SENSORS)
    variant = spec.index // len(SMOOTHING_SENSORS)
    shape = _draw_shape(random, overhang=0.025 if variant % 2 else 0.0, lip=0.03)
    if variant % 4 < 2:
        scene = make_ascending_scene("smoothing", shape, random)
        pose = _pose_below(shape, random, distance=random.uniform(0.8, 2.2), height=random.uniform(0.35, 1.4))
    else:
        scene = make_descending_scene("smoothing", shape, random)
        pose = _pose_above(shape, random, distance=random.uniform(0.4, 1.0), height=random.uniform(1.0, 1.5))
    name, width = setting
    return _view(spec, f"{name} {width or 'full'}", scene, pose, setting)


def _look_alike(spec: ViewSpec) -> View:
    makers = {**LOOK_ALIKES, **MORE_LOOK_ALIKES}
    names = list(makers)
    name = names[spec.index % len(names)]
    turn = spec.index // len(names)
    random = _random(spec)
    scene = makers[name](name, random)
    distance, height = random.uniform(0.6, 4.5), (0.3, 0.6, 1.3)[turn % 3]
    azimuth = np.radians(random.uniform(-60, 60))
    narrow = 0.7 if name == "corridor" else 3.7
    eye = np.array(
        [-distance * np.cos(azimuth), np.clip(distance * np.sin(azimuth), -narrow, narrow), height]
    )
    aim = np.array([0.0, 0.0, 0.5]) + random.normal(0, 0.1, 3)
    pose = look_at(eye, aim, roll=_small_roll(random))
    return _view(spec, name, scene, pose, _dealt(turn, VIEW_SENSORS))


def _random(spec: ViewSpec, place: int | None = None) -> np.random.Generator:
    """Return the source of whatever a view draws; views of one place draw the same."""
    number = spec.index if place is None else place
    return np.random.default_rng([spec.seed, _KIND_NUMBERS[spec.kind], number])


def _draw_shape(random: np.random.Generator, *, overhang: float = 0.0, lip: float = 0.04) -> FlightShape:
    """Return a usual flight: rise 0.14 to 0.20 m, run 0.25 to 0.33 m, pitch at most 38 deg."""
    rise, run = random.uniform(0.14, 0.20), random.uniform(0.25, 0.33)
    return FlightShape(
        rise=rise, run=run, width=random.uniform(0.9, 1.8), num_risers=int(random.integers(5, 12)),
        overhang=overhang, lip=lip,
    )  # fmt: skip


def _pose_below(
    shape: FlightShape,
    random: np.random.Generator,
    *,
    distance: float,
    height: float,
    max_azimuth: float = 30.0,
    ground: Float64Array | None = None,
) -> Transform:
    """Return the pose of a camera on the lower floor, height above it, that looks at the lower steps."""
    azimuth = np.radians(random.uniform(-max_azimuth, max_azimuth))
    eye = np.array([-distance * np.cos(azimuth), distance * np.sin(azimuth), height])
    if ground is not None:
        eye[2] += float(eye[:2] @ ground)
    steps = min(2.0, shape.num_risers / 2)
    aim = np.array([steps * shape.run, 0.0, steps * shape.rise]) + random.normal(0, 0.05, 3)
    return np.asarray(look_at(eye, aim, roll=_small_roll(random)))


def _pose_above(
    shape: FlightShape, random: np.random.Generator, *, distance: float, height: float
) -> Transform:
    """Return the pose of a camera on the upper floor, up to 45 deg aside, that looks down the steps.

    The distance is the edge's, along the way down.
    """
    azimuth = np.radians(random.uniform(-45, 45))
    eye = np.array([-distance, distance * np.tan(azimuth), height])
    steps = min(2.5, shape.num_risers / 2)
    aim = np.array([steps * shape.run, 0.0, -steps * shape.rise]) + random.normal(0, 0.05, 3)
    return np.asarray(look_at(eye, aim, roll=_small_roll(random)))


def _small_roll(random: np.random.Generator) -> float:
    return float(random.normal(0, np.radians(2)))


def _dealt(turn: int, sensors: tuple[ViewSensor, ...]) -> ViewSensor:
    return sensors[turn % len(sensors)]


def _view(spec: ViewSpec, group: str, scene: Scene, pose: Transform, sensor: ViewSensor) -> View:
    return View(
        kind=spec.kind, group=group, scene=scene, sensor=_sensor(sensor), map_from_camera=pose,
        seed=(spec.seed, spec.index, _KIND_NUMBERS[spec.kind]),
    )  # fmt: skip


def _sensor(setting: ViewSensor) -> Sensor:
    name, width = setting
    native = make_sensor(name).camera.width
    return make_sensor(name, factor=(width or native) / native)


KINDS: dict[str, Kind] = {
    "overhang": Kind(make=_overhang, num_views=80),
    "roll": Kind(make=_roll, num_views=6 * (NUM_ROLLS + len(PORTRAIT_TURNS))),
    "sloping": Kind(make=_sloping, num_views=65),
    "descending": Kind(make=_descending, num_views=240),
    "on-stairs": Kind(make=_on_stairs, num_views=60),
    "free-standing": Kind(make=_free_standing, num_views=80),
    "wide": Kind(make=_wide, num_views=60),
    "far": Kind(make=_far, num_views=3 * len(FAR_DISTANCES) * len(FAR_SENSORS)),
    "escalator": Kind(make=_escalator, num_views=40),
    "irregular": Kind(make=_irregular, num_views=60),
    "smoothing": Kind(make=_smoothing, num_views=64),
    "look-alikes": Kind(make=_look_alike, num_views=8 * (len(LOOK_ALIKES) + len(MORE_LOOK_ALIKES)),
                        has_stairs=False),
}  # fmt: skip
"""Every kind by its name."""

_KIND_NUMBERS = {name: number for number, name in enumerate(KINDS)}
"""Parts of the seeds; a kind that is added goes to the end."""
