"""Our own methods as programs of the benchmark, and an example of the protocol.

python -m stairmap.benchmark.entry stairmap
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import Transform
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.detection.observation import StairObservation
from stairmap.frame import DepthFrame
from stairmap.input_files import parse_json
from stairmap.map_levelling import find_level_map
from stairmap.map_scan import MapScan
from stairmap.pipeline import DEFAULT_METHOD
from stairmap.recording_run import RecordingRun
from stairmap.recordings.clouds.open import open_cloud
from stairmap.recordings.depth_png import decode_depth_png
from stairmap.recordings.open import open_recording
from stairmap.session import MapSession
from stairmap.stairway import Stairway
from stairmap.transforms import transform_points


def main() -> None:
    """Answer requests from stdin until it is closed."""
    method = sys.argv[1]
    for line in sys.stdin:
        sys.stdout.write(json.dumps(answer(parse_json(line), method)) + "\n")
        sys.stdout.flush()


def answer(request: dict[str, Any], method: str) -> dict[str, Any]:
    """Return the answer of a method to a request."""
    if request["task"] == "frame":
        return {"flights": _look_at_frame(request, method)}
    if request["task"] == "drive":
        recording = open_recording(Path(request["recording"]))
        run = RecordingRun(recording, find_level_map(recording, None), config=Config(), method=method)
        run.process_frames()
        return {"flights": _flights(run.outcome().stairways)}
    if method != DEFAULT_METHOD:
        return {"skip": True}
    scan = MapScan([open_cloud(Path(request["cloud"]))], up=None, unit=None, config=Config())
    scan.read()
    return {"flights": _flights(scan.find_stairways().stairways)}


def _look_at_frame(request: dict[str, Any], method: str) -> list[dict[str, Any]]:
    pose = np.array(request["map_from_camera"])
    depth = decode_depth_png(Path(request["depth"]).read_bytes(), request["depth_scale"])
    frame = DepthFrame(stamp_ns=0, depth=depth, camera=PinholeCamera(**request["camera"]))
    detection = MapSession(method=method).detect(frame, pose)
    return [flight_from_observation(observation, pose) for observation in detection.observations]


def flight_from_observation(observation: StairObservation, map_from_camera: Transform) -> dict[str, Any]:
    """Return what one frame shows of a flight, placed in the map by its (4, 4) pose."""
    forward = map_from_camera[:3, :3] @ observation.forward
    nosing = transform_points(map_from_camera, observation.edges[0].nosing).mean(axis=0)
    steps = observation.edges[-1].step_index - observation.edges[0].step_index
    return {
        "base": (nosing - [0.0, 0.0, observation.rise]).tolist(),
        "heading": float(np.arctan2(forward[1], forward[0])),
        "rise": float(observation.rise),
        "run": float(observation.run),
        "width": float(observation.width),
        "num_risers": int(steps) + 1,
    }


def _flights(stairways: Sequence[Stairway]) -> list[dict[str, Any]]:
    return [
        {
            "base": flight.base.tolist(),
            "heading": flight.heading,
            "rise": flight.rise,
            "run": flight.run,
            "width": flight.width,
            "num_risers": flight.num_risers,
        }
        for stairway in stairways
        for flight in stairway.flights
    ]


if __name__ == "__main__":
    main()
