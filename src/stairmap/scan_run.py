"""Write what a scan found into a run folder."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from stairmap.config import Config, dump_config
from stairmap.detection.observation import Detection
from stairmap.errors import MissingPackageError
from stairmap.export.results import RunFolder
from stairmap.export.scan_reference import SCAN_FILE, ScanReference
from stairmap.export.summary import counted, format_table
from stairmap.map_scan import MapScan, ScanResult
from stairmap.recordings.clouds.cloud import Cloud
from stairmap.visualization.scan_report import ScanReportData, render_scan_report

MAX_REPORT_POINTS = 3_000_000
"""Most points that the pictures of a report are drawn from."""


def write_scan_results(folder: RunFolder, result: ScanResult, clouds: Sequence[Cloud]) -> None:
    """Write everything but the report, most valuable first."""
    folder.release_reserve()
    folder.write_stairways(result.stairways, num_frames=len(clouds))
    detection = Detection(stamp_ns=0, observations=result.observations, rejections=result.rejections)
    folder.append_detection(detection)
    reference = ScanReference(
        paths=tuple(cloud.path.resolve() for cloud in clouds),
        map_from_file=result.map_from_file,
        num_points=result.num_points,
    )
    folder.write_text(SCAN_FILE, reference.to_json())
    folder.write_summary(_summary(result))
    folder.write_mesh(result.stairways)


def write_scan_report(
    folder: RunFolder, result: ScanResult, scan: MapScan, *, config: Config, facts: Mapping[str, str]
) -> str | None:
    """Write ``report.html``; return a sentence instead if a package for it is missing."""
    kept = scan.kept_points()
    kept = kept[:: max(len(kept) // MAX_REPORT_POINTS, 1)]
    data = ScanReportData(
        name=folder.path.name,
        stairways=result.stairways,
        points=kept.astype(np.float64) + scan.origin,
        num_points=result.num_points,
        notes=result.notes,
        reasons=describe_reasons(result),
        config_yaml=dump_config(config),
        facts=facts,
    )
    try:
        folder.write_report(render_scan_report(data))
    except MissingPackageError as error:
        return f"report.html was left out: {error}"
    return None


def describe_reasons(result: ScanResult) -> list[str]:
    """Return why candidates were refused, the commonest rule first, or that there were none."""
    if not result.rejections:
        if result.stairways:
            return []
        return ["nowhere in the map do three edges lie one above the other as those of stairs do"]
    counts = Counter(rejection.rule for rejection in result.rejections)
    first = {rejection.rule: rejection for rejection in reversed(result.rejections)}
    return [f"{counted(count, 'candidate')}: {first[rule]}" for rule, count in counts.most_common()]


def _summary(result: ScanResult) -> str:
    parts = [
        f"{result.num_points:,} points, {counted(len(result.observations), 'flight')} found\n",
        format_table(result.stairways),
    ]
    for title, lines in (
        ("about the map", result.notes),
        ("why other candidates are no flights", describe_reasons(result)),
    ):
        if lines:
            parts.append("\n".join([f"{title}:", *(f"  {line}" for line in lines)]) + "\n")
    return "\n".join(parts)
