"""Options of ``stairmap simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import OUTPUT, DebugOption, check_finite
from stairmap.cli.requests import SimulateRequest

_DRIVE = "Drive"


def simulate(
    *,
    scene: Annotated[
        str | None, typer.Argument(help="Name of a scene; --list prints all.", show_default=False)
    ] = None,
    sensor: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Depth camera, or a LiDAR (vlp16, os0_64, mid360): then a bag is written.",
            rich_help_panel=_DRIVE,
        ),
    ] = "kinect_v1",
    factor: Annotated[
        float,
        typer.Option(
            min=0.1,
            max=1.0,
            callback=check_finite,
            metavar="F",
            help="Part of the camera's resolution along each axis.",
            rich_help_panel=_DRIVE,
        ),
    ] = 1.0,
    robot: Annotated[
        str, typer.Option(metavar="NAME", help="What carries the camera.", rich_help_panel=_DRIVE)
    ] = "turtlebot",
    frames: Annotated[
        int | None,
        typer.Option(
            min=2,
            metavar="N",
            help="Number of frames. Default: 10 Hz at the robot's speed.",
            show_default=False,
            rich_help_panel=_DRIVE,
        ),
    ] = None,
    perfect_odometry: Annotated[
        bool, typer.Option("--perfect-odometry", help="Poses without error.", rich_help_panel=_DRIVE)
    ] = False,
    seed: Annotated[
        int, typer.Option(min=0, metavar="N", help="Same seed, same recording.", rich_help_panel=_DRIVE)
    ] = 0,
    buildings: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder of the buildings, for scenes building:NAME/FLIGHT.",
            show_default=False,
            rich_help_panel=_DRIVE,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="New or empty folder for the recording. Default: recordings/<scene>_<n>, the next free n.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    list_all: Annotated[
        bool, typer.Option("--list", help="Print the names of all scenes, sensors and robots.")
    ] = False,
    debug: DebugOption = False,
) -> None:
    """Write a simulated recording of a known stairway, with noise and odometry error, and the truth.

    \b
    Examples:
      stairmap simulate --list
      stairmap simulate free_standing
      stairmap simulate davis_rear -o davis --sensor d435 --robot spot
      stairmap simulate half_turn -o walk --sensor mid360 --robot go2
    """
    from stairmap.cli.simulate import describe_scenes, simulate_recording  # noqa: PLC0415

    if list_all:
        typer.echo(describe_scenes())
        return
    if scene is None:
        raise typer.BadParameter("expected SCENE; --list prints all scenes")
    request = SimulateRequest(
        scene=scene,
        output=output,
        sensor=sensor,
        robot=robot,
        factor=factor,
        seed=seed,
        num_frames=frames,
        has_odometry_error=not perfect_odometry,
        buildings=buildings,
    )
    raise typer.Exit(simulate_recording(request))
