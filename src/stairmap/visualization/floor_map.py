"""Maps of the floors of a building: what is free, the stairways with arrows up, portals, the planned way."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stairmap.arrays import Points
from stairmap.drop import Drop
from stairmap.navigation.exploration import Candidate
from stairmap.navigation.floors import Floor, FloorStack
from stairmap.navigation.footprints import drop_rectangles, stair_rectangles
from stairmap.navigation.limits import Verdict
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from stairmap.navigation.planner import Route
from stairmap.navigation.portals import Portal
from stairmap.stairway import Stairway
from stairmap.visualization.dimensions import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    draw_label,
    finish_axes,
    plain_text,
)
from stairmap.visualization.plan import draw_drops
from stairmap.visualization.plots import make_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
else:
    Axes: TypeAlias = Any
    Figure: TypeAlias = Any

_FREE_SHADE, _UNKNOWN_SHADE, _OCCUPIED_SHADE = 255, 215, 60
_VERDICT_COLORS: dict[Verdict, str] = {"passable": BLUE, "impassable": ORANGE, "unknown": GREY}
_MAX_CANDIDATES = 5
_CANDIDATE_LABEL = np.array([0.5, 0.35])
"""Place of a candidate's text beside its mark, m."""
_MAX_COLUMNS = 3
_PANEL = 5.4
_MARGIN = 1.0
_LABEL_DISTANCE = 0.5


