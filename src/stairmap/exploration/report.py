"""``report.html`` of a mission: a plan of each level with the robot's way, coverage over time, a replay.

One file, pictures inside, nothing loaded from elsewhere. It needs matplotlib (extra ``report``).
"""

from __future__ import annotations

import base64
import html
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import cv2
import numpy as np

import stairmap
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.frontiers import frontier_mask
from stairmap.exploration.levels import Level
from stairmap.exploration.outcome import ExplorationOutcome
from stairmap.exploration.simulated_exploration import SimulatedExploration
from stairmap.modeling.landings import top_of
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from stairmap.visualization.dimensions import BLUE, GREEN, GREY, INK, ORANGE, finish_axes
from stairmap.visualization.plots import make_figure, png_from_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
else:
    Axes: TypeAlias = Any
    Figure: TypeAlias = Any

_TEMPLATE = Path(__file__).with_name("report.html")
_COLUMNS = 3
_PANEL = 5.0
_SHADES = {FREE: (255, 255, 255), UNKNOWN: (215, 215, 215), OCCUPIED: (60, 60, 60)}
_DROP_SHADE = (243, 200, 170)
_MARGIN = 0.5
_VERDICT_COLORS = {"passable": BLUE, "impassable": ORANGE, "unknown": GREY}


def draw_levels(known: ExplorationMap) -> Figure:
    """Draw a plan of each level, highest last: ground, drops, frontiers left, stairs, the robot's way.

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    levels = sorted(known.levels.levels, key=lambda level: level.height)
    columns = min(len(levels), _COLUMNS)
    rows = -(-len(levels) // columns)
    low, high = _extent(levels)
    height = _PANEL * float(np.clip((high[1] - low[1]) / (high[0] - low[0]), 0.4, 1.4)) + 0.6
    figure = make_figure(width=max(_PANEL * columns, 6.0), height=height * rows + 0.9)
    panels = figure.subplots(rows, columns, squeeze=False).reshape(-1)
    for axes, level in zip(panels, levels, strict=False):
        _draw_level(axes, known, level)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
    for axes in panels[len(levels) :]:
        axes.axis("off")
    named = {
        label: handle
        for axes in panels[: len(levels)]
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=4, frameon=False)
    return figure


def draw_coverage(outcome: ExplorationOutcome) -> Figure:
    """Draw the ground mapped over time, with a mark where the level changes."""
    figure = make_figure(width=8.0, height=3.2)
    axes = figure.subplots()
    times = [row[0] for row in outcome.coverage]
    areas = [row[1] for row in outcome.coverage]
    axes.step(times, areas, where="post", color=BLUE, linewidth=1.6)
    last = None
    for time_s, area, level in outcome.coverage:
        if level != last:
            axes.plot(time_s, area, "o", color=ORANGE, markersize=4)
            axes.annotate(f"level {level}", (time_s, area), xytext=(3, -11), textcoords="offset points",
                          fontsize=7, color=INK)  # fmt: skip
            last = level
    axes.set_xlabel("time, s")
    axes.set_ylabel("free ground mapped, m²")
    finish_axes(axes)
    return figure


def render_mission_report(exploration: SimulatedExploration, outcome: ExplorationOutcome) -> str:
    """Return the report as one HTML page.

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    known = exploration.known
    facts = [
        (f"{outcome.floors_reached}", "floors reached"),
        (f"{outcome.area_m2:.1f} m²", "mapped"),
        (f"{outcome.path_m:.0f} m", "driven"),
        (f"{outcome.time_s / 60:.1f} min", "of the robot's time"),
        (f"{outcome.falls} / {outcome.collisions}", "falls / collisions"),
    ]
    parts = {
        "VERSION": html.escape(f"stairmap {stairmap.__version__}, {known.body.profile.name}"),
        "FACTS": "".join(
            f'<div class="fact"><b>{html.escape(a)}</b>{html.escape(b)}</div>' for a, b in facts
        ),
        "ENDED": html.escape(outcome.stopped),
        "LEVELS": _image(png_from_figure(draw_levels(known))),
        "COVERAGE": _image(png_from_figure(draw_coverage(outcome))),
        "STAIRS": _stairs_table(known),
        "LOG": _log_table(exploration),
        "REPLAY": json.dumps(_replay(exploration), separators=(",", ":")).replace("</", "<\\/"),
    }
    page = _TEMPLATE.read_text(encoding="utf-8")
    for name, text in parts.items():
        page = page.replace(f"<!--{name}-->", text)
    return page


def _extent(levels: list[Level]) -> tuple[np.ndarray, np.ndarray]:
    corners = []
    for level in levels:
        grid = level.map.grid()
        rows, columns = np.nonzero(grid.cells != UNKNOWN)
        if len(rows):
            corners.append(grid.centers(rows, columns))
    every = np.concatenate(corners) if corners else np.zeros((1, 2))
    return every.min(axis=0) - _MARGIN, every.max(axis=0) + _MARGIN


def _level_image(level: Level, grid: OccupancyGrid) -> np.ndarray:
    image = np.zeros((*grid.cells.shape, 3), dtype=np.uint8)
    for value, shade in _SHADES.items():
        image[grid.cells == value] = shade
    image[level.map.drops()] = _DROP_SHADE
    return image


