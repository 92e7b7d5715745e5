// Follow rows of a grid along the steps that they show, and look at what follows past their ends.
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels.hpp"
#include "table.hpp"

namespace stairmap {

namespace {

struct Limits {
    double max_bridge, depth_step, depth_step_square, wall_near, wall_far, max_wall_gap, shift;
    int64_t min_columns, max_ramp;
};

struct Row {  // a row's cells: inverse distance, whether on a step, lateral position, predicted distance
    std::vector<double> q, lateral, distance;
    std::vector<char> on;
    int64_t count;
    double spacing;
};

struct End {
    double position;
    bool is_bounded, is_cut;
};

// First and last column of the longest stretch on a step, short gaps bridged; false where there is none.
bool longest_run(const Row &row, const Limits &limits, int64_t &first, int64_t &last) {
    bool is_found = false;
    int64_t begin = -1, end = -1;
    const auto close = [&]() {
        if (begin >= 0 && (!is_found || end - begin >= last - first)) first = begin, last = end, is_found = true;
    };
    for (int64_t i = 0; i < row.count; ++i) {
        if (!row.on[i]) continue;
        const bool is_joined = begin >= 0 && (end == i - 1 ||
                                              !(std::abs(row.lateral[i] - row.lateral[end]) > limits.max_bridge));
        if (!is_joined) {
            close();
            begin = i;
        }
        end = i;
    }
    close();
    return is_found && last - first + 1 >= limits.min_columns;
}

End look_past(const Row &row, int64_t inner, int64_t side, const Input<double, 1> &outward, const Limits &limits) {
    const double distance = row.distance[inner], own = row.q[inner];
    const double tolerance = (limits.depth_step + limits.depth_step_square * (distance * distance)) / distance;
    const int64_t never = static_cast<int64_t>(outward.size());
    int64_t first_nearer = never, first_farther = never, first_outside = never, num_nearer = 0, num_wall = 0;
    double begins = 0.0, wall = 0.0;
    for (int64_t k = 0; k < never; ++k) {
        double steps = std::ceil(outward[k] / row.spacing);
        if (!(steps < static_cast<double>(row.count + 1))) steps = static_cast<double>(row.count + 1);
        const int64_t column = inner + side * std::max(static_cast<int64_t>(steps), k + 1);
        if (column < 0 || column >= row.count) {
            first_outside = std::min(first_outside, k);
            continue;
        }
        const double q = row.q[column];
        if (q > own * (1 + tolerance)) {
            if (first_nearer == never) first_nearer = k, begins = q;
            ++num_nearer;
            // Where the nearer thing stands: across at its own distance, not the step's.
            const double t = row.lateral[column] / row.distance[column] / q;
            const double past = static_cast<double>(-side) * (t - row.lateral[inner]);
            if (past > limits.wall_near && past < limits.wall_far && ++num_wall == 1) wall = t;
        }
        if (q > 0 && q < own * (1 - tolerance)) first_farther = std::min(first_farther, k);
    }
    const bool is_free = first_farther < first_nearer && first_farther < never;
    const bool is_hidden = first_nearer < never && !is_free;
    // A wall begins where the step ends; what stands before the stairs leaves a gap of depth.
    const bool at_wall = is_hidden && distance - 1.0 / std::max(begins, 1e-6) < limits.max_wall_gap &&
                         first_farther == never && 2 * num_wall > num_nearer;
    const bool is_cut = !is_free && !is_hidden && first_outside < never;

    const double expected = 1.0 / distance;
    double beyond = INFINITY;
    for (int64_t k = 1; k <= limits.max_ramp; ++k) {
        const int64_t column = inner + side * k;
        if (column >= 0 && column < row.count && row.q[column] > 0) beyond = std::min(beyond, row.q[column]);
    }
    const double halfway = 0.5 * (expected + (std::isfinite(beyond) ? std::min(beyond, expected) : expected));
    int64_t num_more = 0;
    for (int64_t k = 1; is_free && k <= limits.max_ramp; ++k) {
        const int64_t column = inner + side * k;
        // A stringer that stands there is nearer, and no ramp.
        if (column < 0 || column >= row.count || !(row.q[column] > halfway && row.q[column] < expected)) break;
        ++num_more;
    }
    // Where the last ray met something: a wall, or a side that recedes from the end, stands at its own place.
    const double met = row.lateral[inner] * expected / row.q[inner];
    // The step ends where the wall stands, which is within a column past the last ray; what stands farther
    // inside, a post, does not end it.
    if (at_wall) {
        const double past = static_cast<double>(-side) * (wall - met);
        return {met - static_cast<double>(side) * std::min(std::max(past, 0.0), row.spacing), true, false};
    }
    const double more = static_cast<double>(num_more) + 0.5 - (is_free ? limits.shift : 0.0);
    return {met - static_cast<double>(side) * more * row.spacing, is_free,
            is_hidden || is_cut};
}

}  // namespace

nb::tuple find_row_ends(nb::handle cell_grid, nb::tuple ray_arrays, nb::tuple table_arrays, nb::tuple steps,
                        const std::tuple<double, double, double, double, int64_t, double, double, double, double,
                                         double, int64_t, double> &limit_values) {
    Input<float, 2> cells(cell_grid, "cells");
    if (ray_arrays.size() != 3) refuse("rays: expected three arrays, got " + std::to_string(ray_arrays.size()));
    Input<double, 1> slope(ray_arrays[0], "rays[0]"), bearing(ray_arrays[1], "rays[1]");
    Input<double, 1> outward(ray_arrays[2], "rays[2]");
    check_length(slope, "rays[0]", cells.shape(0));
    check_length(bearing, "rays[1]", cells.shape(1));
    if (steps.size() != 2 && table_arrays.size() == 6)
        refuse("steps: expected two arrays, got " + std::to_string(steps.size()));
    const Table table(table_arrays);
    Input<double, 1> tolerance(steps[0], "steps[0]");
    Input<bool, 1> is_own(steps[1], "steps[1]");
    check_length(is_own, "steps[1]", tolerance.size());
    check_length(tolerance, "steps[0]", table.size());
    const auto [tilt, roll, turn, max_bridge, min_columns, depth_step, depth_step_square, wall_near, wall_far,
                max_wall_gap, max_ramp, shift] = limit_values;
    const Limits limits{max_bridge, depth_step, depth_step_square, wall_near, wall_far,
                        max_wall_gap, shift, min_columns, max_ramp};
    std::vector<int64_t> rows, entries;
    std::vector<End> ends[2];
    if (cells.size() > 0 && outward.size() > 0) {
        nb::gil_scoped_release release;
        const size_t count = cells.shape(1);
        Row row{std::vector<double>(count), std::vector<double>(count), std::vector<double>(count),
                std::vector<char>(count), static_cast<int64_t>(count), 0.0};
        for (size_t at = 0; at < cells.shape(0); ++at) {
            const double tau = slope[at];
            size_t middle = 0;
            for (size_t i = 0; i < count; ++i) {
                const double ahead = 1.0 - tilt * tau + turn * bearing[i];
                const double turned = (tau + tilt + roll * bearing[i]) / ahead;
                const size_t entry = table.entry(turned);
                const double expected = table.expected(turned, entry);
                const double q = static_cast<double>(cells[at * count + i]) / ahead;
                row.q[i] = q;
                row.on[i] = q > 0 && std::abs(q - expected) < tolerance[entry] && is_own[entry];
                row.distance[i] = 1.0 / expected;
                row.lateral[i] = (bearing[i] - roll * tau - turn) / ahead * row.distance[i];
                if (i == count / 2) middle = entry;
            }
            row.spacing = std::abs(row.lateral[0] - row.lateral[count - 1]) /
                          static_cast<double>(std::max<size_t>(count - 1, 1));
            int64_t first = 0, last = 0;
            if (!longest_run(row, limits, first, last)) continue;
            rows.push_back(static_cast<int64_t>(at));
            entries.push_back(static_cast<int64_t>(middle));
            // Bearings fall from left to right, so the first column is the left end.
            ends[0].push_back(look_past(row, first, -1, outward, limits));
            ends[1].push_back(look_past(row, last, 1, outward, limits));
        }
    }
    const size_t num = rows.size();
    Output<int64_t> row_numbers({num}), middles({num});
    Output<double> positions({2, num});
    Output<bool> is_bounded({2, num}), is_cut({2, num});
    for (size_t i = 0; i < num; ++i) {
        row_numbers[i] = rows[i];
        middles[i] = entries[i];
        for (size_t side = 0; side < 2; ++side) {
            positions[side * num + i] = ends[side][i].position;
            is_bounded[side * num + i] = ends[side][i].is_bounded;
            is_cut[side * num + i] = ends[side][i].is_cut;
        }
    }
    return nb::make_tuple(row_numbers.object(), middles.object(), positions.object(), is_bounded.object(),
                          is_cut.object());
}

}  // namespace stairmap
