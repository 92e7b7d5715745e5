// Fit planes to windows of an image of inverse depth.
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels.hpp"

namespace stairmap {

nb::tuple fit_window_planes(nb::handle inverse_depth,
                            const std::tuple<int64_t, int64_t, double, double, double, double, double, double,
                                             double, double> &windows) {
    Input<float, 2> image(inverse_depth, "inverse_depth");
    const auto [window_width, window_height, fx, fy, cx, cy, min_mass, max_residual, residual_floor, min_cosine] =
        windows;
    if (window_width % 2 != 1 || window_height % 2 != 1 || window_width < 1 || window_height < 1)
        refuse("windows: expected an odd width and height, got others");
    constexpr int64_t NUM = 7;  // moments: 1, q, q², and products of the first two with u, then with v
    const int64_t height = static_cast<int64_t>(image.shape(0) / 2), width = static_cast<int64_t>(image.shape(1) / 2);
    const int64_t num_rows = (height + 1) / 2, num_columns = (width + 1) / 2;
    // Single numbers are float32 and sums float64, as those of the twin's box filter.
    std::vector<float> normal(static_cast<size_t>(3 * num_rows * num_columns)), means, residual;
    std::vector<int64_t> places;  // of usable windows in the grid of windows
    std::vector<float> u(width), v(height);
    for (int64_t i = 0; i < width; ++i)
        u[i] = (static_cast<float>(i) - static_cast<float>(cx)) / static_cast<float>(fx);
    for (int64_t i = 0; i < height; ++i)
        v[i] = (static_cast<float>(i) - static_cast<float>(cy)) / static_cast<float>(fy);
    if (width > 0 && height > 0) {
        nb::gil_scoped_release release;
        // Weight and mean of inverse depth of each block of four pixels.
        std::vector<float> weight(static_cast<size_t>(width * height)), mean(weight.size()), squares(weight.size());
        for (int64_t row = 0; row < height; ++row) {
            const float *upper = image.row(2 * row), *lower = image.row(2 * row + 1);
            for (int64_t i = 0; i < width; ++i) {
                const float a = upper[2 * i], b = upper[2 * i + 1], c = lower[2 * i], d = lower[2 * i + 1];
                const float w = static_cast<float>((a > 0) + (b > 0) + (c > 0) + (d > 0)) * 0.25f;
                const float q = ((a + b) + (c + d)) * 0.25f;
                weight[row * width + i] = w;
                mean[row * width + i] = q;
                squares[row * width + i] = w > 0 ? q * q / w : 0.0f;
            }
        }
        const double share = 1.0 / static_cast<double>(window_width * window_height);
        const double square_u = static_cast<double>(window_width * window_width - 1) / 12 / (fx * fx);
        const double square_v = static_cast<double>(window_height * window_height - 1) / 12 / (fy * fy);
        const float var_u = static_cast<float>(std::max(square_u, 1e-12));
        const float var_v = static_cast<float>(std::max(square_v, 1e-12));
        const float least_mass = static_cast<float>(min_mass), residual_share = static_cast<float>(max_residual);
        const float floor = static_cast<float>(residual_floor);
        const int64_t reach_u = window_width / 2, reach_v = window_height / 2;
        // Sums over the columns of each window, for every row, then over the rows of the window.
        std::vector<double> across(static_cast<size_t>(NUM * height * num_columns)), running(NUM * (width + 1), 0.0);
        const auto sums_of = [&](int64_t row, int64_t k) { return &across[(row * NUM + k) * num_columns]; };
        for (int64_t row = 0; row < height; ++row) {
            const float *w = &weight[row * width], *q = &mean[row * width], *square = &squares[row * width];
            const float ray = v[row];
            // All moments together: none waits for the sums of another.
            for (int64_t i = 0; i < width; ++i) {
                const float values[NUM] = {w[i], q[i], square[i], w[i] * u[i], q[i] * u[i], w[i] * ray, q[i] * ray};
                const double *before = &running[NUM * i];
                double *after = &running[NUM * (i + 1)];
                for (int64_t k = 0; k < NUM; ++k) after[k] = before[k] + static_cast<double>(values[k]);
            }
            for (int64_t place = 0; place < num_columns; ++place) {
                const double *last = &running[NUM * std::min(2 * place + reach_u + 1, width)];
                const double *first = &running[NUM * std::max<int64_t>(2 * place - reach_u, 0)];
                for (int64_t k = 0; k < NUM; ++k) sums_of(row, k)[place] = last[k] - first[k];
            }
        }
        std::vector<double> window(static_cast<size_t>(NUM * num_columns));
        for (int64_t at = 0; at < num_rows; ++at) {
            std::fill(window.begin(), window.end(), 0.0);
            for (int64_t row = std::max<int64_t>(2 * at - reach_v, 0); row <= std::min(2 * at + reach_v, height - 1);
                 ++row) {
                const double *sums = sums_of(row, 0);
                for (int64_t i = 0; i < NUM * num_columns; ++i) window[i] += sums[i];
            }
            const float ray_v = v[2 * at];
            for (int64_t place = 0; place < num_columns; ++place) {
                float m[NUM];
                for (int64_t k = 0; k < NUM; ++k)
                    m[k] = static_cast<float>(window[k * num_columns + place] * share);
                if (!(m[0] > least_mass)) continue;
                const float inverse = 1.0f / std::max(m[0], 0.1f);
                // With few missing pixels the window's moments of u and v are those of the full window.
                const float q = m[1] * inverse;
                const float a = (m[4] * inverse - m[3] * inverse * q) / var_u;
                const float b = (m[6] * inverse - m[5] * inverse * q) / var_v;
                const float variance = m[2] * inverse - q * q - a * a * var_u - b * b * var_v;
                // A depth jump inside the window leaves a residual of several percent of q.
                const float allowed = residual_share * q;
                if (!(variance < allowed * allowed + floor)) continue;
                const float c = q - a * u[2 * place] - b * ray_v;
                const float length = std::max(std::sqrt(a * a + b * b + c * c), 1e-9f);
                const int64_t index = at * num_columns + place;
                normal[3 * index] = a / length, normal[3 * index + 1] = b / length, normal[3 * index + 2] = c / length;
                places.push_back(index);
                means.push_back(q);
                residual.push_back(std::sqrt(std::max(variance, 0.0f)));
            }
        }
    }
    const size_t count = places.size();
    Output<float> normals({count, 3}), points({count, 3}), residuals({count});
    Output<bool> is_inner({count});
    const float least_cosine = static_cast<float>(min_cosine);
    for (size_t i = 0; i < count; ++i) {
        const int64_t at = places[i] / num_columns, place = places[i] % num_columns;
        const float *mine = &normal[3 * places[i]];
        for (size_t k = 0; k < 3; ++k) normals[3 * i + k] = mine[k];
        points[3 * i] = u[2 * place] / means[i];
        points[3 * i + 1] = v[2 * at] / means[i];
        points[3 * i + 2] = 1.0f / means[i];
        residuals[i] = residual[i];
        float cosine = 0.0f;
        if (at > 0 && at + 1 < num_rows) {
            const float *above = mine - 3 * num_columns, *below = mine + 3 * num_columns;
            cosine = above[0] * below[0] + above[1] * below[1] + above[2] * below[2];
        }
        is_inner[i] = cosine > least_cosine;
    }
    std::vector<double> ordered(residual.begin(), residual.end());
    return nb::make_tuple(normals.object(), points.object(), residuals.object(), is_inner.object(),
                          median_of(ordered));
}

}  // namespace stairmap
