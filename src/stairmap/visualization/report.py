"""``report.html``: one file that shows a whole run, every picture inside, nothing loaded from elsewhere.

It needs jinja2 and matplotlib (extra ``report``). jinja2 is imported nowhere else.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import stairmap
from stairmap.arrays import Points
from stairmap.drop import Drop
from stairmap.errors import MissingPackageError
from stairmap.export.summary import COLUMNS, stairway_rows, with_std
from stairmap.input_files import shown
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap.visualization.collecting import ExampleFrame, ReportCollector, RuleStatistics, TracingDetector
from stairmap.visualization.convergence import MEASURES, ConvergenceSample
from stairmap.visualization.plots import draw_convergence, draw_overview, draw_stairway, png_from_figure

_TEMPLATE = Path(__file__).with_name("report.html.jinja")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportData:
    """Everything that the report shows; ``report_data`` fills it from a ``ReportCollector``.

    Attributes
    ----------
    recording_name, method
        What was run, for the title.
    num_frames, num_detections
        Number of frames looked at, and of those in which stair edges were seen.
    stairways
        The stairways found.
    trajectory
        Poses of the camera; ``None`` without.
    observed_nosings
        (N, 2, 3) nosings seen in single frames, map, m.
    convergence
        Samples of each stairway, by its id.
    references
        True measures (keys ``rise, run, width, pitch``; m, rad) by id, where they are known.
    examples
        Frames to show.
    rules
        Why frames had no stair edges.
    config_yaml
        The resolved configuration.
    problems
        What was wrong with the recording, one line each.
    facts
        Where it comes from, by name: date, recording, command.
    drops
        Where the ground ends and goes on lower.
    """

    recording_name: str
    method: str
    num_frames: int
    num_detections: int
    stairways: tuple[Stairway, ...]
    trajectory: Trajectory | None
    observed_nosings: Points
    convergence: Mapping[int, Sequence[ConvergenceSample]] = field(default_factory=dict)
    references: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    examples: tuple[ExampleFrame, ...] = ()
    rules: tuple[RuleStatistics, ...] = ()
    config_yaml: str = ""
    problems: tuple[str, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    drops: tuple[Drop, ...] = ()


def report_data(
    collector: ReportCollector,
    *,
    recording_name: str,
    method: str,
    stairways: Sequence[Stairway],
    trajectory: Trajectory | None,
    config_yaml: str,
    problems: Sequence[str] = (),
    references: Mapping[int, Mapping[str, float]] | None = None,
    detector: TracingDetector | None = None,
    facts: Mapping[str, str] | None = None,
    drops: Sequence[Drop] = (),
) -> ReportData:
    """Gather what the report shows; see ``ReportData`` and ``ReportCollector``."""
    for stairway in stairways:
        collector.convergence.add_stairway(stairway)
    return ReportData(
        recording_name=recording_name,
        method=method,
        num_frames=collector.num_frames,
        num_detections=collector.num_detections,
        stairways=tuple(stairways),
        trajectory=trajectory,
        observed_nosings=collector.observed_nosings(),
        convergence={stairway.id: collector.convergence.samples(stairway.id) for stairway in stairways},
        references=references or {},
        examples=collector.example_frames(detector),
        rules=collector.rule_statistics(),
        config_yaml=config_yaml,
        problems=tuple(problems),
        facts=facts or {},
        drops=tuple(drops),
    )


def render_report(data: ReportData) -> str:
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
        data=data,
        facts={name: shown(text) for name, text in data.facts.items()},
        title=shown(data.recording_name),
        version=stairmap.__version__,
        columns=COLUMNS,
        rows=[row.cells() for row in stairway_rows(data.stairways)],
        overview=_overview(data),
        stairways=[_stairway_pictures(data, stairway) for stairway in data.stairways],
        examples=[_example_pictures(example) for example in data.examples],
        rules=[_rule_cells(rule, data) for rule in data.rules],
        num_without=data.num_frames - data.num_detections,
    )


def _overview(data: ReportData) -> str | None:
    if not data.stairways and not data.drops and data.trajectory is None:
        return None
    figure = draw_overview(
        data.stairways, positions=_positions(data), observed_nosings=data.observed_nosings, drops=data.drops
    )
    return _data_uri(png_from_figure(figure))


def _stairway_pictures(data: ReportData, stairway: Stairway) -> dict[str, Any]:
    drawing = draw_stairway(stairway, positions=_positions(data), observed_nosings=data.observed_nosings)
    samples = data.convergence.get(stairway.id, ())
    convergence = None
    if len(samples) > 1:
        truth = data.references.get(stairway.id)
        reference = truth or {name: float(getattr(stairway.flights[0], name)) for name in MEASURES}
        name = "true value" if truth else "final value"
        convergence = _data_uri(
            png_from_figure(draw_convergence(samples, reference=reference, reference_name=name))
        )
    return {
        "stairway": stairway,
        "drawing": _data_uri(png_from_figure(drawing)),
        "convergence": convergence,
        "comparison": _comparison(data, stairway),
    }


def _comparison(data: ReportData, stairway: Stairway) -> list[tuple[str, str, str, str]]:
    """Measure, true value, estimate and error of the first flight, where the truth is known."""
    truth = data.references.get(stairway.id)
    if truth is None:
        return []
    flight, rows = stairway.flights[0], []
    for name in MEASURES:
        factor, unit, digits = (180 / np.pi, "deg", 1) if name == "pitch" else (1e3, "mm", 0)
        true, estimate = truth[name] * factor, float(getattr(flight, name)) * factor
        std = float(getattr(flight.std, name)) * factor
        rows.append(
            (
                f"{name}, {unit}",
                f"{true:.{digits}f}",
                with_std(estimate, std, digits=digits),
                f"{estimate - true:+.1f}",
            )
        )
    return rows


def _example_pictures(example: ExampleFrame) -> dict[str, Any]:
    return {
        "title": f"frame {example.frame_index}, {example.stamp_ns * 1e-9:.3f} s",
        "detected": example.detected,
        "overlay": _data_uri(example.overlay_png),
        "trace": None if example.trace_png is None else _data_uri(example.trace_png),
    }


def _rule_cells(rule: RuleStatistics, data: ReportData) -> dict[str, Any]:
    unit = "" if rule.unit == "1" else f" {rule.unit}"
    num_without = max(data.num_frames - data.num_detections, 1)
    return {
        "rule": rule.rule,
        "num_frames": rule.num_frames,
        "percent": 100 * rule.num_frames / num_without,
        "measured": "nothing" if np.isnan(rule.measured) else f"{rule.measured:.3g}{unit}",
        "limit": f"{rule.limit:.3g}{unit}",
    }


def _positions(data: ReportData) -> Points | None:
    return None if data.trajectory is None else data.trajectory.map_from_camera[:, :3, 3]


def _data_uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")
