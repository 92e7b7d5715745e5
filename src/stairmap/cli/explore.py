"""``stairmap explore``: a simulated robot explores a building by itself."""

from __future__ import annotations

import json
import math

import typer

import stairmap
from stairmap.cli.exits import warn
from stairmap.cli.interrupts import noted_interrupts
from stairmap.cli.plain_table import format_columns
from stairmap.cli.progress import FrameProgress
from stairmap.cli.requests import ExploreRequest
from stairmap.exploration.body import load_body
from stairmap.exploration.mission import import_py_trees
from stairmap.exploration.mission_folder import MissionFolder
from stairmap.exploration.mission_state import identity_of, load_mission
from stairmap.exploration.odometry import Planar
from stairmap.exploration.outcome import ExplorationOutcome
from stairmap.exploration.simulated_exploration import ExplorationOptions, SimulatedExploration
from stairmap.export.results import RunFolder, create_run_folder, null_for_nan
from stairmap.export.summary import counted
from stairmap.simulation.render import check_ray_caster
from stairmap.simulation.scenes import load_world


def explore_world(request: ExploreRequest) -> int:
    """Let a robot explore, write the run folder, print what came of it; return the exit code.

    Raises
    ------
    StairmapError
        If a package is missing, the world or robot cannot be read, the robot cannot stand at the start, or
        the mission to resume is none of this world, robot and options.
    """
    import_py_trees()
    check_ray_caster()
    body = load_body(request.robot)
    try:
        mesh = load_world(request.world, request.seed, buildings=request.buildings)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    start = None
    if request.start is not None:
        x, y, z, yaw_deg = request.start
        start = Planar(x=x, y=y, z=z, heading=math.radians(yaw_deg))
    options = ExplorationOptions(
        strategy=request.strategy,
        seed=request.seed,
        has_perfect_odometry=request.has_perfect_odometry,
        allow_unknown=request.allow_unknown,
    )
    identity = identity_of(mesh, body, options)
    saved = None if request.resume is None else load_mission(request.resume, identity)
    exploration = SimulatedExploration(mesh, body, start if saved is None else saved.start, options)
    with _run_folder(request) as folder, noted_interrupts() as interrupt:
        folder.on_failure = warn
        written = MissionFolder(folder, exploration, identity, saved)
        how = "" if saved is None else f", resumed after {exploration.robot.counters.time_s:.0f} s"
        folder.log(f"stairmap {stairmap.__version__} explore {request.world} --robot {request.robot}{how}")
        with FrameProgress(0) as progress:
            outcome = exploration.run(
                should_stop=lambda: bool(interrupt),
                on_tick=lambda: progress.advance(_describe(exploration)),
            )
        if interrupt:
            typer.echo("interrupted: writing what there is so far; once more to stop at once", err=True)
        for note in written.close(outcome, with_report=request.with_report):
            folder.log(note)
            typer.echo(note, err=True)
        if request.as_json:
            values = {"output": str(folder.path), "interrupted": bool(interrupt), **outcome.to_dict()}
            typer.echo(json.dumps(null_for_nan(values), indent=1, allow_nan=False))
        else:
            typer.echo(_format_text(outcome))
            typer.echo(str(folder.path))
        return interrupt.exit_code


def _run_folder(request: ExploreRequest) -> RunFolder:
    if request.resume is not None:
        return RunFolder(request.resume)
    return create_run_folder(request.output, f"explore_{request.world.replace(':', '_')}")


def _describe(exploration: SimulatedExploration) -> str:
    num = len(exploration.known.levels.levels)
    return f"{counted(num, 'level')} · {exploration.robot.counters.path_m:.0f} m driven"


def _format_text(outcome: ExplorationOutcome) -> str:
    rows = [
        (
            str(level["level"]),
            "landing" if level["is_landing"] else "floor",
            f"{level['height'] + 0.0:.2f}",
            f"{level['area_m2']:.1f}",
        )
        for level in reversed(outcome.floors)
    ]
    table = format_columns(("level", "what", "height m", "area m2"), rows, left_aligned=("what",))
    return "\n".join(
        [
            table,
            "",
            f"{counted(outcome.floors_reached, 'floor')} reached, {outcome.area_m2:.1f} m2 mapped, "
            f"{outcome.path_m:.1f} m driven in {outcome.time_s:.0f} s",
            f"{counted(outcome.stairs_climbed, 'flight')} used, {counted(outcome.falls, 'fall')}, "
            f"{counted(outcome.collisions, 'collision')}",
            f"ended: {outcome.stopped}",
            "",
        ]
    )
