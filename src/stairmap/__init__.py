"""Find stairways in depth imagery, model each one, and hand it to a planner.

The names below are the public ones. They are imported when they are first used (PEP 562), so that
``import stairmap`` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stairmap.camera import PinholeCamera
    from stairmap.clouds.detector import detect_points
    from stairmap.config import Config, load_config
    from stairmap.detection.detector import StairEdgeDetector
    from stairmap.detection.observation import Detection, Rejection, StairEdge, StairObservation
    from stairmap.drop import Drop
    from stairmap.errors import StairmapError
    from stairmap.export.loading import load_detections, load_stairways
    from stairmap.frame import DepthFrame
    from stairmap.map_levelling import find_level_map
    from stairmap.map_scan import MapScan
    from stairmap.navigation.floors import find_floors
    from stairmap.navigation.portals import make_portals
    from stairmap.navigation.robot_profile import load_robot
    from stairmap.navigation.traversability import assess
    from stairmap.pipeline import detect
    from stairmap.recordings.base import Recording
    from stairmap.recordings.camera_file import load_camera
    from stairmap.recordings.clouds.open import open_cloud
    from stairmap.recordings.frame_iterators import placed_frames
    from stairmap.recordings.open import open_recording
    from stairmap.recordings.tum_trajectory import load_tum_trajectory
    from stairmap.session import MapSession
    from stairmap.stairway import Flight, Landing, Stairway, Step
    from stairmap.trajectory import Trajectory

__version__ = "0.1.0"

__all__ = [
    "Config",
    "DepthFrame",
    "Detection",
    "Drop",
    "Flight",
    "Landing",
    "MapScan",
    "MapSession",
    "PinholeCamera",
    "Recording",
    "Rejection",
    "StairEdge",
    "StairEdgeDetector",
    "StairObservation",
    "StairmapError",
    "Stairway",
    "Step",
    "Trajectory",
    "__version__",
    "assess",
    "detect",
    "detect_points",
    "find_floors",
    "find_level_map",
    "load_camera",
    "load_config",
    "load_detections",
    "load_robot",
    "load_stairways",
    "load_tum_trajectory",
    "make_portals",
    "open_cloud",
    "open_recording",
    "placed_frames",
]

_HOMES = {
    "camera": ("PinholeCamera",),
    "clouds.detector": ("detect_points",),
    "config": ("Config", "load_config"),
    "detection.detector": ("StairEdgeDetector",),
    "detection.observation": ("Detection", "Rejection", "StairEdge", "StairObservation"),
    "drop": ("Drop",),
    "errors": ("StairmapError",),
    "export.loading": ("load_detections", "load_stairways"),
    "frame": ("DepthFrame",),
    "map_levelling": ("find_level_map",),
    "map_scan": ("MapScan",),
    "navigation.floors": ("find_floors",),
    "navigation.portals": ("make_portals",),
    "navigation.robot_profile": ("load_robot",),
    "navigation.traversability": ("assess",),
    "pipeline": ("detect",),
    "recordings.base": ("Recording",),
    "recordings.camera_file": ("load_camera",),
    "recordings.clouds.open": ("open_cloud",),
    "recordings.frame_iterators": ("placed_frames",),
    "recordings.open": ("open_recording",),
    "recordings.tum_trajectory": ("load_tum_trajectory",),
    "session": ("MapSession",),
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
