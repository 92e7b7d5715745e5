// The extension module stairmap.kernels._compiled.
#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>

#include "kernels.hpp"

using namespace nb::literals;

NB_MODULE(_compiled, module) {
    module.attr("SOURCE_SUM") = SOURCE_SUM;
    module.def("trace_outline", &stairmap::trace_outline, "distances"_a, "heights"_a, "shape"_a, "is_open"_a,
               "limits"_a);
    module.def("predict_rays", &stairmap::predict_rays, "outline"_a, "slopes"_a, "edges"_a, "kinds"_a,
               "has_gradient"_a);
    module.def("fit_section", &stairmap::fit_section, "rays"_a, "start"_a, "prior"_a, "rounds"_a, "is_open"_a,
               "edges"_a, "kinds"_a, "section"_a, "equations"_a, "limits"_a);
    module.def("sample_rays", &stairmap::sample_rays, "inverse_depth"_a, "axes"_a, "slope"_a, "bearing"_a, "view"_a);
    module.def("sample_strips", &stairmap::sample_strips, "inverse_depth"_a, "axes"_a, "slope"_a, "bearing"_a,
               "view"_a, "means"_a);
    module.def("sharpen_scans", &stairmap::sharpen_scans, "inverse_distance"_a, "kernel"_a, "num_rounds"_a,
               "min_share"_a);
    module.def("find_jumps", &stairmap::find_jumps, "inverse_distance"_a, "slope"_a, "jump_rows"_a, "limits"_a);
    module.def("find_creases", &stairmap::find_creases, "inverse_distance"_a, "slope"_a, "limits"_a);
    module.def("find_edge_turns", &stairmap::find_edge_turns, "corners"_a, "bearing"_a, "limits"_a, "max_turns"_a);
    module.def("join_corners", &stairmap::join_corners, "corners"_a, "num_strips"_a, "limits"_a);
    module.def("search_lattices", &stairmap::search_lattices, "nosings"_a, "limits"_a, "max_lattices"_a);
    module.def("reduce_depth", &stairmap::reduce_depth, "depth"_a, "stride"_a, "limits"_a);
    module.def("measure_jumps", &stairmap::measure_jumps, "inverse_depth"_a, "shape"_a);
    module.def("fit_window_planes", &stairmap::fit_window_planes, "inverse_depth"_a, "windows"_a);
    module.def("sum_normals", &stairmap::sum_normals, "normals"_a, "residual"_a, "is_inner"_a, "axis"_a, "limits"_a);
    module.def("count_floor_cells", &stairmap::count_floor_cells, "normals"_a, "points"_a, "min_down"_a,
               "min_distance"_a, "num_cells"_a);
    module.def("find_facing", &stairmap::find_facing, "normals"_a, "points"_a, "axes"_a, "limits"_a);
    module.def("find_row_ends", &stairmap::find_row_ends, "cells"_a, "rays"_a, "table"_a, "steps"_a, "limits"_a);
    module.def("turn_rays", &stairmap::turn_rays, "rays"_a, "tilt"_a, "roll"_a, "turn"_a);
    module.def("sum_risers", &stairmap::sum_risers, "rays"_a, "nosings"_a, "limits"_a);
    module.def("count_steps", &stairmap::count_steps, "rays"_a, "places"_a, "rise"_a, "shape"_a, "is_open"_a, "edges"_a,
               "kinds"_a, "section"_a, "limits"_a);
    module.def("compare_with_line", &stairmap::compare_with_line, "rays"_a, "table"_a, "limits"_a);
    module.def("fit_ground", &stairmap::fit_ground, "inverse_depth"_a, "axes"_a, "slope"_a, "bearing"_a, "camera"_a,
               "limits"_a);
    module.def("find_ledges", &stairmap::find_ledges, "crossing"_a, "height"_a, "camera_height"_a, "limits"_a);
}
