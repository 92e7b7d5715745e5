"""Save a mission of a simulated robot, and go on from there in another process.

A file tells which world, robot and options the mission has; others are refused.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stairmap.errors import ResultsError, TrajectoryError
from stairmap.exploration.body import Body
from stairmap.exploration.odometry import Planar
from stairmap.exploration.simulated_exploration import ExplorationOptions, SimulatedExploration
from stairmap.exploration.state_file import State, bytes_from_state, load_state
from stairmap.simulation.triangle_mesh import TriangleMesh

SCHEMA = 1
"""Version of the file."""

STATE_FILE = "state.npz"

_OPTIONS = {
    "strategy": "--strategy", "seed": "--seed", "has_perfect_odometry": "--perfect-odometry",
    "allow_unknown": "--allow-unknown",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class SavedMission:
    """A mission that was saved.

    Attributes
    ----------
    path
        The file.
    start
        Where the robot began.
    num_entries, num_frames, num_recorded
        Lines of the log, frames, and frames of the recording by then; ``None`` where the recording had ended.
    state
        All the rest.
    """

    path: Path
    start: Planar
    num_entries: int
    num_frames: int
    num_recorded: int | None
    state: State


def identity_of(mesh: TriangleMesh, body: Body, options: ExplorationOptions) -> dict[str, Any]:
    """Return what a mission must have in common with a saved one: world, robot, and options."""
    world = hashlib.sha256(mesh.vertices.tobytes() + mesh.triangles.tobytes()).hexdigest()
    robot = hashlib.sha256(repr(body).encode()).hexdigest()
    return {
        "world": world,
        "robot": robot,
        **{name: getattr(options, name) for name in _OPTIONS},
    }


def bytes_from_mission(
    exploration: SimulatedExploration, identity: Mapping[str, Any], *, num_recorded: int | None
) -> bytes:
    """Return the content of a file from which the mission can go on; the robot stands on a level."""
    return bytes_from_state(
        {
            "schema": SCHEMA,
            "identity": dict(identity),
            "start": exploration.start.to_row(),
            "num_entries": exploration.log.num_entries,
            "num_recorded": num_recorded,
            "robot": exploration.robot.state(),
            "known": exploration.known.state(),
            "mission": exploration.mission.state(),
        }
    )


def load_mission(run: Path, identity: Mapping[str, Any]) -> SavedMission:
    """Read the saved mission of a run folder.

    Raises
    ------
    ResultsError
        If there is none, it is damaged, or of another version, world, robot or option.
    """
    path = run / STATE_FILE
    if not path.is_file():
        raise ResultsError(
            f"expected {path}, which a mission leaves that was stopped; {run} has nothing to resume: "
            "its mission came to its end, or had not begun"
        )
    state = load_state(path)
    if state.get("schema") != SCHEMA:
        raise ResultsError(
            f"{path} has schema {state.get('schema')}, this version of stairmap resumes {SCHEMA}; begin anew"
        )
    try:
        _check_identity(run, state["identity"], identity)
        num_recorded = state["num_recorded"]
        return SavedMission(
            path=path,
            start=Planar.from_row(state["start"]),
            num_entries=int(state["num_entries"]),
            num_frames=len(state["known"]["frames"]),
            num_recorded=None if num_recorded is None else int(num_recorded),
            state=state,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise _damaged(path, error) from error


def restore_mission(
    exploration: SimulatedExploration, saved: SavedMission, entries: Iterable[dict[str, Any]]
) -> None:
    """Let a mission that did not begin yet go on from a saved one, and the entries of its log.

    Raises
    ------
    ResultsError
        If parts of it do not belong together; the mission cannot be used then.
    """
    try:
        exploration.robot.restore(saved.state["robot"])
        exploration.known.restore(saved.state["known"])
        exploration.mission.restore(saved.state["mission"])
        exploration.log.restore(entries)
    except (KeyError, IndexError, TypeError, ValueError, TrajectoryError) as error:
        raise _damaged(saved.path, error) from error


def _check_identity(run: Path, saved: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    for name in ("world", "robot"):
        if saved[name] != now[name]:
            raise ResultsError(f"the mission in {run} was begun with another {name}; name the same one")
    for name, option in _OPTIONS.items():
        if saved[name] != now[name]:
            raise ResultsError(
                f"the mission in {run} was begun with {option} {saved[name]}, now it is {now[name]}; "
                "give the options that it was begun with"
            )


def _damaged(path: Path, error: Exception) -> ResultsError:
    return ResultsError(f"cannot go on from {path}: {error!r}; it is damaged: begin anew")
