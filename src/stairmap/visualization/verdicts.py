"""The verdicts of robots and building codes as a picture: a cell for each stairway and robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from stairmap.export.verdicts import format_limit, format_measured, format_probability
from stairmap.navigation.codes import CodeCheck
from stairmap.navigation.limits import LimitCheck, Verdict
from stairmap.navigation.traversability import Assessment
from stairmap.stairway import Stairway
from stairmap.visualization.dimensions import BLUE, GREY, INK, ORANGE, plain_text
from stairmap.visualization.plots import make_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
else:
    Figure: TypeAlias = Any

_COLORS: dict[Verdict, str] = {"passable": BLUE, "impassable": ORANGE, "unknown": GREY}
_CELL_WIDTH, _CELL_HEIGHT, _NAME_WIDTH = 2.5, 0.62, 2.2


def draw_verdicts(
    stairways: Sequence[Stairway],
    assessments: Sequence[Assessment],
    code_checks: Sequence[CodeCheck] = (),
) -> Figure:
    """Draw a table: a column for each stairway, a row for each robot and code.

    A cell says the verdict in words and colour, its probability, and the measure that decides.

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    columns = {stairway.id: index for index, stairway in enumerate(stairways)}
    names = list(dict.fromkeys([a.robot for a in assessments] + [c.code_id for c in code_checks]))
    rows = {name: index for index, name in enumerate(names)}
    width = _NAME_WIDTH + _CELL_WIDTH * len(columns)
    height = _CELL_HEIGHT * (len(rows) + 1)
    figure = make_figure(width=width, height=height + 0.1)
    axes = figure.subplots()
    axes.set_xlim(0, width)
    axes.set_ylim(len(rows) * _CELL_HEIGHT, -_CELL_HEIGHT)
    axes.axis("off")
    for stairway in stairways:
        left = _NAME_WIDTH + columns[stairway.id] * _CELL_WIDTH
        flight = stairway.flights[0]
        title = f"stairway {stairway.id}\n{stairway.num_risers} risers of {flight.rise * 1e3:.0f} mm"
        axes.text(left + _CELL_WIDTH / 2, -_CELL_HEIGHT / 2, title, ha="center", va="center", color=INK)
    for name, row in rows.items():
        axes.text(0.12, (row + 0.5) * _CELL_HEIGHT, plain_text(name), va="center", color=INK)
    for assessment in assessments:
        place = (columns[assessment.stairway_id], rows[assessment.robot])
        _draw_cell(
            axes, place, assessment.verdict, assessment.verdict, assessment.probability, [assessment.limiting]
        )
    for check in code_checks:
        place = (columns[check.stairway_id], rows[check.code_id])
        decisive = [*check.broken, *check.undecided][:1]
        _draw_cell(axes, place, check.verdict, check.word, check.probability, decisive)
    return figure


def _draw_cell(
    axes: Any,
    place: tuple[int, int],
    verdict: Verdict,
    word: str,
    probability: tuple[float, float],
    decisive: Sequence[LimitCheck],
) -> None:
    left, top = _NAME_WIDTH + place[0] * _CELL_WIDTH, place[1] * _CELL_HEIGHT
    axes.fill(
        [left + 0.04, left + _CELL_WIDTH - 0.04, left + _CELL_WIDTH - 0.04, left + 0.04],
        [top + 0.04, top + 0.04, top + _CELL_HEIGHT - 0.04, top + _CELL_HEIGHT - 0.04],
        facecolor=_COLORS[verdict], edgecolor=_COLORS[verdict], alpha=0.22, linewidth=1.2,
    )  # fmt: skip
    middle = left + _CELL_WIDTH / 2
    text = f"{word}, P {format_probability(probability)}"
    axes.text(middle, top + 0.24, text, ha="center", va="center", fontsize=9, weight="bold", color=INK)
    for check in decisive:
        reason = f"{check.limit.measure} {format_measured(check)}, {format_limit(check)}"
        axes.text(middle, top + 0.46, reason, ha="center", va="center", fontsize=7.5, color=INK)
