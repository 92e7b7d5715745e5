"""The report of a scan: one HTML page with everything in it."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import stairmap
from stairmap.arrays import Points
from stairmap.errors import MissingPackageError
from stairmap.export.summary import COLUMNS, stairway_rows
from stairmap.input_files import shown
from stairmap.stairway import Stairway
from stairmap.visualization.cloud_pictures import draw_map, draw_stairway_in_cloud, draw_view
from stairmap.visualization.plots import png_from_figure

_TEMPLATE = Path(__file__).with_name("scan_report.html.jinja")
_STYLE_SOURCE = Path(__file__).with_name("report.html.jinja")

MAX_PICTURED = 30
"""Most stairways that get pictures of their own: a report of a whole campus must open in a browser."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanReportData:
    """What the report of a scan shows.

    Attributes
    ----------
    name
        Name of the map.
    stairways
        What was found.
    points
        (N, 3) points of the map, m.
    num_points
        How many points were read.
    notes, reasons
        What was found out about the files, and why candidates were refused, a sentence each.
    config_yaml
        The resolved configuration.
    facts
        Where it comes from, by name: date, recording, command.
    """

    name: str
    stairways: tuple[Stairway, ...]
    points: Points
    num_points: int
    notes: Sequence[str] = ()
    reasons: Sequence[str] = ()
    config_yaml: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)


def render_scan_report(data: ScanReportData) -> str:
    """Return the report as one HTML page.

    Raises
    ------
    MissingPackageError
        If jinja2 or matplotlib is not installed.
    """
    try:
        import jinja2  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("jinja2", "report", "writing report.html") from error
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    template = environment.from_string(_TEMPLATE.read_text(encoding="utf-8"))
    return template.render(
        title=shown(data.name),
        style=_style(),
        version=stairmap.__version__,
        facts={name: shown(text) for name, text in data.facts.items()},
        num_stairways=len(data.stairways),
        num_flights=sum(len(stairway.flights) for stairway in data.stairways),
        num_points=_short(data.num_points),
        notes=[shown(note) for note in data.notes],
        reasons=list(data.reasons),
        columns=COLUMNS,
        rows=[row.cells() for row in stairway_rows(data.stairways)],
        overview=_data_uri(png_from_figure(draw_map(data.points, data.stairways))),
        stairways=[
            {
                "id": stairway.id,
                "drawing": _data_uri(png_from_figure(draw_stairway_in_cloud(stairway, data.points))),
                "view": _data_uri(png_from_figure(draw_view(stairway, data.points))),
            }
            for stairway in data.stairways[:MAX_PICTURED]
        ],
        config_yaml=data.config_yaml,
    )


def _style() -> str:
    """The style sheet that both reports share."""
    return _STYLE_SOURCE.read_text(encoding="utf-8").partition("<style>")[2].partition("</style>")[0]


def _short(number: int) -> str:
    return f"{number / 1e6:.1f} million" if number >= 1_000_000 else f"{number:,}"


def _data_uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")