def draw_floor_maps(
    floors: FloorStack,
    stairways: Sequence[Stairway],
    portals: Sequence[Portal],
    *,
    grids: Mapping[int, OccupancyGrid] | None = None,
    route: Route | None = None,
    candidates: Sequence[Candidate] = (),
    drops: Sequence[Drop] = (),
) -> Figure:
    """Draw a map of each floor, lowest first.

    Parameters
    ----------
    floors, stairways, portals
        What there is; stairs take the colour of their verdict.
    grids
        Occupancy by level; floors without one have only their stairs.
    route
        The planned way.
    candidates
        Places to explore from, cheapest first; the first five are numbered.
    drops
        Where floors end.

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    grids = {} if grids is None else grids
    shown = [floor for floor in floors.floors if floor.level in grids or _touches(floors, floor)]
    shown = shown or list(floors.floors)
    num_columns = 2 if len(shown) == 4 else min(len(shown), _MAX_COLUMNS)
    num_rows = math.ceil(len(shown) / num_columns)
    low, high = _extent(stairways, portals, grids)
    panel_height = _PANEL * float(np.clip((high[1] - low[1]) / (high[0] - low[0]), 0.4, 1.3)) + 0.5
    figure = make_figure(width=max(_PANEL * num_columns, 7.0), height=panel_height * num_rows + 1.0)
    panels = figure.subplots(num_rows, num_columns, squeeze=False).reshape(-1)
    for axes, floor in zip(panels, shown, strict=False):
        _draw_floor(axes, floor, floors, stairways, portals, grids.get(floor.level), route, candidates)
        draw_drops(axes, [drop for drop in drops if drop_rectangles([drop], floors, floor.level)])
    for axes in panels[: len(shown)]:
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
    for axes in panels[len(shown) :]:
        axes.axis("off")
    named = {
        label: handle
        for axes in panels[: len(shown)]
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=3, frameon=False)
    return figure


def _extent(
    stairways: Sequence[Stairway], portals: Sequence[Portal], grids: Mapping[int, OccupancyGrid]
) -> tuple[Points, Points]:
    """Return the lower left and upper right corner of all that is known, the same for all floors."""
    corners = [stairway.edges()[..., :2].reshape(-1, 2) for stairway in stairways]
    corners += [portal.way[:, :2] for portal in portals]
    for grid in grids.values():
        rows, columns = np.nonzero(grid.cells != UNKNOWN)
        if len(rows):
            known = np.array([[columns.min(), rows.min()], [columns.max() + 1, rows.max() + 1]])
            corners.append(np.array(grid.origin) + known * grid.resolution)
    every = np.concatenate(corners) if corners else np.zeros((1, 2))
    return every.min(axis=0) - _MARGIN, every.max(axis=0) + _MARGIN


def _touches(floors: FloorStack, floor: Floor) -> bool:
    return any(floor.level in levels for levels in floors.levels.values())


def _draw_floor(
    axes: Axes,
    floor: Floor,
    floors: FloorStack,
    stairways: Sequence[Stairway],
    portals: Sequence[Portal],
    grid: OccupancyGrid | None,
    route: Route | None,
    candidates: Sequence[Candidate],
) -> None:
    if grid is not None:
        _draw_grid(axes, grid)
    by_id = {portal.stairway_id: portal for portal in portals}
    for stairway in stairways:
        if floor.level in floors.levels[stairway.id]:
            here = [p for p in portals if floor.level in (p.lower_level, p.upper_level)]
            _draw_stairs(axes, stairway, by_id[stairway.id], floors, floor.level, here)
    if route is not None:
        _draw_route(axes, route, floor.level)
    for number, candidate in enumerate(candidates[:_MAX_CANDIDATES], start=1):
        if candidate.level == floor.level:
            axes.plot(
                *candidate.position,
                "D",
                color=PURPLE,
                markersize=8,
                zorder=9,
                label="to explore, cheapest first",
            )
            text = f"{number}: {candidate.cost:.0f} s"
            draw_label(axes, np.asarray(candidate.position) + _CANDIDATE_LABEL, text, color=PURPLE)
    state = "" if floor.is_explored else ", not explored"
    state = ", or beyond:\nthe end of its stairs was not seen" if floor.is_open else state
    axes.set_title(f"floor {floor.level} at {round(floor.height, 2) + 0.0:.2f} m{state}", color=INK)
    axes.set_aspect("equal")
    axes.set_xlabel("map x, m")
    axes.set_ylabel("map y, m")
    finish_axes(axes)


def _draw_grid(axes: Axes, grid: OccupancyGrid) -> None:
    image = np.full(grid.cells.shape, _UNKNOWN_SHADE, dtype=np.uint8)
    image[grid.cells == FREE] = _FREE_SHADE
    image[grid.cells == OCCUPIED] = _OCCUPIED_SHADE
    rows, columns = grid.cells.shape[0], grid.cells.shape[1]
    left, bottom = grid.origin
    axes.imshow(
        image, cmap="gray", vmin=0, vmax=255, origin="lower", interpolation="nearest", zorder=0,
        extent=(left, left + columns * grid.resolution, bottom, bottom + rows * grid.resolution),
    )  # fmt: skip
    for shade, name in ((_OCCUPIED_SHADE, "occupied"), (_UNKNOWN_SHADE, "unknown")):
        gray = f"{shade / 255:.3f}"
        axes.plot([], [], "s", color=gray, markeredgecolor=GREY, markersize=8, label=name)


def _draw_stairs(
    axes: Axes,
    stairway: Stairway,
    portal: Portal,
    floors: FloorStack,
    level: int,
    here: Sequence[Portal],
) -> None:
    color = _VERDICT_COLORS[portal.verdict]
    for rectangle in stair_rectangles(stairway, floors, level):
        axes.fill(
            *rectangle.corners().T, facecolor=color, alpha=0.25, edgecolor=color, linewidth=1.2, zorder=3
        )
    for flight in stairway.flights:
        for nosing in flight.edges():
            axes.plot(nosing[:, 0], nosing[:, 1], color=color, linewidth=0.8, zorder=4)
    middle = portal.way[1:-1]
    axes.plot(middle[:, 0], middle[:, 1], color=INK, linewidth=1.1, zorder=5)
    axes.annotate(
        "", tuple(middle[-1, :2]), tuple(middle[-2, :2]), zorder=6,
        arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.3, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    axes.plot([], [], color=INK, linewidth=1.1, label="stairs, arrow up")
    axes.plot(
        [],
        [],
        "s",
        color=color,
        alpha=0.5,
        markersize=9,
        label=f"{portal.verdict} for {plain_text(portal.assessment.robot)}",
    )
    pose, other = (
        (portal.lower, portal.upper_level)
        if level == portal.lower_level
        else (portal.upper, portal.lower_level)
    )
    ahead = 0.35 * np.array([np.cos(pose.heading), np.sin(pose.heading)])
    axes.annotate(
        "", tuple(pose.position[:2] + ahead), tuple(pose.position[:2]), zorder=8,
        arrowprops={"arrowstyle": "-|>", "color": ORANGE, "linewidth": 1.8, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    axes.plot(*pose.position[:2], "o", color=ORANGE, markersize=7, zorder=8, label="staging pose")
    cost = portal.cost_up if level == portal.lower_level else portal.cost_down
    is_lower = level == portal.lower_level
    flight = stairway.flights[0 if is_lower else -1]
    center = middle[:2].mean(axis=0)[:2] if is_lower else middle[-2:].mean(axis=0)[:2]
    aside = flight.map_from_flight[:2, 1] * (flight.width / 2 + _LABEL_DISTANCE)
    others = [other.way[:, :2] for other in here if other.stairway_id != portal.stairway_id]
    beside = max((center + aside, center - aside), key=lambda place: _distance(place, others))
    is_open = portal.is_lower_open if is_lower else portal.is_upper_open
    note = ",\nmay go on here" if is_open else ""
    draw_label(axes, beside, f"stairway {stairway.id}\nto floor {other}, {cost:.0f} s{note}")


def _distance(place: Points, ways: Sequence[Points]) -> float:
    """Distance of a (2,) place from the nearest of the ways of other stairs, m; infinite without any."""
    shares = np.linspace(0.0, 1.0, 20)[:, None, None]
    points = [way[:-1] + shares * np.diff(way, axis=0) for way in ways]
    return min((float(np.linalg.norm(place - part, axis=2).min()) for part in points), default=math.inf)


def _draw_route(axes: Axes, route: Route, level: int) -> None:
    for leg in route.legs:
        is_here = (
            leg.level == level if leg.kind == "floor" else _begins_or_ends(route, leg.stairway_id, level)
        )
        if is_here:
            style = "-" if leg.kind == "floor" else (0, (2, 1.5))
            axes.plot(
                *leg.points[:, :2].T,
                color=GREEN,
                linewidth=2.4,
                linestyle=style,
                zorder=7,
                label="planned way",
            )
    if route.legs and route.legs[0].level == level:
        axes.plot(*route.legs[0].points[0, :2], "o", color=GREEN, markersize=9, zorder=8, label="start")
    if route.legs and route.legs[-1].level == level and route.legs[-1].kind == "floor":
        axes.plot(*route.legs[-1].points[-1, :2], "*", color=GREEN, markersize=14, zorder=8, label="goal")


def _begins_or_ends(route: Route, stairway_id: int | None, level: int) -> bool:
    """Whether a floor leg of this level comes before or after the stairs."""
    for index, leg in enumerate(route.legs):
        if leg.stairway_id == stairway_id and leg.kind != "floor":
            near = route.legs[max(index - 1, 0) : index + 2]
            return any(neighbour.level == level for neighbour in near if neighbour.kind == "floor")
    return False
