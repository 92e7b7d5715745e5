"""What a method is: a detector for single frames and a modeler for a map, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.detection.observation import Detection, Rejection, StairObservation
from stairmap.errors import ConfigError
from stairmap.frame import DepthFrame
from stairmap.stairway import Flight, Stairway
from stairmap.trajectory import Trajectory

if TYPE_CHECKING:
    from stairmap.modeling.looks import Look
    from stairmap.modeling.mapper import MapperState

DEFAULT_METHOD = "stairmap"

MIN_IMAGE_SIDE = 8
"""Fewest rows and columns of an image that is looked at, px: two steps of four rows."""

WORKING_WIDTH = 320
"""Wider images lose rows as well when they are reduced to about this width, px, and are measured so."""


class Detector(Protocol):
    """Finds stair edges in one frame."""

    def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
        """Return the observations of one frame, or the reasons why there are none."""
        ...


class Modeler(Protocol):
    """Makes stairways of observations; keeps them in the camera frame with their stamps."""

    def add(self, observation: StairObservation) -> None:
        """Take in one observation, at a cost that does not depend on how many came before."""
        ...

    def stairways(self, trajectory: Trajectory) -> tuple[Stairway, ...]:
        """Return the stairways as this trajectory places them."""
        ...


@runtime_checkable
class LookingModeler(Modeler, Protocol):
    """A modeler that also learns from frames that must see a stairway, whether they do or not."""

    def add_look(self, look: Look) -> None:
        """Take in what one frame saw of a flight."""
        ...

    def flights(self, trajectory: Trajectory) -> tuple[Flight, ...]:
        """Return the flights that frames are to look at."""
        ...


@runtime_checkable
class RestorableModeler(Modeler, Protocol):
    """A modeler that can go on in another process, or under another configuration."""

    def state(self) -> MapperState:
        """Return a copy of all that it knows."""
        ...

    def restore(self, state: MapperState) -> None:
        """Go on from a state."""
        ...


class SizeCheckedDetector:
    """A detector that looks only at images large enough to show steps; of others it says that.

    Parameters
    ----------
    detector
        Looks at the others.
    """

    def __init__(self, detector: Detector) -> None:
        self._detector = detector

    def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
        """Return the observations of one frame, or the reasons why there are none."""
        height, width = frame.depth.shape
        side = min(height * min(1.0, WORKING_WIDTH / width), width)
        if side >= MIN_IMAGE_SIDE:
            return self._detector.detect(frame, trace=trace)
        rejection = Rejection(rule="min_image_side", measured=side, limit=MIN_IMAGE_SIDE, unit="px")
        return Detection(stamp_ns=frame.stamp_ns, observations=(), rejections=(rejection,))


# Each method is imported when it is used.


def _make_stairmap_detector(config: Config) -> Detector:
    from stairmap.detection.detector import StairEdgeDetector  # noqa: PLC0415

    return StairEdgeDetector(config)


def _make_stairmap_modeler(config: Config) -> Modeler:
    from stairmap.modeling.mapper import StairwayMapper  # noqa: PLC0415

    return StairwayMapper(config)


def _make_delmerico2013_detector(config: Config) -> Detector:
    from stairmap.delmerico2013.detector import Delmerico2013Detector  # noqa: PLC0415

    return Delmerico2013Detector(config)


def _make_delmerico2013_modeler(config: Config) -> Modeler:
    from stairmap.delmerico2013.modeler import Delmerico2013Modeler  # noqa: PLC0415

    return Delmerico2013Modeler(config)


METHODS: dict[str, tuple[Callable[[Config], Detector], Callable[[Config], Modeler]]] = {
    DEFAULT_METHOD: (_make_stairmap_detector, _make_stairmap_modeler),
    "delmerico2013": (_make_delmerico2013_detector, _make_delmerico2013_modeler),
}
"""What makes the detector and the modeler of each method, by the name that ``--method`` takes."""


def make_detector(config: Config | None = None, *, method: str = DEFAULT_METHOD) -> Detector:
    """Return the detector of a method.

    Parameters
    ----------
    config
        Configuration of all stages; the default one if not given.
    method
        A key of ``METHODS``.

    Raises
    ------
    ConfigError
        If there is no such method.
    """
    make, _ = _find_method(method)
    return SizeCheckedDetector(make(Config() if config is None else config))


def make_modeler(config: Config | None = None, *, method: str = DEFAULT_METHOD) -> Modeler:
    """Return the modeler of a method; see ``make_detector``."""
    _, make = _find_method(method)
    return make(Config() if config is None else config)


def _find_method(method: str) -> tuple[Callable[[Config], Detector], Callable[[Config], Modeler]]:
    if method not in METHODS:
        raise ConfigError(f"unknown method {method!r}; choose one of: {', '.join(sorted(METHODS))}")
    return METHODS[method]


def detect(
    depth: ArrayLike,
    camera: PinholeCamera,
    up: ArrayLike | None = None,
    *,
    config: Config | None = None,
    method: str = DEFAULT_METHOD,
) -> Detection:
    """Look for stairs in one depth image.

    For many images, make a detector once with ``make_detector``, or a ``MapSession``.

    Parameters
    ----------
    depth
        (height, width) metres along the optical axis; NaN, infinite, zero or less where nothing was measured.
    camera
        The camera that took it; its size is the image's.
    up
        (3,) direction opposite to gravity, camera frame (x right, y down, z forward), of any length; without
        it, up is found from the floor in view.
    config, method
        See ``make_detector``.

    Returns
    -------
    Detection
        The stair edges, best stairway first; false if there are none, and then with the reasons.

    Raises
    ------
    ValueError
        If the image is not of the camera's size or holds whole numbers, which are no metres, or ``up`` has
        another shape, no length or a value that is not finite.
    ConfigError
        If there is no such method.
    """
    image = np.asarray(depth)
    if image.ndim != 2:
        raise ValueError(f"expected one depth image of shape (height, width), got shape {image.shape}")
    if image.dtype.kind != "f":
        raise ValueError(
            f"expected depth in metres as floating-point numbers, got {image.dtype}; divide by the depth "
            "scale, 1000 for millimetres"
        )
    measured = np.where(np.isfinite(image) & (image > 0), image, np.nan)
    direction = None if up is None else np.asarray(up, dtype=np.float64)
    frame = DepthFrame(stamp_ns=0, depth=measured, camera=camera, up=direction)
    return make_detector(config, method=method).detect(frame)
