"""``stairmap clean``: a map of points with exact stairs."""

from __future__ import annotations

import typer

from stairmap.cli.progress import PointProgress
from stairmap.cli.requests import CleanRequest
from stairmap.cli.scan import check_scan_up
from stairmap.errors import OutputError, ResultsError
from stairmap.export.cloud_cleaning import SUFFIXES, write_clean_cloud
from stairmap.export.loading import load_stairways
from stairmap.export.scan_reference import load_scan_reference
from stairmap.export.summary import counted
from stairmap.input_files import shown
from stairmap.map_scan import MapScan
from stairmap.output_files import check_new_file
from stairmap.recordings.clouds.open import open_cloud


def clean_map(request: CleanRequest) -> int:
    """Write a map with exact stairs; return the exit code.

    Raises
    ------
    StairmapError
        If a file cannot be read or written, or there is no stairway to put into the map.
    """
    if request.output.suffix.lower() not in SUFFIXES:
        raise OutputError(f"expected --output to end in {' or '.join(SUFFIXES)}, got {shown(request.output)}")
    check_new_file(request.output, option="--output")
    clouds = [open_cloud(path) for path in request.files]
    if request.run is None:
        scan = MapScan(clouds, up=check_scan_up(request.up))
        with PointProgress(scan.num_points) as progress:
            scan.read(on_points=progress.advance)
        result = scan.find_stairways()
        for note in result.notes:
            typer.echo(note, err=True)
        stairways, map_from_file = result.stairways, result.map_from_file
    else:
        reference = load_scan_reference(request.run)
        if reference is None:
            raise ResultsError(
                f"expected --run to be the folder of a scan, but {shown(request.run)} is not one"
            )
        stairways, map_from_file = load_stairways(request.run).stairways, reference.map_from_file
    if not stairways:
        raise ResultsError("no stairway was found in the map, so there is nothing to clean")
    counts = [cloud.num_points for cloud in clouds]
    known = [count for count in counts if count is not None]
    with PointProgress(sum(known) if len(known) == len(counts) else None) as progress:
        removed, added = write_clean_cloud(
            request.output, clouds, map_from_file, stairways, on_points=progress.advance
        )
    typer.echo(
        f"{counted(len(stairways), 'stairway')}: {removed:,} points taken away, "
        f"{added:,} exact ones put there"
    )
    typer.echo(str(request.output))
    return 0
