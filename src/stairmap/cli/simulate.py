"""``stairmap simulate``: a recording of a stairway whose dimensions are known."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import typer

from stairmap.cli.progress import FrameProgress
from stairmap.cli.requests import SimulateRequest
from stairmap.output_files import next_folder
from stairmap.simulation.lidars import LIDARS
from stairmap.simulation.odometry import PERFECT_ODOMETRY
from stairmap.simulation.recording import write_simulation
from stairmap.simulation.render import check_ray_caster
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import BUILDING_PREFIX, SCENE_GROUPS, SCENES, make_scene
from stairmap.simulation.sensors import SENSORS, make_sensor
from stairmap.simulation.sweep_bag import write_lidar_drive
from stairmap.simulation.sweeps import LidarDrive

RECORDINGS = Path("recordings")
"""Where recordings go that no folder was named for, below the working directory."""


def describe_scenes() -> str:
    """Return the names of all scenes, sensors and robots, one group a line."""
    groups = {f"scenes, {group}": names for group, names in SCENE_GROUPS.items()}
    groups |= {"depth cameras": tuple(SENSORS), "LiDARs": tuple(LIDARS), "robots": tuple(ROBOTS)}
    return "\n".join(f"{group}: {' '.join(names)}" for group, names in groups.items())


def simulate_recording(request: SimulateRequest) -> int:
    """Write a simulated recording and its truth; return the exit code.

    Raises
    ------
    StairmapError
        If a package is missing, the building cannot be read, or the folder cannot be written.
    """
    _check_choice("--sensor", request.sensor, (*SENSORS, *LIDARS))
    _check_choice("--robot", request.robot, ROBOTS)
    if not request.scene.startswith(BUILDING_PREFIX):
        _check_choice("SCENE", request.scene, SCENES)
    try:
        scene = make_scene(request.scene, request.seed, buildings=request.buildings)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    check_ray_caster()
    output = next_folder(RECORDINGS, request.scene) if request.output is None else request.output
    odometry = None if request.has_odometry_error else PERFECT_ODOMETRY
    with FrameProgress(None) as progress:

        def count(_: int, num_frames: int) -> None:
            progress.advance(num_frames=num_frames)

        if request.sensor in LIDARS:
            if request.factor != 1.0:
                raise typer.BadParameter(f"--factor is for cameras; {request.sensor} is read out as it is")
            drive = LidarDrive(
                scene,
                LIDARS[request.sensor],
                ROBOTS[request.robot],
                seed=request.seed,
                num_frames=request.num_frames,
                odometry=odometry,
            )
            typer.echo(str(write_lidar_drive(output, drive, seed=request.seed, on_sweep=count)))
            return 0
        folder = write_simulation(
            output,
            scene,
            make_sensor(request.sensor, factor=request.factor),
            ROBOTS[request.robot],
            seed=request.seed,
            num_frames=request.num_frames,
            odometry=odometry,
            on_frame=count,
        )
    typer.echo(str(folder))
    return 0


def _check_choice(parameter: str, name: str, choices: Collection[str]) -> None:
    if name not in choices:
        raise typer.BadParameter(f"{parameter}: {name!r} is not one of {', '.join(sorted(choices))}")
