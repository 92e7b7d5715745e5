"""How the measures of each stairway changed while observations came in, in bounded memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from stairmap.stairway import Stairway

MEASURES: tuple[str, ...] = ("rise", "run", "width", "pitch")
"""What is followed, for the first flight of each stairway."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvergenceSample:
    """The measures (m, rad; keys are ``MEASURES``) of a stairway after so many observations of it."""

    num_observations: int
    measures: Mapping[str, float]


class ConvergenceRecorder:
    """Keeps samples at a schedule that thins out, so that their number grows as a logarithm.

    Asking a modeler for its stairways is not free; ``is_due`` says when it pays.
    """

    def __init__(self) -> None:
        self._next = 1
        self._samples: dict[int, list[ConvergenceSample]] = {}

    def is_due(self, num_observations: int) -> bool:
        """Tell whether so many observations, of all stairways together, are enough for a new sample."""
        return num_observations >= self._next

    def add(self, stairways: Sequence[Stairway], num_observations: int) -> None:
        """Take a sample of each stairway, after so many observations of all of them together."""
        self._next = max(num_observations + 1, int(num_observations * 1.12))
        for stairway in stairways:
            self.add_stairway(stairway)

    def add_stairway(self, stairway: Stairway) -> None:
        """Take a sample of one stairway; the newest replaces one of equally many observations."""
        samples = self._samples.setdefault(stairway.id, [])
        if samples and samples[-1].num_observations >= stairway.num_observations:
            samples.pop()
        flight = stairway.flights[0]
        measures = {name: float(getattr(flight, name)) for name in MEASURES}
        samples.append(ConvergenceSample(num_observations=stairway.num_observations, measures=measures))

    def samples(self, stairway_id: int) -> tuple[ConvergenceSample, ...]:
        """Return the samples of a stairway, in order; empty for one that was never seen."""
        return tuple(self._samples.get(stairway_id, ()))
