// What rays of some slopes must see of an outline, blended at its borders.
#include "section.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels.hpp"

namespace stairmap {

namespace {

struct Edges {  // how a camera shows borders, and what counts as one
    double row_size, width, shift, place_std, blend, min_shifted_jump, max_offset, near_offset;
};

struct Borders {  // between pieces i and i + 1
    std::vector<double> jump, outward, at, highest;
};

Borders find_borders(const double *line, const double *top, size_t count, const Edges &edges) {
    Borders found;
    double highest = -INFINITY;
    for (size_t i = 0; i < count; ++i) {
        const double *below = line + 2 * i, *above = below + 2;
        const double jump = (above[0] - below[0]) + (above[1] - below[1]) * top[i];
        const double at_edge = std::max(above[0] + above[1] * top[i], below[0] + below[1] * top[i]);
        const bool is_shifted = std::abs(jump) > edges.min_shifted_jump * at_edge;
        const double sign = jump > 0 ? 1.0 : (jump < 0 ? -1.0 : 0.0);
        const double outward = is_shifted ? -sign * edges.row_size : 0.0;
        const double border = top[i] + edges.shift * outward;
        highest = std::max(highest, border);
        found.jump.push_back(jump);
        found.outward.push_back(outward);
        found.at.push_back(border);
        found.highest.push_back(highest);
    }
    return found;
}

}  // namespace

void predict_slopes(const OutlineView &outline, const double *slope, size_t count,
                    const std::array<double, 8> &edge_values, const std::array<int64_t, 3> &kinds,
                    const PredictionTarget &target) {
    const Edges edges{edge_values[0], edge_values[1], edge_values[2], edge_values[3],
                      edge_values[4], edge_values[5], edge_values[6], edge_values[7]};
    const double *line = outline.line, *top = outline.top;
    const size_t num_pieces = outline.num_pieces, num_values = outline.num_values;
    const bool has_gradient = target.gradient != nullptr;
    const size_t num_borders = num_pieces - 1;
    const Borders borders = find_borders(line, top, num_borders, edges);
    const auto is_behind = [&](size_t piece) { return outline.surface[piece] == kinds[0]; };
    const auto is_level = [&](size_t piece) { return outline.surface[piece] == kinds[1] || outline.surface[piece] == kinds[2]; };
    for (size_t i = 0; i < count; ++i) {
        const double tau = slope[i];
        const size_t piece = static_cast<size_t>(
            std::upper_bound(borders.highest.begin(), borders.highest.end(), tau) - borders.highest.begin());
        const double b = line[2 * piece + 1];
        double value = line[2 * piece] + b * tau, by_slope = b, variance = 0.0;
        target.sensitivity[i] = is_level(piece) ? std::abs(value * b) : value * value;
        double farthest = is_behind(piece) ? value : 0.0;
        double *gradient = has_gradient ? target.gradient + i * (num_values + 1) : nullptr;
        if (has_gradient) {
            const double *own = outline.line_by(piece);
            for (size_t k = 0; k < num_values; ++k) gradient[k] = own[k] + tau * own[num_values + k];
            gradient[num_values] = 0.0;
        }
        for (int side = 1; side >= -1; side -= 2) {
            // The border above the piece, then the one below it; only rays near it feel the neighbour.
            if (side > 0 ? piece >= num_borders : piece == 0) continue;
            const size_t at = side > 0 ? piece : piece - 1;
            const double offset = (tau - borders.at[at]) / edges.width;
            if (!(std::abs(offset) < edges.max_offset)) continue;
            const double x = side * offset, share = 1.0 / (1.0 + std::exp(-x)), ramp = std::log1p(std::exp(x));
            const double jump = borders.jump[at], kink = line[2 * at + 3] - line[2 * at + 1];
            const double bell = share * (1 - share), steepness = jump * bell / edges.width;
            value += side * jump * share + kink * edges.width * ramp;
            by_slope += steepness + side * kink * share;
            variance += (steepness * edges.place_std) * (steepness * edges.place_std);
            // How far a wide ramp falls is unknown where nothing is known of what lies behind.
            if (is_behind(at) || is_behind(at + 1)) variance += edges.blend * bell * jump * jump;
            const size_t other = side > 0 ? at + 1 : at;
            if (is_behind(other) && std::abs(x) < edges.near_offset)
                farthest = std::max(farthest, line[2 * other] + line[2 * other + 1] * tau);
            if (has_gradient) {
                const double *below = outline.line_by(at), *above = outline.line_by(at + 1);
                const double *by_top = outline.top_by(at);
                const double by_b = share * top[at] + side * edges.width * ramp;
                for (size_t k = 0; k < num_values; ++k) {
                    const double a = side * (above[k] - below[k]);
                    const double c = side * (above[num_values + k] - below[num_values + k]);
                    gradient[k] += share * a + by_b * c - steepness * by_top[k];
                }
                gradient[num_values] -= steepness * borders.outward[at];
            }
        }
        target.surface[i] = outline.surface[piece];
        target.step[i] = outline.step[piece];
        target.value[i] = value;
        target.by_slope[i] = by_slope;
        target.spread[i] = std::sqrt(variance);
        target.farthest[i] = farthest;
    }
}

nb::tuple predict_rays(nb::tuple outline, nb::handle slopes, const std::array<double, 8> &edge_values,
                       const std::array<int64_t, 3> &kinds, bool has_gradient) {
    if (outline.size() != 6) refuse("outline: expected six arrays, got " + std::to_string(outline.size()));
    Input<int64_t, 1> surface(outline[0], "outline[0]"), step(outline[1], "outline[1]");
    Input<double, 2> line(outline[2], "outline[2]");
    Input<double, 1> top(outline[3], "outline[3]");
    Input<double, 3> line_gradient(outline[4], "outline[4]");
    Input<double, 2> top_gradient(outline[5], "outline[5]");
    Input<double, 1> slope(slopes, "slopes");
    const size_t num_pieces = surface.size(), num_values = top_gradient.shape(1);
    if (num_pieces == 0) refuse("outline[0]: expected at least one piece, got none");
    check_length(step, "outline[1]", num_pieces);
    check_length(line, "outline[2]", num_pieces);
    check_length(line, "outline[2]", 2, 1);
    check_length(top, "outline[3]", num_pieces);
    check_length(line_gradient, "outline[4]", num_pieces);
    check_length(line_gradient, "outline[4]", 2, 1);
    check_length(line_gradient, "outline[4]", num_values, 2);
    check_length(top_gradient, "outline[5]", num_pieces);
    const size_t count = slope.size();
    Output<int64_t> surfaces({count}), steps({count});
    Output<double> values({count}), by_slopes({count}), sensitivities({count}), spreads({count}),
        farthests({count}), gradients({count, has_gradient ? num_values + 1 : 0});
    {
        nb::gil_scoped_release release;
        const OutlineView view{num_pieces,  num_values, surface.data(),       step.data(),
                               line.data(), top.data(), line_gradient.data(), top_gradient.data()};
        predict_slopes(view, slope.data(), count, edge_values, kinds,
                       {surfaces.data(), steps.data(), values.data(), by_slopes.data(), sensitivities.data(),
                        spreads.data(), farthests.data(), has_gradient ? gradients.data() : nullptr});
    }
    return nb::make_tuple(surfaces.object(), steps.object(), values.object(), by_slopes.object(),
                          sensitivities.object(), spreads.object(), farthests.object(), gradients.object());
}

}  // namespace stairmap
