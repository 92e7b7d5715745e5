"""``batch.html``: a batch on one page, outliers first, then failures, then how the measures are distributed.

One file without anything from elsewhere, and without a package beyond numpy.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from html import escape

import numpy as np

import stairmap
from stairmap.arrays import Float64Array
from stairmap.batch.histogram import histogram_svg
from stairmap.batch.table import VERDICT_PREFIX, Row
from stairmap.input_files import shown

PAGE_FILE = "batch.html"

SHOWN_MEASURES = {
    "rise": (1e3, "mm"),
    "run": (1e3, "mm"),
    "width": (1e3, "mm"),
    "pitch": (180 / np.pi, "deg"),
}
"""Factor and unit by which people read them."""

MAX_OUTLIERS, MAX_FAILURES = 30, 100
"""Most rows of these tables: whoever needs all has ``batch.csv``."""

MIN_DEVIATIONS = 3.5
"""A flight is an outlier when a measure is this many robust standard deviations from the median of all."""

MIN_SPREAD = {"rise": 5e-3, "run": 5e-3, "width": 30e-3, "pitch": np.radians(1.0)}
"""Smallest robust standard deviation that counts, m and rad: what measuring itself scatters."""

_STYLE = """
:root { color-scheme: light dark; --ink: #1b1f24; --paper: #fff; --faint: #d0d7de; --bar: #0072b2; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6edf3; --paper: #0d1117; --faint: #30363d; --bar: #56b4e9; }
}
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); margin: 2rem auto;
  max-width: 70rem; padding: 0 1rem; }
