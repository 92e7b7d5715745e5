"""A stairway seen from its side, drawn onto axes of matplotlib that are given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stairmap.arrays import Points
from stairmap.export.summary import risers_text, with_std
from stairmap.stairway import Flight
from stairmap.transforms import invert_transform, transform_points
from stairmap.visualization.dimensions import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    draw_dimension,
    finish_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
else:
    Axes: TypeAlias = Any


_NEAR = 0.2
"""Nosings of single frames this far beside a flight, m, are still drawn as its own."""


def draw_elevation(axes: Axes, flight: Flight, observed_nosings: Points | None) -> None:
    """Draw a flight from its side, the ascent to the right, with its measures.

    Parameters
    ----------
    axes
        Matplotlib axes.
    flight
        What to draw.
    observed_nosings
        (M, 2, 3) nosings seen in single frames, map, m; those near the flight are drawn as points.
    """
    _draw_surface(axes, flight)
    _draw_nosings(axes, flight)
    if observed_nosings is not None and len(observed_nosings):
        _draw_observed(axes, flight, observed_nosings)
    _draw_measures(axes, flight)
    # Room for the texts of rise and height, which stand outside of the drawing.
    room, low = 0.4 * max(flight.box.depth, 1.2), float(flight.base[2])
    axes.update_datalim(
        [(-room - 1.2 * flight.run, low), (flight.box.depth + 0.6 * room + 0.6 * flight.run, low)]
    )
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.05)
    axes.set_xlabel("level distance up the stairs, m")
    axes.set_ylabel("map z, m")
    finish_axes(axes)
    axes.legend(loc="upper left", frameon=False)


def _draw_surface(axes: Axes, flight: Flight) -> None:
    low, box = float(flight.base[2]), flight.box
    index = np.repeat(np.arange(flight.num_risers), 2)
    along = index * flight.run
    height = low + (index + np.tile([0, 1], flight.num_risers)) * flight.rise
    end = along[-1] + 0.6 * flight.run
    axes.fill_between(
        [*along, end], [*height, height[-1]], low, color=BLUE, alpha=0.09, linewidth=0, zorder=1
    )
    profile = [-1.2 * flight.run, *along, end], [low, *height, height[-1]]
    axes.plot(*profile, color=INK, linewidth=1.4, zorder=3)
    corners = box.depth * np.array([0, 1, 1, 0, 0]), low + box.height * np.array([0, 0, 1, 1, 0])
    axes.plot(*corners, color=GREY, linewidth=1.0, linestyle=(0, (4, 2)), zorder=2, label="box")


def _draw_nosings(axes: Axes, flight: Flight) -> None:
    steps = [(step.nosing.mean(axis=0), step.num_observations > 0) for step in flight.steps]
    steps = steps or [(nosing, True) for nosing in flight.edges().mean(axis=1)]
    for was_seen, fill, label in ((True, BLUE, "nosing"), (False, "white", "nosing, inferred")):
        middles = np.array([middle for middle, seen in steps if seen == was_seen]).reshape(-1, 3)
        if len(middles):
            local = transform_points(invert_transform(flight.map_from_flight), middles)
            axes.plot(
                local[:, 0], middles[:, 2], "o", markeredgecolor=BLUE, markerfacecolor=fill, markersize=7,
                zorder=5, label=label,
            )  # fmt: skip


def _draw_observed(axes: Axes, flight: Flight, observed_nosings: Points) -> None:
    local = transform_points(invert_transform(flight.map_from_flight), observed_nosings.mean(axis=1))
    box = flight.box
    near = np.abs(local[:, 1]) < flight.width / 2 + _NEAR
    near &= (local[:, 0] > -flight.run) & (local[:, 0] < box.depth + flight.run)
    near &= (local[:, 2] > 0) & (local[:, 2] < box.height + flight.rise)
    if near.any():
        heights = float(flight.base[2]) + local[near, 2]
        axes.plot(
            local[near, 0], heights, ".", color=ORANGE, markersize=3.5, zorder=6,
            label="nosing, single frames",
        )  # fmt: skip


def _draw_measures(axes: Axes, flight: Flight) -> None:
    rise, run, low, std = flight.rise, flight.run, float(flight.base[2]), flight.std
    size = flight.box.height
    beside = -1.2 * run
    draw_dimension(
        axes, (beside, low), (beside, low + rise), f"rise {with_std(rise * 1e3, std.rise * 1e3)} mm",
        extend_from=((0.0, low), (0.0, low + rise)), text_side="left",
    )  # fmt: skip
    below = low - 0.13 * max(size, 0.8)
    draw_dimension(
        axes, (0.0, below), (run, below), f"run {with_std(run * 1e3, std.run * 1e3)} mm",
        extend_from=((0.0, low), (run, low + rise)), text_side="right",
    )  # fmt: skip
    pitch = f"pitch {with_std(float(np.degrees(flight.pitch)), float(np.degrees(std.pitch)), digits=1)}°"
    first, last = np.array([0.0, low + rise]), np.array([flight.box.depth, low + size])
    if flight.num_risers > 1:
        axes.plot(*np.array([first, last]).T, color=PURPLE, linewidth=1.2, linestyle=":", zorder=3)
    beside_line = (-10 * np.sin(flight.pitch), 10 * np.cos(flight.pitch))
    axes.annotate(
        pitch, tuple((first + last) / 2), xytext=beside_line, textcoords="offset points", ha="center",
        va="bottom", rotation=np.degrees(flight.pitch), rotation_mode="anchor", color=PURPLE, fontsize=10,
        zorder=7,
    )  # fmt: skip
    right = flight.box.depth + 0.6 * run
    draw_dimension(
        axes, (right, low), (right, low + size), f"{risers_text(flight)} risers\n{size:.2f} m",
        text_side="right",
    )  # fmt: skip
