"""Looks at a stairway that is modelled already: does a frame see it where the model says it is?

A look follows rays of one frame to the surfaces of a flight and compares the measured depth with them. Each
ray is *on* the flight, *hidden* by something nearer (a person is no evidence against stairs), *through* it
(what was measured lies farther, so nothing is there), or unmeasured, which says nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Mask, Points, Transform, Vector, readonly
from stairmap.frame import DepthFrame
from stairmap.stairway import Flight
from stairmap.transforms import invert_transform

MAX_STEPS = 8
"""Rays go to at most this many steps of a flight, evenly spread: more tell nothing new and cost time."""

RISER_SHARES = (0.25, 0.5, 0.75)
"""Heights on a riser that rays go to, in shares of the rise: away from the edges, where depths mix."""

TREAD_SHARES = (0.15, 0.4, 0.65)
"""Places on a tread that rays go to, in shares of the run."""

SIDE_SHARES = (-0.30, -0.2, -0.1, 0.0, 0.1, 0.2, 0.30)
"""Places across that rays go to, in shares of the width: well inside, whatever the width errs."""

MIN_DEPTH, MAX_DEPTH = 0.3, 4.0
"""Depths, m, between which a ray's surface lies: cameras measure nothing nearer, and noise grows beyond."""

MIN_SLOPE = 0.15
"""Flattest angle (sine) under which a ray meets its surface: below it, a small error of the model is a large
one along the ray."""

BORDER = 2
"""Pixels at the border of an image that no ray uses."""

SENSOR_NOISE = 0.004
"""Standard deviation of a depth of 1 m, m, growing with its square: above that of every sensor in use."""

MODEL_ERROR = 0.10
"""How far a model may lie off beside what its deviations say, m: poses drift between the frames that
modelled a flight and the look."""

NUM_STD = 3.0
"""A depth differs from the model's when it is off by more standard deviations than these ..."""

MIN_TELLING_RAYS, MIN_TELLING_SHARE = 40, 0.25
"""Fewest rays that are on or through, and their smallest share of all that could be, for a look to count."""

MAX_ABSENT_SHARE, MIN_PRESENT_SHARE = 0.08, 0.3
"""Of the rays that tell: at most this share is on a flight that is not there, and at least that share on one
that is. Where risers are open, treads of 30 to 40 mm still fill 16 to 24 % of what rays are sent to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What one frame says of a flight that was modelled before.

    Attributes
    ----------
    stamp_ns
        Stamp of the frame, nanoseconds.
    middle, forward
        (3,) middle of the flight's nosing line, m, and its level direction of ascent, where the look took
        them to be, in the camera frame: a corrected trajectory moves both.
    num_on, num_hidden, num_through, num_unmeasured
        Rays by what they met. Only rays are sent that something else than the flight would be told apart on.
    """

    stamp_ns: int
    middle: Vector
    forward: Vector
    num_on: int
    num_hidden: int
    num_through: int
    num_unmeasured: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "middle", readonly(self.middle))
        object.__setattr__(self, "forward", readonly(self.forward))

    @property
    def num_telling(self) -> int:
        """Number of rays that say whether the flight is there."""
        return self.num_on + self.num_through

    @property
    def is_telling(self) -> bool:
        """Whether enough rays must have seen the flight."""
        num_sent = self.num_telling + self.num_hidden + self.num_unmeasured
        return self.num_telling >= max(MIN_TELLING_RAYS, MIN_TELLING_SHARE * num_sent)

    @property
    def is_absent(self) -> bool:
        """Whether the flight is not where the model has it."""
        return self.is_telling and self.num_on <= MAX_ABSENT_SHARE * self.num_telling

    @property
    def is_present(self) -> bool:
        """Whether it is."""
        return self.is_telling and self.num_on >= MIN_PRESENT_SHARE * self.num_telling


def look_at_flights(
    flights: Sequence[Flight], frame: DepthFrame, map_from_camera: Transform
) -> tuple[Look, ...]:
    """Return the looks of one frame at flights that were modelled before it, if they tell anything.

    Parameters
    ----------
    flights
        As they were known before the frame.
    frame
        The depth image.
    map_from_camera
        (4, 4) pose of the camera.
    """
    looks = (look_at(flight, frame, map_from_camera) for flight in flights)
    return tuple(look for look in looks if look is not None and look.is_telling)