table { border-collapse: collapse; display: block; overflow-x: auto; margin-bottom: 1.5rem; }
th, td { text-align: right; padding: .2rem .8rem; border-bottom: 1px solid var(--faint);
  white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
td.text { text-align: left; white-space: normal; }
.plots { display: flex; flex-wrap: wrap; gap: 1.5rem; }
svg text { fill: var(--ink); font-size: 12px; } svg rect { fill: var(--bar); }
svg line { stroke: var(--faint); }
"""


class SummaryPage:
    """Gathers what the page shows while rows go by.

    Parameters
    ----------
    title
        Of the batch.
    names
        The columns of the rows.
    """

    def __init__(self, title: str, names: Sequence[str]) -> None:
        self._title = title
        self._robots = [name for name in names if name.startswith(VERDICT_PREFIX)]
        self._values = {name: array("d") for name in SHOWN_MEASURES}
        self._flights: list[tuple[str, int, int]] = []
        self._verdicts = {name: Counter[str]() for name in self._robots}
        self._reasons: Counter[str] = Counter()
        self._failures: list[tuple[str, str]] = []
        self._num_recordings = self._num_empty = 0
        self._latest = ""

    def watch(self, rows: Iterable[Row]) -> Iterator[Row]:
        """Pass rows on and note what the page shows of them."""
        for row in rows:
            self._note(row)
            yield row

    def _note(self, row: Row) -> None:
        self._num_recordings += row["recording"] != self._latest
        self._latest = row["recording"]
        if row["error"]:
            self._reasons[_kind_of(row["error"], row["recording"])] += 1
            if len(self._failures) < MAX_FAILURES:
                self._failures.append((row["recording"], row["error"]))
        elif row["stairway"] is None:
            self._num_empty += 1
        else:
            self._flights.append((row["recording"], row["stairway"], row["flight"]))
            for name, values in self._values.items():
                values.append(row[name])
            if row["flight"] == 1:
                for robot in self._robots:
                    self._verdicts[robot][row[robot]] += 1

    def render(self) -> str:
        """Return the page."""
        parts = [
            f"<h1>{escape(shown(self._title))}</h1>",
            f"<p>{self._num_recordings:,} recordings, {len(self._flights):,} flights; "
            f"{self._num_empty:,} recordings without stairs, {sum(self._reasons.values()):,} failures. "
            "All rows: batch.csv, batch.parquet.</p>",
            *self._outliers(),
            *self._failure_tables(),
            *self._distributions(),
            f"<p>stairmap {escape(stairmap.__version__)}</p>",
        ]
        head = (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{escape(shown(self._title))}</title><style>{_STYLE}</style></head><body>"
        )
        return head + "\n".join(parts) + "</body></html>\n"

    def _outliers(self) -> Iterator[str]:
        if not self._flights:
            return
        measures = {name: np.array(values) for name, values in self._values.items()}
        deviations = {name: robust_deviations(values, MIN_SPREAD[name]) for name, values in measures.items()}
        table = np.abs(np.array(list(deviations.values())))
        worst = table.max(axis=0)
        order = np.argsort(-worst, kind="stable")[:MAX_OUTLIERS]
        order = order[worst[order] >= MIN_DEVIATIONS]
        yield "<h2>Outliers</h2>"
        if not len(order):
            yield f"<p>No measure is {MIN_DEVIATIONS:g} robust standard deviations from its median.</p>"
            return
        yield (
            f"<p>Flights with a measure {MIN_DEVIATIONS:g} or more robust standard deviations from the "
            "median of all; in brackets how many.</p>"
        )
        rows = []
        for index in order.tolist():
            recording, stairway, flight = self._flights[index]
            cells = [escape(shown(recording)), str(stairway), str(flight)]
            for name, (factor, _) in SHOWN_MEASURES.items():
                off = deviations[name][index]
                text = f"{measures[name][index] * factor:.{int(name == 'pitch')}f}"
                cells.append(f"<b>{text}</b> ({off:+.1f})" if abs(off) >= MIN_DEVIATIONS else text)
            rows.append(cells)
        units = [f"{name} {unit}" for name, (_, unit) in SHOWN_MEASURES.items()]
        yield _table(["recording", "stairway", "flight", *units], rows)

    def _failure_tables(self) -> Iterator[str]:
        if not self._reasons:
            return
        yield "<h2>Failures</h2>"
        yield _table(
            ["reason", "recordings"], [[escape(r), f"{n:,}"] for r, n in self._reasons.most_common(20)]
        )
        yield _table(
            ["recording", "error"],
            [[escape(shown(name)), escape(shown(error))] for name, error in self._failures],
            text_column=1,
        )

    def _distributions(self) -> Iterator[str]:
        if not self._flights:
            return
        yield '<h2>Distributions</h2><div class="plots">'
        for name, (factor, unit) in SHOWN_MEASURES.items():
            yield histogram_svg(np.array(self._values[name]) * factor, name=name, unit=unit)
        yield "</div>"
        if self._robots:
            verdicts = ("passable", "unknown", "impassable")
            rows = [
                [
                    escape(robot.removeprefix(VERDICT_PREFIX)),
                    *(f"{self._verdicts[robot][v]:,}" for v in verdicts),
                ]
                for robot in self._robots
            ]
            yield "<h2>Verdicts</h2>" + _table(
                ["robot", *(f"{verdict}, stairways" for verdict in verdicts)], rows
            )


def robust_deviations(values: Float64Array, min_spread: float) -> Float64Array:
    """Return how far values are from their median, in robust standard deviations (1.4826 times the MAD)."""
    off = values - np.median(values)
    return np.asarray(off / max(1.4826 * float(np.median(np.abs(off))), min_spread))


def _kind_of(error: str, recording: str) -> str:
    """The reason without what is only of this recording, so that like ones are counted together."""
    short = error.replace(recording, "…")
    return short if len(short) <= 100 else short[:99] + "…"


def _table(headers: Sequence[str], rows: Iterable[Sequence[str]], *, text_column: int | None = None) -> str:
    head = "".join(f"<th>{escape(header)}</th>" for header in headers)
    body = "".join(
        "<tr>"
        + "".join(
            f"<td{' class=text' if index == text_column else ''}>{cell}</td>"
            for index, cell in enumerate(row)
        )
        + "</tr>"
        for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"
