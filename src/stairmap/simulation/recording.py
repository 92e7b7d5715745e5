"""Write a simulated drive as an image-folder recording with its truth."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.output_files import write_whole_text
from stairmap.recordings.image_folder_writer import ImageFolderWriter
from stairmap.recordings.tum_trajectory import dump_tum_trajectory
from stairmap.simulation.odometry import OdometryModel
from stairmap.simulation.robots import Robot
from stairmap.simulation.scene import Scene
from stairmap.simulation.sensors import Sensor
from stairmap.simulation.simulate import Simulation
from stairmap.simulation.visibility import measure_visibility
from stairmap.trajectory import Trajectory

DEPTH_SCALE = 5000.0
"""PNG values per metre, as in TUM's recordings: a step of 0.2 mm, up to 13 m."""

TRUTH_FILE = "truth.json"
TRUE_TRAJECTORY_FILE = "groundtruth_true.tum"


def write_simulation(
    folder: Path,
    scene: Scene,
    sensor: Sensor,
    robot: Robot,
    *,
    seed: int,
    num_frames: int | None = None,
    odometry: OdometryModel | None = None,
    on_frame: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a recording whose poses are the odometry's, with ``truth.json`` and the true trajectory.

    The map is anchored at the true first pose: truth and recording share its coordinate
    frame, and odometry drifts away from it along the drive. A method that works without fault on
    drifting poses therefore errs in place by the drift at the time when it saw the stairway;
    ``true_trajectory`` beside the recording's poses tells that drift for every frame, and measures
    such as rise, run and width hardly feel it.

    ``truth.json`` holds ``schema``, ``scene``, ``seed``, ``sensor``, ``robot``, ``num_frames``,
    ``stairways`` and ``optional_stairways`` (as in ``stairways.json``), ``true_trajectory`` (file
    name) and ``visibility``: for each flight ``stairway_id``, ``flight_index`` and what
    ``FlightVisibility.to_dict`` says, frame by frame.

    Parameters
    ----------
    folder
        Where to write; must be empty or not there.
    scene, sensor, robot, seed, num_frames, odometry
        See ``simulate``.
    on_frame
        Called with the number of frames written and of all frames.

    Returns
    -------
    The folder.

    Raises
    ------
    OutputError
        If the folder is not empty or cannot be written.
    """
    simulation = Simulation(scene, sensor, robot, seed=seed, num_frames=num_frames, odometry=odometry)
    with ImageFolderWriter(folder, sensor.camera, depth_scale=DEPTH_SCALE) as writer:
        for count, (frame, believed_pose, _) in enumerate(simulation.frames(), start=1):
            writer.write(frame, believed_pose)
            if on_frame is not None:
                on_frame(count, len(simulation))
    dump_tum_trajectory(
        folder / TRUE_TRAJECTORY_FILE,
        Trajectory(stamps_ns=simulation.stamps_ns, map_from_camera=simulation.true_poses),
    )
    truth = {
        "schema": 1,
        "scene": scene.name,
        "seed": seed,
        "sensor": sensor.name,
        "robot": robot.name,
        "num_frames": len(simulation),
        "stairways": [stairway.to_dict() for stairway in scene.stairways],
        "optional_stairways": [stairway.to_dict() for stairway in scene.optional_stairways],
        "true_trajectory": TRUE_TRAJECTORY_FILE,
        "visibility": describe_visibility(simulation),
    }
    write_whole_text(folder / TRUTH_FILE, json.dumps(truth, indent=1, allow_nan=False) + "\n")
    return folder


def describe_visibility(simulation: Simulation) -> list[dict[str, Any]]:
    """Return for each true flight, optional ones last, how it appeared over the drive."""
    scene, sensor = simulation.scene, simulation.sensor
    poses: Float64Array = np.asarray(simulation.true_poses)
    described = []
    for stairway in (*scene.stairways, *scene.optional_stairways):
        for index, flight in enumerate(stairway.flights):
            visibility = measure_visibility(flight, simulation.caster, sensor.camera, poses, sensor.max_depth)
            described.append({"stairway_id": stairway.id, "flight_index": index, **visibility.to_dict()})
    return described
