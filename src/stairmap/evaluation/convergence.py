"""How fast the measures of a stairway settle (the report's figure 8), for all methods in one picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stairmap.config import Config
from stairmap.evaluation.drift import move_flight
from stairmap.evaluation.frame_cache import recorded_frames, simulation_sum
from stairmap.evaluation.matching import find_deviation
from stairmap.evaluation.trials import TrialSpec
from stairmap.evaluation.truth import find_truth
from stairmap.session import MapSession
from stairmap.stairway import Flight, Stairway
from stairmap.visualization.convergence import MEASURES, ConvergenceSample
from stairmap.visualization.plots import make_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLES = {
    "rise": ("#D55E00", "-", "o"),
    "run": ("#0072B2", "--", "s"),
    "width": ("#009E73", "-.", "^"),
    "pitch": ("#CC79A7", ":", "D"),
}
"""Colour (Okabe and Ito), line and marker of each measure."""

SHOWN = (0.6, 1.4)
"""Ratios beyond these are drawn at the border."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Convergence:
    """Measures of one true flight after each observation, by method.

    Attributes
    ----------
    spec
        The trial.
    truth
        The true flight: of those that had to be found, the one nearest for longest.
    samples
        For each method, its samples; none as long as it reported no such flight.
    """

    spec: TrialSpec
    truth: Flight
    samples: dict[str, tuple[ConvergenceSample, ...]]


def record_convergence(
    spec: TrialSpec,
    methods: Sequence[str],
    *,
    config: Config | None = None,
    buildings: Path | None = None,
    cache: Path | None = None,
) -> Convergence | None:
    """Run a trial and ask for the stairways after every frame that gave an observation.

    Parameters are those of ``run_trial``; ``None``: the scene has no stairway.
    """
    simulation = spec.simulation(buildings=buildings)
    truth = find_truth(simulation)
    if not truth.flights:
        return None
    followed = max(truth.flights, key=lambda true: (true.must_be_found, true.num_near_frames)).flight
    folder = None if cache is None else cache / simulation_sum() / spec.folder_name()
    sessions = {method: MapSession(config, method=method) for method in methods}
    samples: dict[str, list[ConvergenceSample]] = {method: [] for method in methods}
    counts = dict.fromkeys(methods, 0)
    frames = recorded_frames(simulation, folder)
    for index, (frame, pose) in enumerate(zip(frames, simulation.odometry_poses, strict=True)):
        moved = move_flight(followed, truth.drifts[: index + 1])
        for method, session in sessions.items():
            num_observations = len(session.add(frame, pose).observations)
            if num_observations == 0:
                continue
            counts[method] += num_observations
            estimate = _find_estimate(session.stairways(), moved)
            if estimate is not None:
                measures = {name: float(getattr(estimate, name)) for name in MEASURES}
                samples[method].append(ConvergenceSample(num_observations=counts[method], measures=measures))
    return Convergence(
        spec=spec, truth=followed, samples={method: tuple(mine) for method, mine in samples.items()}
    )


def draw_convergences(convergence: Convergence) -> Figure:
    """Draw one panel per method: each measure divided by its true value, so that all tend to 1."""
    num = len(convergence.samples)
    figure = make_figure(width=9, height=2.9 * num + 0.6)
    panels = figure.subplots(num, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, (method, samples) in zip(panels, convergence.samples.items(), strict=True):
        axes.axhspan(0.95, 1.05, color="#999999", alpha=0.18, linewidth=0, label="±5 %")
        axes.axhline(1.0, color="black", linewidth=0.8)
        counts = [sample.num_observations for sample in samples]
        for name, (color, line, marker) in STYLES.items():
            true = float(getattr(convergence.truth, name))
            ratios = np.array([sample.measures[name] for sample in samples]) / true
            text = f"{np.degrees(true):.1f}°" if name == "pitch" else f"{1e3 * true:.0f} mm"
            axes.plot(
                counts, np.clip(ratios, *SHOWN), color=color, linestyle=line, marker=marker, markersize=3.5,
                linewidth=1.4, label=f"{name} ÷ {text}",
            )  # fmt: skip
        if not samples:
            axes.text(0.5, 0.6, "reported no such stairway", transform=axes.transAxes, ha="center")
        axes.set_title(method, loc="left", fontsize=10)
        axes.set_ylabel("estimate ÷ true value")
        axes.grid(alpha=0.3)
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    panels[-1].set_xlabel("observations of the stairway")
    panels[-1].locator_params(axis="x", integer=True)
    figure.suptitle(str(convergence.spec), fontsize=11)
    return figure


def _find_estimate(stairways: Sequence[Stairway], truth: Flight) -> Flight | None:
    """Return the flight that is nearest to a true one, if any is near at all."""
    deviations = [
        (deviation, index, flight)
        for index, flight in enumerate(flight for stairway in stairways for flight in stairway.flights)
        if (deviation := find_deviation(flight, truth)) is not None
    ]
    return min(deviations, key=lambda item: item[:2])[2] if deviations else None
