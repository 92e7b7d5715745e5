"""The few inner loops that cost time, each in NumPy and in C++.

The NumPy twin is the reference, the test's oracle, and what runs where nothing was compiled. A kernel holds
no method, no decision and no constant of the method: those are its arguments.
"""

from __future__ import annotations

from stairmap.kernels import (
    corners,
    counts,
    grounds,
    images,
    lattices,
    normals,
    outlines,
    planes,
    predictions,
    row_ends,
    sampling,
    section_fits,
    step_counts,
)
from stairmap.kernels.choice import VARIANT, chosen, describe_kernels

__all__ = [
    "VARIANT",
    "compare_with_line",
    "count_floor_cells",
    "count_steps",
    "describe_kernels",
    "find_creases",
    "find_edge_turns",
    "find_facing",
    "find_jumps",
    "find_ledges",
    "find_row_ends",
    "fit_ground",
    "fit_section",
    "fit_window_planes",
    "join_corners",
    "measure_jumps",
    "predict_rays",
    "reduce_depth",
    "sample_rays",
    "sample_strips",
    "search_lattices",
    "sharpen_scans",
    "sum_normals",
    "sum_risers",
    "trace_outline",
    "turn_rays",
]

reduce_depth = chosen(images.reduce_depth)
measure_jumps = chosen(images.measure_jumps)
fit_window_planes = chosen(planes.fit_window_planes)
sum_normals = chosen(normals.sum_normals)
count_floor_cells = chosen(normals.count_floor_cells)
find_facing = chosen(normals.find_facing)
sample_rays = chosen(sampling.sample_rays)
sample_strips = chosen(sampling.sample_strips)
find_jumps = chosen(corners.find_jumps)
find_creases = chosen(corners.find_creases)
find_edge_turns = chosen(corners.find_edge_turns)
join_corners = chosen(lattices.join_corners)
search_lattices = chosen(lattices.search_lattices)
trace_outline = chosen(outlines.trace_outline)
predict_rays = chosen(predictions.predict_rays)
turn_rays = chosen(counts.turn_rays)
count_steps = chosen(step_counts.count_steps)
compare_with_line = chosen(counts.compare_with_line)
find_row_ends = chosen(row_ends.find_row_ends)
fit_ground = chosen(grounds.fit_ground)
find_ledges = chosen(grounds.find_ledges)
fit_section = chosen(section_fits.fit_section)
sharpen_scans = chosen(sampling.sharpen_scans)
sum_risers = chosen(counts.sum_risers)
