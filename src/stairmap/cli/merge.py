"""``stairmap merge``: the runs of one site as one map."""

from __future__ import annotations

import json
import math
from pathlib import Path

import typer

from stairmap.cli.exits import warn
from stairmap.cli.plain_table import format_columns
from stairmap.cli.requests import MergeRequest
from stairmap.errors import MergeError
from stairmap.export.results import create_run_folder, null_for_nan
from stairmap.export.summary import counted, format_table
from stairmap.merging.alignment import SiteAlignment, find_alignment
from stairmap.merging.alignment_file import load_alignment
from stairmap.merging.merged_folder import load_merge_input, write_merged_map
from stairmap.merging.merged_map import MergedMap, MergeInput, merge_runs, sightings_of

AUTO = "auto"


def merge_run_folders(request: MergeRequest) -> int:
    """Make one map of several runs, write its folder, print its table; return the exit code.

    Raises
    ------
    StairmapError
        If a run cannot be read, the runs cannot be aligned, or the folder cannot be written.
    """
    inputs = [load_merge_input(run) for run in request.runs]
    names = [given.name for given in inputs]
    if len(set(names)) < len(names):
        double = next(name for name in names if names.count(name) > 1)
        raise MergeError(f"two runs are called {double}; rename a folder: the alignment names them")
    if request.alignment == AUTO:
        sightings = [sightings_of(number, given.stairways) for number, given in enumerate(inputs)]
        alignment = find_alignment(sightings, names, [given.floors for given in inputs])
    else:
        alignment = load_alignment(Path(request.alignment), names)
    for pair in alignment.pairs:
        if pair.num_common == 1:
            warn(
                f"{names[pair.first]} and {names[pair.second]} are joined by one flight alone; look whether "
                "it is the same one"
            )
    merged = merge_runs(inputs, alignment)
    with create_run_folder(request.output, "merged") as folder:
        if request.as_json:
            typer.echo(_format_json(str(folder.path), merged, names, alignment))
        else:
            typer.echo(_format_text(str(folder.path), merged, inputs, alignment))
        write_merged_map(folder, merged, inputs, alignment)
    return 0


def _format_text(path: str, merged: MergedMap, inputs: list[MergeInput], alignment: SiteAlignment) -> str:
    rows = []
    for given, transform in zip(inputs, alignment.site_from_run, strict=True):
        yaw = math.degrees(math.atan2(transform[1, 0], transform[0, 0]))
        place = ", ".join(f"{value:.2f}" for value in transform[:3, 3])
        rows.append((given.name, str(len(given.stairways)), place, f"{yaw:.1f}"))
    header = ("run", "stairways", "x, y, z in the site m", "turned by deg")
    return "\n".join(
        [
            f"{counted(len(inputs), 'run')}, {counted(len(merged.stairways), 'stairway')} in the site",
            "",
            format_columns(header, rows, left_aligned=("run",)),
            "",
            format_table(merged.stairways).rstrip("\n"),
            "",
            path,
        ]
    )


def _format_json(path: str, merged: MergedMap, names: list[str], alignment: SiteAlignment) -> str:
    values = {
        "output": path,
        "site_from_run": {
            name: transform.tolist() for name, transform in zip(names, alignment.site_from_run, strict=True)
        },
        "stairways": [
            {
                **stairway.to_dict(),
                "observed_by": [source.to_dict() for source in merged.sources[stairway.id]],
            }
            for stairway in merged.stairways
        ],
    }
    return json.dumps(null_for_nan(values), indent=1, allow_nan=False)
