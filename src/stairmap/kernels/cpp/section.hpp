// A section of stairs as other kernels use it: its outline, what rays see of it, and the equations of a fit.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace stairmap {

// The pieces that are seen, from the lowest rays to the highest, with derivatives by `num_values` values.
struct Outline {
    size_t num_values = 0;
    std::vector<int64_t> surface, step;
    std::vector<double> line, top, line_gradient, top_gradient;
};

// The same, wherever it lies.
struct OutlineView {
    size_t num_pieces, num_values;
    const int64_t *surface, *step;
    const double *line, *top, *line_gradient, *top_gradient;

    const double *line_by(size_t piece) const { return line_gradient + piece * 2 * num_values; }
    const double *top_by(size_t piece) const { return top_gradient + piece * num_values; }
};

inline OutlineView view_of(const Outline &outline) {
    return {outline.surface.size(),  outline.num_values,           outline.surface.data(),
            outline.step.data(),     outline.line.data(),          outline.top.data(),
            outline.line_gradient.data(), outline.top_gradient.data()};
}

// Traces n nosings' distances and n + 1 treads' heights; shape and limits as in the twin.
Outline outline_of(const double *distances, const double *heights, size_t n, const std::array<double, 6> &shape,
                   bool is_open, const std::array<double, 5> &limits);

// Where predictions are written, for each slope; a gradient holds num_values + 1 numbers, or is none.
struct PredictionTarget {
    int64_t *surface, *step;
    double *value, *by_slope, *sensitivity, *spread, *farthest, *gradient;
};

void predict_slopes(const OutlineView &outline, const double *slope, size_t count, const std::array<double, 8> &edges,
                    const std::array<int64_t, 3> &kinds, const PredictionTarget &target);

// Predictions at evenly spaced slopes.
struct TableView {
    size_t count;
    double spacing;
    const double *slope, *value, *by_slope, *sensitivity, *spread, *farthest;

    // The entry nearest to a slope.
    size_t entry(double tau) const {
        const double place = (tau - slope[0]) / spacing, last = static_cast<double>(count - 1);
        if (count < 2 || !(place > 0)) return 0;
        // Without SSE 4.1, std::nearbyint is a call; this rounds halves to even numbers as well.
        return place < last ? static_cast<size_t>(std::lrint(place)) : count - 1;
    }

    // Q of a slope near an entry: between edges it is straight.
    double expected(double tau, size_t at) const { return value[at] + by_slope[at] * (tau - slope[at]); }
};

struct RaysView {
    size_t count;
    const double *slope, *bearing, *q;
};

struct EquationSums {
    double noise, weight, cost;
};

// Sums a round's equations: `gradient` has num_gradient columns for each entry; matrix and vector are filled, of
// num_gradient + 3 rows. The cost is 0 unless it is asked for.
EquationSums sum_rays(const RaysView &rays, const std::array<double, 5> &view, const TableView &table,
                      const double *gradient, size_t num_gradient, const std::array<double, 12> &limits, bool has_cost,
                      double *matrix, double *vector);

}  // namespace stairmap
