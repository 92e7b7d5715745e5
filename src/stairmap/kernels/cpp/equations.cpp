// Compare rays with a tabulated prediction, and sum the normal equations of what they say together.
#include "section.hpp"

#include <algorithm>
#include <cmath>

#include "kernels.hpp"

namespace stairmap {

EquationSums sum_rays(const RaysView &rays, const std::array<double, 5> &view, const TableView &table,
                      const double *gradient, size_t num_gradient, const std::array<double, 12> &limits, double *matrix,
                      double *vector) {
    const auto [told, least, most, band, plain_share, band_sigma, min_rays, sigma_of_median, surface_variance,
                tail, rays_per_sample, cost_std] = limits;
    const auto [tilt, roll, turn, low, high] = view;
    const size_t num_rays = rays.count, count = table.count;
    // The profile's own values, the shift of edges, tilt; then roll and turn, which act by the bearing.
    const size_t num_own = num_gradient - 1, num_level = num_own + 2, num_all = num_level + 2;
    std::fill_n(matrix, num_all * num_all, 0.0);
    std::fill_n(vector, num_all, 0.0);
    double noise = told, total = 0.0, cost = 0.0;
    std::vector<double> residual, bearing, plain_residual;
    std::vector<size_t> entry;
    residual.reserve(num_rays), bearing.reserve(num_rays), entry.reserve(num_rays);
    plain_residual.reserve(num_rays);
    for (size_t i = 0; i < num_rays; ++i) {
        const double ahead = 1.0 - tilt * rays.slope[i] + turn * rays.bearing[i];
        const double tau = (rays.slope[i] + tilt + roll * rays.bearing[i]) / ahead;
        if (!(tau > low && tau < high)) continue;
        const size_t at = table.entry(tau);
        const double off = std::max(rays.q[i] / ahead, table.farthest[at]) - table.expected(tau, at);
        residual.push_back(off);
        bearing.push_back((rays.bearing[i] - roll * rays.slope[i] - turn) / ahead);
        entry.push_back(at);
        const double near = band * table.sensitivity[at];
        if (table.spread[at] < std::max(told, plain_share * near) && std::abs(off) < std::max(band_sigma * told, near))
            plain_residual.push_back(std::abs(off));
        const double ratio = off / (cost_std * table.sensitivity[at]), square = ratio * ratio;
        cost += square / (1.0 + square / (tail * tail));
    }
    if (static_cast<double>(plain_residual.size()) >= min_rays)
        noise = std::clamp(sigma_of_median * median_of(plain_residual), least, most);
    // Rays of one entry share its derivatives: only the powers of their bearings differ.
    std::vector<double> sums(5 * count, 0.0);
    for (size_t i = 0; i < residual.size(); ++i) {
        const size_t at = entry[i];
        const double variance = noise * noise + surface_variance * table.sensitivity[at] * table.sensitivity[at] +
                                table.spread[at] * table.spread[at];
        const double ratio = residual[i] * residual[i] / variance;
        const double doubt = 1.0 + ratio / (tail * tail), robust = 1.0 / (doubt * doubt);
        total += robust;
        const double weight = robust / (variance * rays_per_sample), pull = weight * residual[i];
        double *sum = &sums[5 * at];
        sum[0] += weight;
        sum[1] += weight * bearing[i];
        sum[2] += weight * bearing[i] * bearing[i];
        sum[3] += pull;
        sum[4] += pull * bearing[i];
    }
    std::vector<double> row(num_all);
    std::vector<size_t> used(num_all);
    for (size_t at = 0; at < count; ++at) {
        const double *sum = &sums[5 * at];
        if (sum[0] == 0.0) continue;
        const double *own = gradient + at * num_gradient;
        const double tau = table.slope[at], q = table.value[at], by = table.by_slope[at];
        size_t num_used = 0;
        for (size_t k = 0; k <= num_own; ++k)
            if (own[k] != 0.0) {
                row[num_used] = -own[k];
                used[num_used++] = k;
            }
        row[num_used] = q * tau - by * (1 + tau * tau);
        used[num_used++] = num_own + 1;
        const double lateral[2] = {-by, by * tau - q};
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
