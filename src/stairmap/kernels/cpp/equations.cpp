// Compare rays with a tabulated prediction, and sum the normal equations of what they say together.
#include "section.hpp"

#include <algorithm>
#include <cmath>

#include "kernels.hpp"
#include "vectors.hpp"

namespace stairmap {

namespace {

// Slope, bearing, Q and place in a table of all rays in turned axes, one after the other.
STAIRMAP_VECTORS
void turn_all(const RaysView &rays, double tilt, double roll, double turn, double first, double spacing,
              double *__restrict__ turned) {
    const double *slope = rays.slope, *bearing = rays.bearing, *q = rays.q;
    const size_t count = rays.count;
    double *tau = turned, *across = turned + count, *inverse = across + count, *place = inverse + count;
    for (size_t i = 0; i < count; ++i) {
        const double ahead = 1.0 - tilt * slope[i] + turn * bearing[i];
        const double at = (slope[i] + tilt + roll * bearing[i]) / ahead;
        tau[i] = at;
        across[i] = (bearing[i] - roll * slope[i] - turn) / ahead;
        inverse[i] = q[i] / ahead;
        place[i] = (at - first) / spacing;
    }
}

// Robust squares of residuals in units of their deviations.
STAIRMAP_VECTORS
void square_all(const double *__restrict__ residual, const double *__restrict__ deviation, size_t count, double tail,
                double *__restrict__ squares) {
    for (size_t i = 0; i < count; ++i) {
        const double ratio = residual[i] / deviation[i], square = ratio * ratio;
        squares[i] = square / (1.0 + square / (tail * tail));
    }
}

// Robust weights of residuals, each 1 at most, and with their variances, alone and times the residual.
STAIRMAP_VECTORS
void weigh_all(const double *__restrict__ residual, const double *__restrict__ variance, size_t count, double tail,
               double rays_per_sample, double *__restrict__ robust, double *__restrict__ weight,
               double *__restrict__ pull) {
    for (size_t i = 0; i < count; ++i) {
        const double ratio = residual[i] * residual[i] / variance[i];
        const double doubt = 1.0 + ratio / (tail * tail), share = 1.0 / (doubt * doubt);
        robust[i] = share;
        weight[i] = share / (variance[i] * rays_per_sample);
        pull[i] = weight[i] * residual[i];
    }
}

}  // namespace

EquationSums sum_rays(const RaysView &rays, const std::array<double, 5> &view, const TableView &table,
                      const double *gradient, size_t num_gradient, const std::array<double, 12> &limits, bool has_cost,
                      double *matrix, double *vector) {
    const auto [told, least, most, band, plain_share, band_sigma, min_rays, sigma_of_median, surface_variance,
                tail, rays_per_sample, cost_std] = limits;
    const auto [tilt, roll, turn, low, high] = view;
    const size_t num_rays = rays.count, count = table.count;
    // The profile's own values, the shift of edges, tilt; then roll and turn, which act by the bearing.
    const size_t num_own = num_gradient - 1, num_level = num_own + 2, num_all = num_level + 2;
    std::fill_n(matrix, num_all * num_all, 0.0);
    std::fill_n(vector, num_all, 0.0);
    double noise = told, total = 0.0, cost = 0.0;
    std::vector<double> turned(4 * num_rays), residual, bearing, plain_residual, variance, weight, pull, squares;
    std::vector<size_t> entry;
    residual.reserve(num_rays), bearing.reserve(num_rays), entry.reserve(num_rays);
    plain_residual.reserve(num_rays);
    const double *tau = turned.data(), *across = tau + num_rays, *q = across + num_rays, *place = q + num_rays;
    turn_all(rays, tilt, roll, turn, table.slope[0], table.spacing, turned.data());
    const double last = static_cast<double>(count - 1);
    for (size_t i = 0; i < num_rays; ++i) {
        if (!(tau[i] > low && tau[i] < high)) continue;
        const size_t at = count < 2 || !(place[i] > 0) ? 0
                          : place[i] < last          ? static_cast<size_t>(std::lrint(place[i]))
                                                     : count - 1;
        const double off = std::max(q[i], table.farthest[at]) - table.expected(tau[i], at);
        residual.push_back(off);
        bearing.push_back(across[i]);
        entry.push_back(at);
        const double near = band * table.sensitivity[at];
        if (table.spread[at] < std::max(told, plain_share * near) && std::abs(off) < std::max(band_sigma * told, near))
            plain_residual.push_back(std::abs(off));
    }
    const size_t num_seen = residual.size();
    variance.resize(num_seen), weight.resize(num_seen), pull.resize(num_seen), squares.resize(num_seen);
    if (has_cost) {
        for (size_t i = 0; i < num_seen; ++i) variance[i] = cost_std * table.sensitivity[entry[i]];
        square_all(residual.data(), variance.data(), num_seen, tail, squares.data());
        for (size_t i = 0; i < num_seen; ++i) cost += squares[i];
    }
    if (static_cast<double>(plain_residual.size()) >= min_rays)
        noise = std::clamp(sigma_of_median * median_of(plain_residual), least, most);
    // Rays of one entry share its derivatives: only the powers of their bearings differ.
    std::vector<double> sums(5 * count, 0.0), of_entry(count);
    for (size_t at = 0; at < count; ++at)
        of_entry[at] = noise * noise + surface_variance * table.sensitivity[at] * table.sensitivity[at] +
                       table.spread[at] * table.spread[at];
    for (size_t i = 0; i < num_seen; ++i) variance[i] = of_entry[entry[i]];
    weigh_all(residual.data(), variance.data(), num_seen, tail, rays_per_sample, squares.data(), weight.data(),
              pull.data());
    for (size_t i = 0; i < num_seen; ++i) {
        total += squares[i];
        double *sum = &sums[5 * entry[i]];
        sum[0] += weight[i];
        sum[1] += weight[i] * bearing[i];
        sum[2] += weight[i] * bearing[i] * bearing[i];
        sum[3] += pull[i];
        sum[4] += pull[i] * bearing[i];
    }
    std::vector<double> row(num_all);
    std::vector<size_t> used(num_all);
    for (size_t at = 0; at < count; ++at) {
        const double *sum = &sums[5 * at];
        if (sum[0] == 0.0) continue;
        const double *own = gradient + at * num_gradient;
        const double at_slope = table.slope[at], value = table.value[at], by = table.by_slope[at];
        size_t num_used = 0;
        for (size_t k = 0; k <= num_own; ++k)
            if (own[k] != 0.0) {
                row[num_used] = -own[k];
                used[num_used++] = k;
            }
        row[num_used] = value * at_slope - by * (1 + at_slope * at_slope);
        used[num_used++] = num_own + 1;
        const double lateral[2] = {-by, by * at_slope - value};
        for (size_t i = 0; i < num_used; ++i) {
            const double level = row[i];
            double *line = matrix + used[i] * num_all;
            for (size_t j = 0; j <= i; ++j) line[used[j]] += level * sum[0] * row[j];
            for (size_t side = 0; side < 2; ++side)
                matrix[(num_level + side) * num_all + used[i]] += level * sum[1] * lateral[side];
            vector[used[i]] += level * sum[3];
        }
        for (size_t i = 0; i < 2; ++i) {
            for (size_t j = 0; j <= i; ++j)
                matrix[(num_level + i) * num_all + num_level + j] += lateral[i] * sum[2] * lateral[j];
            vector[num_level + i] += lateral[i] * sum[4];
        }
    }
    for (size_t i = 0; i < num_all; ++i)
        for (size_t j = 0; j < i; ++j) matrix[j * num_all + i] = matrix[i * num_all + j];
    return {noise, total, cost};
}

}  // namespace stairmap
