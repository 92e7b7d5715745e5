"""What all behaviours of a mission have in common: the mission, and orders that are polled until they end."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator

import py_trees
from py_trees.common import Status

from stairmap.exploration.mission import Mission
from stairmap.exploration.pilot import Progress

Step = Progress | Status
Steps = Iterator[Step]


class MissionBehaviour(py_trees.behaviour.Behaviour):
    """A behaviour written as one run through ``steps``, which yields while an order is being carried out.

    Parameters
    ----------
    mission
        What it works on.
    """

    def __init__(self, mission: Mission) -> None:
        super().__init__(name=type(self).__name__)
        self.mission = mission
        self._steps: Iterator[Status] | None = None

    @abstractmethod
    def steps(self) -> Iterator[Status]:
        """Yield ``RUNNING`` after each part of the work, and ``SUCCESS`` or ``FAILURE`` at its end."""

    def initialise(self) -> None:
        """Begin anew."""
        self._steps = self.steps()

    def update(self) -> Status:
        """Do the next part."""
        assert self._steps is not None
        return next(self._steps, Status.SUCCESS)

    def carry_out(
        self, order: Callable[[], None], *, until: Callable[[], bool] = lambda: False
    ) -> Iterator[Status]:
        """Give an order and poll it to its end, or until it is not needed any more; see ``last``."""
        order()
        while True:
            progress = self.mission.pilot.poll()
            self.last = progress
            if progress.state != "running" or until():
                return
            yield Status.RUNNING

    last: Progress = Progress(state="done")
    """How the last order ended."""