def look_at(flight: Flight, frame: DepthFrame, map_from_camera: Transform) -> Look | None:
    """Follow the rays of a frame to a flight.

    Parameters
    ----------
    flight
        The model.
    frame
        The depth image.
    map_from_camera
        (4, 4) pose of the camera in the flight's map.

    Returns
    -------
    What the rays met; ``None`` where no ray of the frame goes to the flight.
    """
    flight_from_camera = invert_transform(flight.map_from_flight) @ map_from_camera
    eye, rotation = flight_from_camera[:3, 3], flight_from_camera[:3, :3]
    half_depth = 0.5 * (flight.num_risers - 1) * flight.run
    middle = np.array([half_depth, 0.0, 0.5 * (flight.num_risers + 1) * flight.rise])
    reach = float(np.hypot(half_depth, middle[2])) + 0.5 * flight.width
    middle_in_camera = (middle - eye) @ rotation
    if middle_in_camera[2] < -reach or np.linalg.norm(middle - eye) > MAX_DEPTH + reach:
        return None
    points, is_tread = _targets(flight)
    in_camera = (points - eye) @ rotation
    depth = in_camera[:, 2]
    usable = (depth > MIN_DEPTH) & (depth < MAX_DEPTH)
    camera = frame.camera
    z = np.where(usable, depth, 1.0)
    u = np.rint(in_camera[:, 0] / z * camera.fx + camera.cx)
    v = np.rint(in_camera[:, 1] / z * camera.fy + camera.cy)
    usable &= (u >= BORDER) & (u < camera.width - BORDER) & (v >= BORDER) & (v < camera.height - BORDER)
    if not usable.any():
        return None
    points, is_tread, in_camera = points[usable], is_tread[usable], in_camera[usable]
    u, v = u[usable].astype(np.int64), v[usable].astype(np.int64)
    tolerance, is_sent = _rays(flight, eye, points, is_tread)
    length = np.linalg.norm(in_camera, axis=1)
    measured = frame.depth[v, u].astype(np.float64)
    beyond = (measured / in_camera[:, 2] - 1.0) * length
    counts = [
        int(np.count_nonzero(is_sent & chosen))
        for chosen in (
            np.abs(beyond) <= tolerance,
            beyond < -tolerance,
            beyond > tolerance,
            ~np.isfinite(beyond),
        )
    ]
    if sum(counts) == 0:
        return None
    return Look(
        stamp_ns=frame.stamp_ns,
        middle=middle_in_camera,
        forward=rotation[0],
        num_on=counts[0],
        num_hidden=counts[1],
        num_through=counts[2],
        num_unmeasured=counts[3],
    )


def _targets(flight: Flight) -> tuple[Points, Mask]:
    """Points on risers and treads that rays go to, (M, 3) in the flight's frame, and which are on treads."""
    num = flight.num_risers
    steps = np.unique(np.linspace(0, num - 1, min(num, MAX_STEPS)).round())
    overhang = flight.overhang if np.isfinite(flight.overhang) else 0.0
    treads = steps[steps < num - 1]
    forward = np.concatenate(
        [
            np.repeat(steps * flight.run + overhang, len(RISER_SHARES)),
            ((treads[:, None] + TREAD_SHARES) * flight.run).ravel(),
        ]
    )
    up = np.concatenate(
        [
            ((steps[:, None] + RISER_SHARES) * flight.rise).ravel(),
            np.repeat((treads + 1) * flight.rise, len(TREAD_SHARES)),
        ]
    )
    num_places, num_sides = len(forward), len(SIDE_SHARES)
    points = np.empty((num_places, num_sides, 3))
    points[..., 0] = forward[:, None]
    points[..., 1] = np.array(SIDE_SHARES) * flight.width
    points[..., 2] = up[:, None]
    is_tread = np.arange(num_places) >= len(steps) * len(RISER_SHARES)
    return points.reshape(-1, 3), np.repeat(is_tread, num_sides)


def _rays(flight: Flight, eye: Vector, points: Points, is_tread: Mask) -> tuple[Float64Array, Mask]:
    """How far along its ray each point may be off, m, and to which of them rays are sent.

    Rays are sent to surfaces that face the camera, that no other step hides, and behind which the floor
    would be met so far off that an absent flight shows.
    """
    ray = points - eye
    length = np.linalg.norm(ray, axis=1)
    slope = np.where(is_tread, -ray[:, 2], ray[:, 0]) / np.maximum(length, 1e-9)
    is_sent = slope > MIN_SLOPE
    slope = np.maximum(slope, MIN_SLOPE)
    along = float(np.hypot(flight.std.base[0], flight.std.base[1]))
    heading = flight.std.heading * 0.5 * flight.width
    error = np.where(is_tread, flight.std.base[2] / slope, np.hypot(along, heading) / slope)
    noise = SENSOR_NOISE * length**2
    tolerance = MODEL_ERROR + NUM_STD * np.hypot(error, noise)
    # Where the ray would meet the lower floor if there were no flight.
    fall = np.maximum(-ray[:, 2], 1e-9)
    to_floor = np.where(ray[:, 2] < 0, length * (eye[2] / fall - 1.0), np.inf)
    is_sent &= to_floor > 2.0 * tolerance
    return tolerance, is_sent & ~_are_hidden(flight, eye, ray)


def _are_hidden(flight: Flight, eye: Vector, ray: Points) -> Mask:
    """Which of (M, 3) rays from the eye to the flight's surface pass below a nosing on their way."""
    index = np.arange(flight.num_risers)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (index * flight.run - eye[0]) / ray[:, :1]
    is_between = (share > 0.0) & (share < 1.0 - 1e-6)
    height = eye[2] + share * ray[:, 2:]
    return np.asarray((is_between & (height < (index + 1) * flight.rise - 1e-6)).any(axis=1))
