"""A mission: the tree of behaviours that explores floor after floor until nothing reachable is left.

    mission = Mission(known=known, pilot=pilot, clock=lambda: robot.counters.time_s)
    while mission.tick():
        pass

py-trees (extra ``explore``) runs the tree. Each behaviour is a short file in ``behaviours/``.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stairmap.arrays import Vector
from stairmap.errors import MissingPackageError
from stairmap.exploration.decision_log import DecisionLog
from stairmap.exploration.known_building import SAME_PLACE, KnownBuilding
from stairmap.exploration.level_search import LevelSearch
from stairmap.exploration.pilot import Pilot
from stairmap.exploration.state_file import State
from stairmap.exploration.tasks import Task

MAX_FAILURES = {"frontier": 3, "look": 3, "stairs": 8}
"""A task that failed so often is given up, by kind: another floor is worth more tries."""

MAX_RETRIES = 3
"""A robot that finds nothing more to reach tries this often whether what stopped it still does."""

DONE_REASON = "nothing reachable is left"

INTERRUPTED_REASON = "interrupted"


@dataclass(slots=True, kw_only=True)
class Mission:
    """What all behaviours share.

    Attributes
    ----------
    known
        What the robot knows.
    pilot
        Who carries out orders.
    clock
        Time of the mission, s.
    log
        Decisions and events.
    strategy
        One of ``strategies.STRATEGIES``.
    task
        What it does now.
    stopped
        Why it ended; empty while it goes on.
    must_look_around
        Whether it has come to a place where it saw nothing yet.
    coverage
        Time (s), area (m²) and level, once for each decision.
    on_rest
        Called on a level where the mission could be saved: before each decision, and with ``True`` where it
        is interrupted.
    """

    known: KnownBuilding
    pilot: Pilot
    clock: Callable[[], float]
    log: DecisionLog = field(default_factory=DecisionLog)
    strategy: str = "gain"
    task: Task | None = None
    stopped: str = ""
    must_look_around: bool = True
    coverage: list[tuple[float, float, int]] = field(default_factory=list)
    stairs_climbed: int = 0
    num_stuck: int = 0
    num_retries: int = 0
    search: LevelSearch | None = None
    failures: list[tuple[int, str, Vector]] = field(default_factory=list)
    on_rest: Callable[[bool], None] = lambda _: None
    _tree: Any = None

    def tick(self) -> bool:
        """Let the tree do its next small part, unless it was stopped; return whether the mission goes on."""
        if self.stopped:
            return False
        if self._tree is None:
            self._tree = make_tree(self)
        self._tree.tick_once()
        return not self.stopped

    def note(self, event: str, **values: Any) -> None:
        """Log something that happened now."""
        self.log.note(self.clock(), event, **values)

    def fail(self, task: Task, reason: str) -> None:
        """Note that a task could not be done."""
        self.failures.append((task.level, task.kind, task.target))
        self.note("failed", kind=task.kind, target=[round(float(v), 2) for v in task.target], reason=reason)

    def is_open(self, task: Task) -> bool:
        """Tell whether a task has not failed too often."""
        failures = sum(
            level == task.level and kind == task.kind and math.dist(place, task.target) < SAME_PLACE / 2
            for level, kind, place in self.failures
        )
        return failures < MAX_FAILURES[task.kind]

    def try_again(self) -> bool:
        """Try again where something stopped the robot; return whether there is such a place.

        Stairs that failed stay so.
        """
        if self.num_retries >= MAX_RETRIES or not self.known.forgive_stops():
            return False
        self.num_retries += 1
        self.failures = [failure for failure in self.failures if failure[1] == "stairs"]
        self.must_look_around = True
        self.note("tries again", reason="nothing reachable is left; what stopped the robot is forgotten")
        return True

    def interrupt(self) -> None:
        """End the mission for now; on a level it can be saved before."""
        if self.known.level is not None:
            self.on_rest(True)
        self.stop(INTERRUPTED_REASON)

    def state(self) -> State:
        """Return what it was at besides its log and what is known of the building, to go on from.

        The task is left out: the next decision chooses anew.
        """
        return {
            "must_look_around": self.must_look_around,
            "coverage": np.array(self.coverage, dtype=np.float64).reshape(-1, 3),
            "stairs_climbed": self.stairs_climbed,
            "num_stuck": self.num_stuck,
            "num_retries": self.num_retries,
            "failures": [[level, kind, np.asarray(place)] for level, kind, place in self.failures],
        }

    def restore(self, state: State) -> None:
        """Go on from a state.

        Raises
        ------
        KeyError, ValueError, TypeError
            If it is none.
        """
        self.must_look_around = bool(state["must_look_around"])
        self.coverage = [(float(t), float(a), int(level)) for t, a, level in state["coverage"]]
        self.stairs_climbed, self.num_stuck = int(state["stairs_climbed"]), int(state["num_stuck"])
        self.num_retries = int(state["num_retries"])
        self.failures = [(int(level), str(kind), place) for level, kind, place in state["failures"]]

    def stop(self, reason: str) -> None:
        """End the mission."""
        self.stopped = reason
        self.note("stopped", reason=reason)


def import_py_trees() -> Any:
    """Return the package py_trees.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    try:
        return importlib.import_module("py_trees")
    except ImportError as error:
        raise MissingPackageError("py-trees", "explore", "exploring by itself") from error


def make_tree(mission: Mission) -> Any:
    """Return the tree of behaviours of a mission."""
    import_py_trees()
    from stairmap.exploration.behaviours.tree import make_mission_tree  # noqa: PLC0415

    return make_mission_tree(mission)
