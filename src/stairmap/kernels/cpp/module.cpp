// The extension module stairmap.kernels._compiled.
#include <nanobind/stl/array.h>

#include "kernels.hpp"

using namespace nb::literals;

NB_MODULE(_compiled, module) {
    module.attr("SOURCE_SUM") = SOURCE_SUM;
    module.def("trace_outline", &stairmap::trace_outline, "distances"_a, "heights"_a, "shape"_a, "is_open"_a,
               "limits"_a);
    module.def("predict_rays", &stairmap::predict_rays, "outline"_a, "slopes"_a, "edges"_a, "kinds"_a,
               "has_gradient"_a);
    module.def("sum_equations", &stairmap::sum_equations, "rays"_a, "view"_a, "table"_a, "gradients"_a, "limits"_a);
}
