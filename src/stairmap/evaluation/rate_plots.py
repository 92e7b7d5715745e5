"""Heat maps of detection rates."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.evaluation.detection_rates import RateGrid, RatePanel
from stairmap.visualization.plots import make_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Rate = Literal["recall", "false_rate"]

_TITLES: dict[Rate, str] = {
    "recall": "share of single frames in which the stairway is detected",
    "false_rate": "share of single frames of look-alikes with a false detection",
}


def draw_rates(panels: Sequence[RatePanel], grid: RateGrid, *, rate: Rate) -> Figure:
    """Draw the rates of one method: a row per camera height, a column per sensor, each a heat map.

    Parameters
    ----------
    panels
        All of one method.
    grid
        What they were measured with.
    rate
        Which rate; false ones have a scale of their own, from 0 to at least 5 %.
    """
    figure = make_figure(width=3.1 * len(grid.sensors) + 1.2, height=2.3 * len(grid.heights) + 1.0)
    axes = figure.subplots(len(grid.heights), len(grid.sensors), squeeze=False, sharex=True, sharey=True)
    by_place = {((panel.sensor, panel.width), panel.height): panel for panel in panels}
    highest = 1.0 if rate == "recall" else max(0.05, *(float(panel.false_rate.max()) for panel in panels))
    picture = None
    for row, height in enumerate(grid.heights):
        for column, setting in enumerate(grid.sensors):
            values = getattr(by_place[setting, height], rate)
            panel_axes = axes[row, column]
            picture = panel_axes.imshow(
                values, origin="lower", aspect="auto", vmin=0, vmax=highest,
                cmap="viridis" if rate == "recall" else "magma_r",
            )  # fmt: skip
            _label_cells(panel_axes, values, highest, is_dark_low=rate == "recall")
            if row == 0:
                name, width = setting
                panel_axes.set_title(name if width is None else f"{name}, {width} px", fontsize=10)
            if column == 0:
                panel_axes.set_ylabel(f"camera {height:g} m high\nview angle, °", fontsize=9)
            if row == len(grid.heights) - 1:
                panel_axes.set_xlabel("distance of the first step, m", fontsize=9)
            panel_axes.set_xticks(range(len(grid.distances)), [f"{value:g}" for value in grid.distances])
            panel_axes.set_yticks(
                range(len(grid.angles)), [f"{np.degrees(value):.0f}" for value in grid.angles]
            )
            panel_axes.tick_params(labelsize=8)
    if picture is not None:
        figure.colorbar(picture, ax=axes, format=lambda value, _: f"{100 * value:.0f} %", shrink=0.8)
    title = f"{panels[0].method}: {_TITLES[rate]} ({grid.num_views} views a cell)"
    figure.suptitle("\n".join(textwrap.wrap(title, 30 * len(grid.sensors))), fontsize=12)
    return figure


def _label_cells(axes: Any, values: Float64Array, highest: float, *, is_dark_low: bool) -> None:
    """Write each cell's rate in percent into it, so that it survives grey print."""
    for row, column in np.ndindex(*values.shape):
        value = values[row, column]
        is_dark = (value < 0.6 * highest) == is_dark_low
        axes.text(
            column, row, f"{100 * value:.0f}", ha="center", va="center", fontsize=6,
            color="white" if is_dark else "black",
        )  # fmt: skip
