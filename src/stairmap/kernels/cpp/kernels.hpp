// All kernels of the module; each is told in its twin, the Python function of the same name.
#pragma once

#include <algorithm>
#include <tuple>
#include <vector>

#include "arrays.hpp"

namespace stairmap {

nb::tuple trace_outline(nb::handle distances, nb::handle heights, const std::array<double, 6> &shape,
                        bool is_open, const std::array<double, 5> &limits);

nb::tuple predict_rays(nb::tuple outline, nb::handle slopes, const std::array<double, 8> &edges,
                       const std::array<int64_t, 3> &kinds, bool has_gradient);

nb::tuple fit_section(nb::tuple rays, nb::tuple start, nb::tuple prior, nb::tuple rounds, bool is_open,
                      const std::array<double, 8> &edges, const std::array<int64_t, 3> &kinds,
                      const std::array<double, 5> &section, const std::array<double, 12> &equations,
                      const std::tuple<double, int64_t, double, double, double, double, double, double, double, double,
                                       double, double, double, double> &limits);

nb::object sample_rays(nb::handle inverse_depth, nb::handle axes, nb::handle slope, nb::handle bearing,
                       const std::array<double, 6> &view);

nb::object sample_strips(nb::handle inverse_depth, nb::handle axes, nb::handle slope, nb::handle bearing,
                         const std::array<double, 6> &view,
                         const std::tuple<int64_t, double, int64_t, int64_t> &means);

nb::object sharpen_scans(nb::handle inverse_distance, nb::handle kernel, int64_t num_rounds, double min_share);

nb::tuple find_jumps(nb::handle inverse_distance, nb::handle slope, nb::handle jump_rows,
                     const std::tuple<double, double, double, double, int64_t, double, double> &limits);

nb::tuple find_creases(nb::handle inverse_distance, nb::handle slope,
                       const std::tuple<double, double, double, int64_t, int64_t, double, double, double, double,
                                        double, double, double> &limits);

nb::object find_edge_turns(nb::tuple corners, nb::handle bearing,
                           const std::tuple<int64_t, double, double, double, int64_t, double, int64_t, double> &limits,
                           int64_t max_turns);

nb::tuple join_corners(nb::tuple corners, int64_t num_strips,
                       const std::tuple<double, double, double, double, int64_t, int64_t> &limits);

nb::tuple search_lattices(nb::tuple nosings,
                          const std::tuple<double, double, double, double, double, double, int64_t, int64_t, double,
                                           double, double, double, double, int64_t, int64_t, double, int64_t> &limits,
                          int64_t max_lattices);

nb::object reduce_depth(nb::handle depth, int64_t stride, const std::array<double, 3> &limits);

nb::object measure_jumps(nb::handle inverse_depth, const std::tuple<int64_t, int64_t, int64_t, double, double> &shape);

nb::tuple fit_window_planes(nb::handle inverse_depth,
                            const std::tuple<int64_t, int64_t, double, double, double, double, double, double,
                                             double, double> &windows);

nb::tuple sum_normals(nb::handle normals, nb::handle residual, nb::handle is_inner, nb::handle axis,
                      const std::array<double, 3> &limits);

nb::tuple count_floor_cells(nb::handle normals, nb::handle points, double min_down, double min_distance,
                            int64_t num_cells);

nb::tuple find_facing(nb::handle normals, nb::handle points, nb::handle axes,
                      const std::tuple<double, int64_t, int64_t, int64_t, double, double, double, int64_t, int64_t>
                          &limits);

nb::tuple find_row_ends(nb::handle cells, nb::tuple rays, nb::tuple table, nb::tuple steps,
                        const std::tuple<double, double, double, double, int64_t, double, double, double, double,
                                         double, int64_t, double> &limits);

nb::tuple turn_rays(nb::tuple rays, double tilt, double roll, double turn);

nb::object sum_risers(nb::tuple rays, nb::handle nosings, const std::array<double, 7> &limits);

nb::tuple count_steps(nb::tuple rays, nb::tuple places, double rise, const std::array<double, 6> &shape, bool is_open,
                      const std::array<double, 8> &edges, const std::array<int64_t, 3> &kinds,
                      const std::array<double, 5> &section,
                      const std::tuple<double, double, double, double, double, double, int64_t, double, double, double,
                                       double, double> &limits);

nb::tuple compare_with_line(nb::tuple rays, nb::tuple table,
                            const std::tuple<double, double, double, double, double, double, double, int64_t,
                                             int64_t, double> &limits);

nb::tuple fit_ground(nb::handle inverse_depth, nb::handle axes, nb::handle slope, nb::handle bearing,
                     const std::array<double, 5> &camera,
                     const std::tuple<double, double, double, int64_t, bool, double, int64_t, int64_t, double, double,
                                      double, double, double, double, double, double, int64_t, double> &limits);

nb::tuple find_ledges(nb::handle crossing, nb::handle height, double camera_height,
                      const std::tuple<double, double, double, double, double, double, int64_t, int64_t, int64_t,
                                       int64_t, int64_t, double, double, int64_t, double, double, double> &limits);

// The median of values, which are put in another order; 0 without any.
inline double median_of(std::vector<double> &values) {
    if (values.empty()) return 0.0;
    const size_t middle = values.size() / 2;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(middle), values.end());
    const double upper = values[middle];
    if (values.size() % 2) return upper;
    return 0.5 * (*std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(middle)) + upper);
}

// Refuses numbers of strips that there are not.
inline void check_strips(const Input<int64_t, 1> &strip, const char *name, size_t num_strips) {
    for (size_t i = 0; i < strip.size(); ++i)
        if (strip[i] < 0 || static_cast<uint64_t>(strip[i]) >= num_strips)
            refuse(std::string(name) + ": expected strips below " + std::to_string(num_strips) + ", got others");
}

}  // namespace stairmap
