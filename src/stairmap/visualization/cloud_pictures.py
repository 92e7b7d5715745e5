"""Pictures of a map of points with the stairways found in it: from above, from the side, and at an angle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, Points
from stairmap.stairway import Flight, Stairway
from stairmap.transforms import invert_transform, transform_points
from stairmap.visualization.dimensions import BLUE, GREY, ORANGE
from stairmap.visualization.plan import draw_legend, draw_plan, finish_plan
from stairmap.visualization.plots import draw_stairway, make_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
else:
    Figure: TypeAlias = Any

PLAN_PIXELS = 700
"""Pixels of a plan along its longer side."""

MAX_POINTS_DRAWN = 60_000
"""Most points in one drawing: more look the same."""

AROUND = 1.0
"""Points this far around a stairway are shown with it, m."""

VIEW_TURN, VIEW_TILT = np.radians(35.0), np.radians(28.0)
"""From where a stairway is shown: so far to the side of its foot, and so far above."""

HEADROOM = 2.0
"""Points higher above a stairway than this would hide it, m."""


def draw_map(points: Points, stairways: Sequence[Stairway]) -> Figure:
    """Draw a map from above: darker where more points lie one above the other, as in walls.

    Parameters
    ----------
    points
        (N, 3) points, map, m.
    stairways
        What was found in them.
    """
    figure = make_figure(width=9, height=7)
    axes = figure.add_subplot()
    if len(points):
        low, high = np.percentile(points[:, :2], [0.2, 99.8], axis=0)
        size = max(float((high - low).max()), 1.0) / PLAN_PIXELS
        num = np.maximum(np.ceil((high - low) / size).astype(int), 1)
        counts, _, _ = np.histogram2d(
            points[:, 0], points[:, 1], bins=num.tolist(), range=np.stack([low, low + num * size], axis=1)
        )
        shade = np.log1p(counts.T)
        extent = (low[0], low[0] + num[0] * size, low[1], low[1] + num[1] * size)
        axes.imshow(
            shade, origin="lower", extent=extent, cmap="Greys", vmax=1.3 * max(float(shade.max()), 1.0),
            interpolation="nearest", zorder=0,
        )  # fmt: skip
    for stairway in stairways:
        draw_plan(axes, stairway, label=f"stairway {stairway.id}, up")
    if not stairways:
        axes.set_title("no stairway was found", loc="left")
    finish_plan(axes)
    draw_legend(axes)
    return figure


def draw_stairway_in_cloud(stairway: Stairway, points: Points) -> Figure:
    """Draw plan and elevations of a stairway with its measures, and the points of the map behind them."""
    figure = draw_stairway(stairway)
    near = _thinned(points_near(stairway, points))
    plan, *sides = figure.axes
    plan.plot(near[:, 0], near[:, 1], ",", color=GREY, alpha=0.35, zorder=0)
    for flight, axes in zip(stairway.flights, sides, strict=True):
        local = transform_points(invert_transform(flight.map_from_flight), near)
        inside = (np.abs(local[:, 1]) < flight.width / 2) & (local[:, 2] > -0.5)
        inside &= (local[:, 0] > -AROUND) & (local[:, 0] < flight.box.depth + AROUND)
        inside &= local[:, 2] < flight.box.height + AROUND
        axes.plot(local[inside, 0], flight.base[2] + local[inside, 2], ",", color=ORANGE, zorder=4)
        axes.plot([], [], "s", color=ORANGE, markersize=3, label="points of the map")
        axes.legend(loc="upper left", frameon=False)
    return figure


def draw_view(stairway: Stairway, points: Points) -> Figure:
    """Draw the points about a stairway as seen from beside and above its foot, with its nosings."""
    near = points_near(stairway, points)
    figure = make_figure(width=9, height=6.5)
    axes = figure.add_subplot()
    view = _view_axes(stairway.flights[0])
    center = stairway.edges().mean(axis=(0, 1))
    seen = (near - center) @ view.T
    order = np.argsort(-seen[:, 2])
    seen, height = seen[order], near[order, 2]
    step = max(len(seen) // MAX_POINTS_DRAWN, 1)
    drawn = axes.scatter(
        seen[::step, 0], seen[::step, 1], c=height[::step], cmap="viridis", s=1.5, linewidths=0, zorder=1
    )
    for nosing in stairway.edges():
        ends = (nosing - center) @ view.T
        axes.plot(ends[:, 0], ends[:, 1], color=ORANGE, linewidth=2.2, zorder=3)
    axes.plot([], [], color=ORANGE, linewidth=2.2, label="nosing")
    axes.set_aspect("equal")
    axes.set_axis_off()
    figure.colorbar(drawn, ax=axes, label="map z, m", shrink=0.7)
    axes.legend(loc="upper left", frameon=False)
    axes.set_title(f"the map about stairway {stairway.id}", loc="left", color=BLUE)
    return figure


def points_near(stairway: Stairway, points: Points) -> Points:
    """Return the (M, 3) points about a stairway, below what would hide it."""
    corners = stairway.edges().reshape(-1, 3)
    low, high = corners.min(axis=0) - AROUND, corners.max(axis=0) + np.array([AROUND, AROUND, HEADROOM])
    low[2] -= stairway.flights[0].rise
    inside = np.all((points > low) & (points < high), axis=1)
    near = points[inside]
    return np.asarray(near[~_is_over_head(stairway, near)])


def _is_over_head(stairway: Stairway, points: Points) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Tell which points lie higher above the nearest nosing than a door is."""
    middles = stairway.edges().mean(axis=1)
    over = np.zeros(len(points), dtype=bool)
    for start in range(0, len(points), MAX_POINTS_DRAWN):
        part = points[start : start + MAX_POINTS_DRAWN]
        nearest = np.argmin(np.linalg.norm(part[:, None, :2] - middles[None, :, :2], axis=2), axis=1)
        over[start : start + MAX_POINTS_DRAWN] = part[:, 2] > middles[nearest, 2] + HEADROOM
    return over


def _thinned(points: Points) -> Points:
    return points[:: max(len(points) // MAX_POINTS_DRAWN, 1)]


def _view_axes(flight: Flight) -> Float64Array:
    """(3, 3) right, up and away of the view onto a flight."""
    turned = flight.heading + VIEW_TURN
    level = np.array([np.cos(turned), np.sin(turned), 0.0])
    away = np.cos(VIEW_TILT) * level - [0.0, 0.0, np.sin(VIEW_TILT)]
    right = np.array([level[1], -level[0], 0.0])
    return np.stack([right, np.cross(right, away), away])
