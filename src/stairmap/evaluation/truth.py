"""What a method should have found in a simulated drive: the true flights and how they were seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Mask, readonly
from stairmap.simulation.odometry import find_drift
from stairmap.simulation.robots import drive_route
from stairmap.simulation.simulate import Simulation
from stairmap.simulation.visibility import FlightVisibility, measure_visibility
from stairmap.stairway import Flight
from stairmap.transforms import invert_transform, transform_points

NEAR_DISTANCE = 3.0
"""A flight must be found when it was seen from at most this distance, m ..."""

NEAR_ANGLE = float(np.radians(60))
"""... and this view angle, rad ..."""

NEAR_FRAMES = 20
"""... in this many frames at 10 Hz, with at least three nosings in view."""

SURE_DISTANCE = 5.0
"""A nosing is surely seen when it was in view within this depth, m ..."""

MIN_SEPARATION = 4.0
"""... at least so many pixels from the nosings above and below it (down a stairwell, grazing, all of them
crowd into a few rows of the image) ..."""

SURE_FRAMES = 10
"""... in this many frames; counting fewer steps than those is an error."""

FAR_FLIGHT = 12.0
"""A flight that no camera came nearer to, m, is in nobody's view: rays need not tell."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueFlight:
    """A true flight of a drive.

    Attributes
    ----------
    stairway_id, flight_index
        Which one it is.
    flight
        Its truth in the true map.
    is_optional
        Whether it may be reported or not: neither blamed nor credited.
    must_be_found
        Whether it came near enough for long enough (module constants) and is not optional.
    num_near_frames
        Number of frames in which it was near.
    surely_seen, possibly_seen
        (num_risers,) nosings in view for ``SURE_FRAMES`` frames within ``SURE_DISTANCE`` and apart from
        their neighbours, and in view in any frame at any distance that the sensor measures.
    """

    stairway_id: int
    flight_index: int
    flight: Flight
    is_optional: bool
    must_be_found: bool
    num_near_frames: int
    surely_seen: Mask
    possibly_seen: Mask

    def __post_init__(self) -> None:
        for name in ("surely_seen", "possibly_seen"):
            object.__setattr__(self, name, readonly(getattr(self, name), np.bool_))

    @property
    def is_whole_in_view(self) -> bool:
        """Whether every nosing was surely seen."""
        return bool(self.surely_seen.all())


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveTruth:
    """The truth of one drive.

    Attributes
    ----------
    flights
        All true flights, optional ones last.
    drifts
        (N, 4, 4) ``odometry_map_from_true_map`` of each frame.
    true_poses
        (N, 4, 4) true ``map_from_camera``.
    """

    flights: tuple[TrueFlight, ...]
    drifts: Float64Array
    true_poses: Float64Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "drifts", readonly(self.drifts))
        object.__setattr__(self, "true_poses", readonly(self.true_poses))


def find_truth(simulation: Simulation) -> DriveTruth:
    """Return what was to be found in a drive.

    A drive with fewer frames than 10 Hz gives needs proportionally fewer of them near a flight.
    """
    scene = simulation.scene
    natural = len(drive_route(scene.route, simulation.robot, random=np.random.default_rng(0)))
    share = min(len(simulation) / natural, 1.0)
    near_frames, sure_frames = round(NEAR_FRAMES * share), max(round(SURE_FRAMES * share), 1)
    flights = []
    for stairway in (*scene.stairways, *scene.optional_stairways):
        is_optional = any(stairway is optional for optional in scene.optional_stairways)
        for index, flight in enumerate(stairway.flights):
            anywhere, near = _measure_twice(flight, simulation)
            sure = near.is_nosing_visible & _find_separate(flight, simulation)
            num_near = anywhere.num_frames_within(NEAR_DISTANCE, NEAR_ANGLE)
            flights.append(
                TrueFlight(
                    stairway_id=stairway.id,
                    flight_index=index,
                    flight=flight,
                    is_optional=is_optional,
                    must_be_found=not is_optional and num_near >= max(near_frames, 1),
                    num_near_frames=num_near,
                    surely_seen=sure.sum(axis=0) >= sure_frames,
                    possibly_seen=np.asarray(anywhere.is_nosing_visible.any(axis=0)),
                )
            )
    return DriveTruth(
        flights=tuple(flights),
        drifts=find_drift(simulation.odometry_poses, simulation.true_poses),
        true_poses=np.asarray(simulation.true_poses),
    )


def _measure_twice(flight: Flight, simulation: Simulation) -> tuple[FlightVisibility, FlightVisibility]:
    """Visibility within the sensor's range, and within the depth at which a nosing is surely seen."""
    poses: Float64Array = np.asarray(simulation.true_poses)
    ends = np.array([flight.steps[0].nosing.mean(axis=0), flight.steps[-1].nosing.mean(axis=0)])
    distances = np.linalg.norm(poses[:, None, :3, 3] - ends, axis=2)
    # Within a range of zero nothing is in view and no ray is cast.
    max_depth = simulation.sensor.max_depth if distances.min() < FAR_FLIGHT else 0.0
    camera, caster = simulation.sensor.camera, simulation.caster
    return (
        measure_visibility(flight, caster, camera, poses, max_depth),
        measure_visibility(flight, caster, camera, poses, min(max_depth, SURE_DISTANCE)),
    )


def _find_separate(flight: Flight, simulation: Simulation) -> Mask:
    """Return in which frames which nosings, (N, K), stand apart from their neighbours in the image."""
    middles = np.array([step.nosing.mean(axis=0) for step in flight.steps])
    separate = np.zeros((len(simulation), len(middles)), dtype=bool)
    for frame, pose in enumerate(simulation.true_poses):
        with np.errstate(invalid="ignore"):
            pixels = simulation.sensor.camera.project(transform_points(invert_transform(pose), middles))
            gaps = np.linalg.norm(np.diff(pixels, axis=0), axis=1)
        wide = ~(gaps < MIN_SEPARATION)
        separate[frame] = np.append(True, wide) & np.append(wide, True)
    return separate
