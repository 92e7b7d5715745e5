"""Stairways seen from above, drawn onto axes of matplotlib that are given: x and y of the map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stairmap.arrays import Points
from stairmap.drop import Drop
from stairmap.export.summary import with_std
from stairmap.stairway import Flight, Stairway
from stairmap.visualization.dimensions import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    RED,
    draw_dimension,
    draw_label,
    finish_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
else:
    Axes: TypeAlias = Any


_TOOTH_SPACING, _TOOTH_LENGTH, _DEPTH_LABEL = 0.15, 0.08, 0.35
"""Distance and length of the teeth of an edge, and how far beyond it its depth is written, m."""


def draw_plan(axes: Axes, stairway: Stairway, *, label: str) -> None:
    for flight in stairway.flights:
        _draw_box_sides(axes, flight)
        solid = [step.nosing for step in flight.steps if step.num_observations]
        dashed = [step.nosing for step in flight.steps if not step.num_observations]
        for nosing in flight.edges() if not flight.steps else solid:
            axes.plot(nosing[:, 0], nosing[:, 1], color=BLUE, linewidth=2.0, zorder=4)
        for nosing in dashed:
            axes.plot(nosing[:, 0], nosing[:, 1], color=BLUE, linewidth=1.2, linestyle=(0, (3, 2)), zorder=4)
        nosings = flight.edges().mean(axis=1)
        start, stop = nosings[0] - 0.3 * flight.run * flight.forward, nosings[-1]
        axes.annotate(
            "", stop[:2], start[:2], zorder=6,
            arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.3, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
        draw_label(axes, (nosings[0] + nosings[-1])[:2] / 2, label)
    axes.plot([], [], color=BLUE, linewidth=2.0, label="nosing")
    for landing in stairway.landings:
        along = np.array([np.cos(landing.heading), np.sin(landing.heading)]) * landing.size[0] / 2
        across = np.array([-np.sin(landing.heading), np.cos(landing.heading)]) * landing.size[1] / 2
        corners = landing.center[:2] + np.array(
            [along + across, along - across, -along - across, -along + across]
        )
        axes.fill(
            *corners.T, facecolor=GREY, alpha=0.25, edgecolor=INK, linewidth=1.0, zorder=1, label="landing"
        )


def draw_drops(axes: Axes, drops: Sequence[Drop]) -> None:
    """Draw edges of the ground with teeth on the side where it falls off, and how deep it is there.

    Edges behind which nothing was seen are dashed.
    """
    for drop in drops:
        start, stop = drop.edge[:, :2]
        style, name = ("-", "") if drop.depth is not None else ((0, (2, 1)), ", nothing seen behind")
        axes.plot(
            *np.array([start, stop]).T, color=RED, linewidth=2.4, linestyle=style, zorder=6,
            label=f"edge of the ground{name}",
        )  # fmt: skip
        count = max(int(drop.length / _TOOTH_SPACING), 1) + 1
        feet = start + np.linspace(0.0, 1.0, count)[:, None] * (stop - start)
        teeth = feet + _TOOTH_LENGTH * drop.outward[:2]
        for foot, tip in zip(feet, teeth, strict=True):
            axes.plot(*np.array([foot, tip]).T, color=RED, linewidth=1.2, zorder=6)
        if drop.stairway_id is None and drop.depth is not None:
            place = drop.center[:2] + _DEPTH_LABEL * drop.outward[:2]
            draw_label(axes, place, f"≥ {drop.depth:.2f} m deep", color=RED)


def _draw_box_sides(axes: Axes, flight: Flight) -> None:
    left_back, left_front, right_front, right_back = outline(flight)
    axes.fill(*outline(flight).T, color=BLUE, alpha=0.07, linewidth=0, zorder=1)
    sides = (
        (left_back, left_front, flight.left_bounded),
        (right_front, right_back, flight.right_bounded),
    )
    for start, stop, bounded in sides:
        style = "-" if bounded else (0, (1, 2))
        axes.plot(*np.array([start, stop]).T, color=INK, linewidth=1.0, linestyle=style, zorder=3)


def draw_width(axes: Axes, flight: Flight) -> None:
    half = np.array([0.0, flight.width / 2])
    frame = flight.map_from_flight
    ends = [(frame[:2, :2] @ [-0.28, sign * half[1]]) + frame[:2, 3] for sign in (1, -1)]
    first = [(frame[:2, :2] @ [0.0, sign * half[1]]) + frame[:2, 3] for sign in (1, -1)]
    bound = "" if flight.left_bounded and flight.right_bounded else "≥ "
    text = f"width {bound}{with_std(flight.width * 1e3, flight.std.width * 1e3)} mm"
    draw_dimension(axes, ends[0], ends[1], text, extend_from=(first[0], first[1]))


def outline(flight: Flight) -> Points:
    """(4, 2) corners of the flight's box: left back, left front, right front, right back."""
    depth, half = flight.box.depth, flight.width / 2
    local = np.array([[depth, half], [0.0, half], [0.0, -half], [depth, -half]])
    frame = flight.map_from_flight
    return np.asarray(local @ frame[:2, :2].T + frame[:2, 3])


def draw_observed_nosings(
    axes: Axes, nosings: Points | None, window: tuple[Points, Points] | None = None
) -> None:
    if nosings is None or not len(nosings):
        return
    ends = nosings.reshape(-1, 3)[:, :2]
    if window is not None:
        ends = ends[np.all((ends >= window[0]) & (ends <= window[1]), axis=1)]
    axes.plot(*ends.T, ".", color=ORANGE, markersize=3.5, zorder=5, label="ends of nosings, single frames")


def draw_way(axes: Axes, positions: Points, window: tuple[Points, Points] | None = None) -> None:
    way = np.array(positions[:, :2])
    if window is not None:
        way[~np.all((way >= window[0]) & (way <= window[1]), axis=1)] = np.nan
    if np.isfinite(way).any():
        axes.plot(*way.T, color=GREEN, linewidth=1.8, linestyle="-.", zorder=2, label="way of the camera")
    if np.isfinite(way[0]).all():
        axes.plot(*way[0], "o", color=GREEN, markersize=7, zorder=3, label="its start")


def finish_plan(axes: Axes) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("map x, m")
    axes.set_ylabel("map y, m")
    finish_axes(axes)


def draw_legend(axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    if unique:
        axes.legend(unique.values(), unique.keys(), loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=5,
                    frameon=False)  # fmt: skip
