// All kernels of the module; each is told in its twin, the Python function of the same name.
#pragma once

#include "arrays.hpp"

namespace stairmap {

nb::tuple trace_outline(nb::handle distances, nb::handle heights, const std::array<double, 6> &shape,
                        bool is_open, const std::array<double, 5> &limits);

nb::tuple predict_rays(nb::tuple outline, nb::handle slopes, const std::array<double, 8> &edges,
                       const std::array<int64_t, 3> &kinds, bool has_gradient);

nb::tuple sum_equations(nb::tuple rays, const std::array<double, 5> &view, nb::tuple table, nb::handle gradients,
                        const std::array<double, 12> &limits);

}  // namespace stairmap
