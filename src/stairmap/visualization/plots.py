"""Drawings of stairways with their measures: plan, side elevation, convergence.

They need matplotlib (extra ``report``), which no other module imports, and use its ``Figure``
objects alone, never the state of pyplot. Every picture explains itself: axes with units, measures
on the drawing, Okabe and Ito's colours with line styles that also differ in grey.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stairmap.arrays import Points
from stairmap.drop import Drop
from stairmap.errors import MissingPackageError
from stairmap.stairway import Stairway
from stairmap.visualization.convergence import ConvergenceSample
from stairmap.visualization.dimensions import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    finish_axes,
    separate_labels,
)
from stairmap.visualization.elevation import draw_elevation
from stairmap.visualization.overlay import png_from_image
from stairmap.visualization.plan import (
    draw_drops,
    draw_legend,
    draw_observed_nosings,
    draw_plan,
    draw_way,
    draw_width,
    finish_plan,
    outline,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure
else:
    Figure: TypeAlias = Any

_PLAN_MARGIN = 0.5
"""Free space around a stairway in its plan, m."""


def make_figure(*, width: float, height: float) -> Figure:
    """Return an empty figure of a size in inches.

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure as MatplotlibFigure  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("matplotlib", "report", "drawing stairways") from error
    return MatplotlibFigure(figsize=(width, height), layout="constrained", facecolor="white")


def png_from_figure(figure: Figure, *, dots_per_inch: int = 130) -> bytes:
    """Return a figure as the content of a PNG file, the same for the same figure bit for bit."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415

    separate_labels(figure)
    figure.set_dpi(dots_per_inch)
    # Figure.savefig draws twice, the first time to lay out what the second one lays out again.
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return png_from_image(np.asarray(canvas.buffer_rgba())[..., 2::-1], is_small=True)


def draw_overview(
    stairways: Sequence[Stairway],
    *,
    positions: Points | None = None,
    observed_nosings: Points | None = None,
    drops: Sequence[Drop] = (),
) -> Figure:
    """Draw the plan of everything: all stairways, the robot's way, and what was observed.

    Parameters
    ----------
    stairways
        The stairways; may be empty.
    positions
        (N, 3) positions of the camera in the map, in order, m.
    observed_nosings
        (M, 2, 3) nosings seen in single frames, map, m.
    drops
        Where the ground ends.
    """
    figure = make_figure(width=9, height=6)
    axes = figure.add_subplot()
    draw_observed_nosings(axes, observed_nosings)
    if positions is not None:
        draw_way(axes, positions)
    for stairway in stairways:
        draw_plan(axes, stairway, label=f"stairway {stairway.id}, up")
    draw_drops(axes, drops)
    if not stairways:
        axes.set_title("no stairway was found", loc="left")
    finish_plan(axes)
    # Matplotlib eats its own margins to keep the scales equal; a wider data limit it leaves alone.
    bounds = axes.dataLim.get_points()
    axes.update_datalim([bounds[0] - _PLAN_MARGIN, bounds[1] + _PLAN_MARGIN])
    draw_legend(axes)
    return figure


def draw_stairway(
    stairway: Stairway, *, positions: Points | None = None, observed_nosings: Points | None = None
) -> Figure:
    """Draw plan and side elevation of a stairway with its measures.

    Nosings that were seen are solid, those that the model only infers dashed or hollow. Each flight has
    an elevation of its own, seen with the ascent to the right.

    Parameters
    ----------
    stairway
        What to draw.
    positions
        (N, 3) positions of the camera in the map, in order, m; drawn as far as they are near.
    observed_nosings
        (M, 2, 3) nosings seen in single frames, map, m.
    """
    num_flights = len(stairway.flights)
    figure = make_figure(width=13, height=5.6 if num_flights == 1 else 3.4 * num_flights + 1)
    grid = figure.add_gridspec(num_flights, 2)
    plan = figure.add_subplot(grid[:, 0])
    corners = np.concatenate([outline(flight) for flight in stairway.flights])
    low, high = corners.min(axis=0) - _PLAN_MARGIN, corners.max(axis=0) + _PLAN_MARGIN
    draw_observed_nosings(plan, observed_nosings, (low, high))
    if positions is not None:
        draw_way(plan, positions, (low, high))
    draw_plan(plan, stairway, label="up")
    for flight in stairway.flights:
        draw_width(plan, flight)
    plan.update_datalim([low, high])
    finish_plan(plan)
    headings = ", ".join(f"{np.degrees(flight.heading):.1f}°" for flight in stairway.flights)
    plan.set_title(f"plan, heading {headings}", loc="left")
    draw_legend(plan)

    for index, flight in enumerate(stairway.flights):
        side = figure.add_subplot(grid[index, 1])
        draw_elevation(side, flight, observed_nosings)
        which = f", flight {index + 1} of {num_flights}" if num_flights > 1 else ""
        side.set_title(f"side elevation{which}", loc="left")
    return figure


def draw_convergence(
    samples: Sequence[ConvergenceSample], *, reference: Mapping[str, float], reference_name: str
) -> Figure:
    """Draw how the measures of a stairway settle as observations come in (report, figure 8).

    Parameters
    ----------
    samples
        Measures after so many observations, in order.
    reference
        Values of ``rise``, ``run``, ``width`` (m) and ``pitch`` (rad) that each measure is divided by,
        so that all of them tend to 1; a measure without a reference is not drawn.
    reference_name
        What the reference is, such as ``true value``.
    """
    figure = make_figure(width=9, height=4.2)
    axes = figure.add_subplot()
    axes.axhspan(0.95, 1.05, color=GREY, alpha=0.18, linewidth=0, label="±5 %")
    axes.axhline(1.0, color=INK, linewidth=0.8)
    styles = (("rise", ORANGE, "-", "o"), ("run", BLUE, "--", "s"), ("width", GREEN, "-.", "^"))
    counts = [sample.num_observations for sample in samples]
    seen = [np.array([0.88, 1.12])]
    for name, color, dashes, marker in (*styles, ("pitch", PURPLE, ":", "D")):
        if name not in reference:
            continue
        ratios = np.array([sample.measures[name] for sample in samples]) / reference[name]
        seen.append(ratios)
        value = (
            f"{np.degrees(reference[name]):.1f}°" if name == "pitch" else f"{reference[name] * 1e3:.0f} mm"
        )
        axes.plot(
            counts, ratios, color=color, linestyle=dashes, marker=marker, markersize=4.5,
            linewidth=1.6, label=f"{name} ÷ {value}",
        )  # fmt: skip
    # A first wild estimate must not press everything else flat.
    low, high = np.nanmin(np.concatenate(seen)), np.nanmax(np.concatenate(seen))
    axes.set_ylim(max(low - 0.02, 0.4), min(high + 0.02, 1.6))
    axes.set_xlabel("observations of the stairway")
    axes.set_ylabel(f"estimate ÷ {reference_name}")
    axes.locator_params(axis="x", integer=True)
    finish_axes(axes)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return figure