def _draw_level(axes: Axes, known: ExplorationMap, level: Level) -> None:
    grid = level.map.grid()
    left, bottom = grid.origin
    rows, columns = grid.cells.shape
    axes.imshow(
        _level_image(level, grid), origin="lower", interpolation="nearest", zorder=0,
        extent=(left, left + columns * grid.resolution, bottom, bottom + rows * grid.resolution),
    )  # fmt: skip
    mask = frontier_mask(grid, level.map.settled)
    frontier_rows, frontier_columns = np.nonzero(mask)
    cells = grid.centers(frontier_rows, frontier_columns)
    axes.plot(*cells.T, ".", color=GREEN, markersize=1.0, zorder=2, label="frontier that is left")
    for link in known.stairs.links:
        if level.number not in (link.lower, link.upper):
            continue
        color = _VERDICT_COLORS[link.portal.verdict]
        for nosing in link.flight.edges():
            axes.plot(nosing[:, 0], nosing[:, 1], color=color, linewidth=0.9, zorder=3)
        start, end = link.flight.base, top_of(link.flight)
        axes.annotate(
            "", (end[0], end[1]), (start[0], start[1]), zorder=4,
            arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.2},
        )  # fmt: skip
        axes.plot([], [], color=color, label=f"stairs, {link.portal.verdict}")
    number = {"level": level.number}
    way = np.array(
        [
            (pose.x, pose.y) if record.level == number["level"] else (np.nan, np.nan)
            for pose, record in zip(known.poses, known.records, strict=True)
        ]
    ).reshape(-1, 2)
    axes.plot(*way.T, color=GREEN, linewidth=1.2, zorder=5, label="the robot's way")
    kind = "landing" if level.is_landing else "floor"
    axes.set_title(f"level {level.number}, {kind} at {level.height + 0.0:.2f} m", color=INK)
    axes.set_aspect("equal")
    axes.set_xlabel("map x, m")
    axes.set_ylabel("map y, m")
    finish_axes(axes)


def _stairs_table(known: ExplorationMap) -> str:
    rows = []
    for link in known.stairs.links:
        flight = link.flight
        cells = (
            str(link.number), f"{link.lower} – {link.upper if link.upper < 1000 else '?'}",
            str(flight.num_risers), f"{flight.rise * 1e3:.0f}", f"{flight.run * 1e3:.0f}",
            f"{flight.width * 1e3:.0f}", f"{link.portal.verdict}, P {link.probability:.2f}",
            link.state + (f": {link.reason}" if link.reason else ""),
        )  # fmt: skip
        rows.append("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>")
    head = ("flight", "levels", "risers", "rise mm", "run mm", "width mm", "verdict", "state")
    return "<table><tr>" + "".join(f"<th>{name}</th>" for name in head) + "</tr>" + "".join(rows) + "</table>"


def _log_table(exploration: SimulatedExploration) -> str:
    rows = []
    for decision in exploration.log.decisions:
        chosen = decision.chosen
        others = ", ".join(
            f"{task.kind} {task.cost:.0f} s / {task.gain:.1f} m²"
            for task in sorted(decision.tasks, key=lambda task: task.cost)[:5]
            if task is not chosen
        )
        what = "end" if chosen is None else f"{chosen.kind} {chosen.cost:.0f} s / {chosen.gain:.1f} m²"
        why = "" if chosen is None else chosen.reason
        cells = (f"{decision.time_s:.0f}", str(decision.level), what, why, others)
        rows.append("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>")
    head = "".join(f"<th>{name}</th>" for name in ("time s", "level", "chosen", "because", "others"))
    return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


def _replay(exploration: SimulatedExploration) -> dict[str, Any]:
    """Return what the page's small program draws: a picture of each level, the way, the decisions."""
    known = exploration.known
    low, high = _extent(known.levels.levels)
    levels = {}
    for level in known.levels.levels:
        grid = level.map.grid()
        cell = grid.resolution
        image = _level_image(level, grid)[..., ::-1]
        shift = np.round((np.array(grid.origin) - low) / cell).astype(int)
        size = np.ceil((high - low) / cell).astype(int)
        canvas = np.full((size[1], size[0], 3), 215, dtype=np.uint8)
        rows = np.arange(image.shape[0]) + shift[1]
        columns = np.arange(image.shape[1]) + shift[0]
        inside_rows, inside_columns = (rows >= 0) & (rows < size[1]), (columns >= 0) & (columns < size[0])
        canvas[np.ix_(rows[inside_rows], columns[inside_columns])] = image[
            np.ix_(inside_rows, inside_columns)
        ]
        png = cv2.imencode(".png", canvas[::-1])[1].tobytes()
        levels[level.number] = {
            "image": "data:image/png;base64," + base64.b64encode(png).decode("ascii"),
            "height": round(level.height, 2),
            "landing": level.is_landing,
        }
    way = [
        [round(record.stamp_ns * 1e-9, 1), round(pose.x, 2), round(pose.y, 2), round(pose.heading, 2),
         -1 if record.level is None else record.level, round(pose.z, 2)]
        for pose, record in zip(known.poses, known.records, strict=True)
    ]  # fmt: skip
    decisions = [
        [round(decision.time_s, 1), decision.chosen.kind, *np.round(decision.chosen.target, 2).tolist(),
         f"{decision.chosen.kind}: {decision.chosen.cost:.0f} s for {decision.chosen.gain:.1f} m². "
         f"{decision.chosen.reason}"]
        for decision in exploration.log.decisions
        if decision.chosen is not None
    ]  # fmt: skip
    return {
        "low": low.tolist(), "high": high.tolist(), "levels": levels, "way": way, "decisions": decisions,
    }  # fmt: skip


def _image(png: bytes) -> str:
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(png).decode("ascii")}">'
