"""Find stairways in depth imagery, model each one, and hand it to a planner.

The names below are the public ones. They are imported when they are first used (PEP 562), so that
``import stairmap`` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stairmap.camera import PinholeCamera
    from stairmap.config import Config, load_config
    from stairmap.detection.detector import StairEdgeDetector
    from stairmap.detection.observation import Detection, Rejection, StairEdge, StairObservation
    from stairmap.errors import StairmapError
    from stairmap.export.loading import load_detections, load_stairways
    from stairmap.frame import DepthFrame
    from stairmap.pipeline import StairwayPipeline
    from stairmap.recordings.base import Recording
    from stairmap.recordings.open import open_recording
    from stairmap.stairway import Flight, Landing, Stairway, Step
    from stairmap.trajectory import Trajectory

__version__ = "0.1.0"

__all__ = [
    "Config",
    "DepthFrame",
    "Detection",
    "Flight",
    "Landing",
    "PinholeCamera",
    "Recording",
    "Rejection",
    "StairEdge",
    "StairEdgeDetector",
    "StairObservation",
    "StairmapError",
    "Stairway",
    "StairwayPipeline",
    "Step",
    "Trajectory",
    "__version__",
    "load_config",
    "load_detections",
    "load_stairways",
    "open_recording",
]

_HOMES = {
    "camera": ("PinholeCamera",),
    "config": ("Config", "load_config"),
    "detection.detector": ("StairEdgeDetector",),
    "detection.observation": ("Detection", "Rejection", "StairEdge", "StairObservation"),
    "errors": ("StairmapError",),
    "export.loading": ("load_detections", "load_stairways"),
    "frame": ("DepthFrame",),
    "pipeline": ("StairwayPipeline",),
    "recordings.base": ("Recording",),
    "recordings.open": ("open_recording",),
    "stairway": ("Flight", "Landing", "Stairway", "Step"),
    "trajectory": ("Trajectory",),
}
_HOME_OF_NAME = {name: f"stairmap.{home}" for home, names in _HOMES.items() for name in names}

# A type checker must see the names above, not a function that has any name.
if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used."""
        if name not in _HOME_OF_NAME:
            raise AttributeError(f"module 'stairmap' has no attribute {name!r}")
        value = getattr(importlib.import_module(_HOME_OF_NAME[name]), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        """List the public names, imported or not."""
        return sorted({*globals(), *__all__})
