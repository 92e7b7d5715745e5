"""Dimension lines and labels on a drawing, and the colours of all drawings.

The colours are Okabe and Ito's (2008), which stay apart for every kind of colour blindness; what
they mean is also said by line style or shape, for print in grey. Everything here draws onto axes that
it is given, so nothing imports matplotlib.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from stairmap.input_files import shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
else:
    Axes: TypeAlias = Any

INK = "#222222"
GREY = "#808080"
BLUE = "#0072B2"
ORANGE = "#D55E00"
GREEN = "#009E73"
PURPLE = "#9A4F83"
RED = "#B2182B"
"""Okabe and Ito's reddish purple, darkened so that text in it can be read."""

_LABEL = "label"
"""Marks the texts that may be moved apart."""

_LABEL_GAP = 3.0
"""Free space between two labels, px."""

_MAX_MOVES = 20
"""How often a label is moved to find a free place."""

_HALO = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}


def draw_dimension(
    axes: Axes,
    start: ArrayLike,
    stop: ArrayLike,
    text: str,
    *,
    extend_from: Sequence[ArrayLike] = (),
    text_side: Literal["along", "left", "right"] = "along",
) -> None:
    """Draw a dimension line with arrows at both ends and its measure beside it.

    Parameters
    ----------
    axes
        Matplotlib axes of equal scales.
    start, stop
        (2,) ends of the line, in data units.
    text
        The measure, with its unit.
    extend_from
        Points of the object that thin lines join to ``start`` and ``stop``.
    text_side
        ``along`` turns the text with the line; ``left`` and ``right`` put it level beside its middle
        or, for a level line, beside its end.
    """
    first, last = np.asarray(start, dtype=np.float64), np.asarray(stop, dtype=np.float64)
    for origin, end in zip(extend_from, (first, last), strict=False):
        corners = np.array([origin, end])
        axes.plot(corners[:, 0], corners[:, 1], color=INK, linewidth=0.6, zorder=5)
    arrow = {"arrowstyle": "<|-|>", "color": INK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    arrow["mutation_scale"] = 8
    axes.annotate("", tuple(last), tuple(first), arrowprops=arrow, zorder=6)
    if text_side == "along":
        angle = float(np.degrees(np.arctan2(last[1] - first[1], last[0] - first[0])))
        outward = np.array([first[1] - last[1], last[0] - first[0]]) / max(np.linalg.norm(last - first), 1e-9)
        if len(extend_from) and outward @ (first - np.asarray(extend_from[0])) < 0:
            outward = -outward
        axes.annotate(
            text, tuple((first + last) / 2), xytext=tuple(9 * outward), textcoords="offset points",
            rotation=(angle + 90) % 180 - 90, rotation_mode="anchor", ha="center", va="center",
            fontsize=10, color=INK, zorder=7,
        )  # fmt: skip
        return
    level = abs(last[1] - first[1]) < abs(last[0] - first[0])
    anchor = max(first[0], last[0]) if text_side == "right" else min(first[0], last[0])
    position = (anchor, first[1]) if level else (first + last) / 2
    sign = 1 if text_side == "right" else -1
    axes.annotate(
        text, tuple(position), xytext=(6 * sign, 0), textcoords="offset points", va="center",
        ha="left" if sign > 0 else "right", fontsize=10, color=INK, zorder=7,
    )  # fmt: skip


def plain_text(name: str) -> str:
    """Return a name for a drawing: control characters escaped, and dollars that begin no formula."""
    return shown(name).replace("$", r"\$")


def separate_labels(figure: Any) -> None:
    """Move the labels of ``draw_label`` apart where they overlap, downward, the first ones staying."""
    labels = [text for axes in figure.axes for text in axes.texts if text.get_gid() == _LABEL]
    if len(labels) < 2:
        return
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    placed: list[Any] = []
    for label in labels:
        for _ in range(_MAX_MOVES):
            box = label.get_window_extent()
            hit = next((other for other in placed if box.overlaps(other)), None)
            if hit is None:
                break
            x, y = label.axes.transData.transform(label.get_position())
            moved = (x, y - (box.y1 - hit.y0) - _LABEL_GAP)
            label.set_position(tuple(label.axes.transData.inverted().transform(moved)))
        placed.append(label.get_window_extent())


def draw_label(axes: Axes, position: ArrayLike, text: str, *, color: str = INK) -> None:
    """Write a short text on a white ground, centred at (2,) data units."""
    x, y = np.asarray(position, dtype=np.float64)
    axes.text(x, y, text, ha="center", va="center", fontsize=9, color=color, bbox=_HALO, zorder=8, gid=_LABEL)


def finish_axes(axes: Axes) -> None:
    """Give axes the grid and the frame that all drawings share."""
    axes.grid(color=GREY, alpha=0.25, linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_axisbelow(True)
