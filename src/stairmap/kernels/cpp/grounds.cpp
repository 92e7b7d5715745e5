// Fit the plane of the ground to the rays of a frame, and find where it ends and something lower follows.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels.hpp"
#include "vectors.hpp"

namespace stairmap {

namespace {

constexpr float NOTHING = std::numeric_limits<float>::quiet_NaN();
constexpr size_t BLOCK = 64;  // rays that are worked on together

struct Limits {
    double low, high, height_bin;
    int64_t near_rows;
    bool is_known;
    double min_share;
    int64_t row_step, column_step;
    double max_range;
    double reach_growth;
    double first_limit, first_per_metre, noise, noise_per_metre, steadiness, least_distance;
    int64_t num_bins;
    double range_bin;
};

struct Lens {
    float forward[3], up[3], left[3], fx, fy, cx, cy, least;
};

// Distance and height of what the pixel nearest to each of up to BLOCK rays shows; not numbers where none is.
STAIRMAP_VECTORS
void meet_block(const float *pixels, int32_t rows, int32_t columns, const Lens &lens, float climb,
                const float *__restrict__ across, size_t count, float *__restrict__ distance,
                float *__restrict__ height) {
    const float x = climb * lens.up[0], y = climb * lens.up[1], z = climb * lens.up[2];
    const float forward_x = lens.forward[0], forward_y = lens.forward[1], forward_z = lens.forward[2];
    const float left_x = lens.left[0], left_y = lens.left[1], left_z = lens.left[2], least = lens.least;
    const float fx = lens.fx, fy = lens.fy, cx = lens.cx, cy = lens.cy;
    const float width = static_cast<float>(columns), tall = static_cast<float>(rows);
    float depth[BLOCK], inverse[BLOCK];
    int32_t at[BLOCK], is_inside[BLOCK];
    for (size_t i = 0; i < count; ++i) {
        depth[i] = z + (forward_z + left_z * across[i]);
        const float share = 1.0f / (depth[i] > least ? depth[i] : least);
        const float any_u = (x + (forward_x + left_x * across[i])) * share * fx + cx;
        const float any_v = (y + (forward_y + left_y * across[i])) * share * fy + cy;
        // Half a pixel beside the image, what rounds to a pixel of it is in it.
        const int32_t near = (any_u > -1.0f ? 1 : 0) & (any_u < width ? 1 : 0) & (any_v > -1.0f ? 1 : 0) &
                             (any_v < tall ? 1 : 0) & (depth[i] > least ? 1 : 0);
        const float u = (near ? any_u : 0.0f) + 1.0f, v = (near ? any_v : 0.0f) + 1.0f;
        // The nearest whole number, of numbers above 0: halves go to the even one.
        const int32_t low_u = static_cast<int32_t>(u), low_v = static_cast<int32_t>(v);
        const float plain_u = near ? any_u : 0.0f, plain_v = near ? any_v : 0.0f;
        const float part_u = plain_u - static_cast<float>(low_u - 1), part_v = plain_v - static_cast<float>(low_v - 1);
        const int32_t up_u = (part_u > 0.5f ? 1 : 0) | ((part_u == 0.5f ? 1 : 0) & (low_u - 1));
        const int32_t up_v = (part_v > 0.5f ? 1 : 0) | ((part_v == 0.5f ? 1 : 0) & (low_v - 1));
        const int32_t column = low_u - 1 + (up_u & 1), row = low_v - 1 + (up_v & 1);
        const int32_t inside = near & (column >= 0 ? 1 : 0) & (column < columns ? 1 : 0) & (row >= 0 ? 1 : 0) &
                               (row < rows ? 1 : 0);
        at[i] = inside ? row * columns + column : 0;
        is_inside[i] = inside;
    }
    for (size_t i = 0; i < count; ++i) inverse[i] = pixels[at[i]];
    for (size_t i = 0; i < count; ++i) {
        const float value = is_inside[i] ? inverse[i] * depth[i] : 0.0f;
        distance[i] = value > 0.0f ? 1.0f / value : NOTHING;
        height[i] = climb * distance[i];
    }
}

// Where one row of rays crosses the plane, how high above it what they met lies, and whether that is the plane.
STAIRMAP_VECTORS
void tell_row(const float *__restrict__ distance, const float *__restrict__ grade, float climb, float below, float lean,
              const float *tolerances, size_t count, float *__restrict__ crossing, float *__restrict__ height,
              int32_t *__restrict__ seen) {
    const float noise = tolerances[0], per_metre = tolerances[1], farthest = tolerances[2], most = tolerances[3];
    for (size_t i = 0; i < count; ++i) {
        const float fall = grade[i] - climb;
        const bool is_falling = fall > 1e-6f;
        const float at = is_falling ? below / (is_falling ? fall : 1.0f) : std::numeric_limits<float>::infinity();
        const float above = (height[i] + below - distance[i] * grade[i]) * lean;
        crossing[i] = at;
        height[i] = above;
        const float tolerance = noise + per_metre * (at < farthest ? at : farthest);
        seen[i] = (std::abs(above) < tolerance ? 1 : 0) & (at < most ? 1 : 0) & (at >= 0.0f ? 1 : 0);
    }
}

// Height of the camera above the level surface that the steepest rays meet, m; 0 without one.
double first_height(const float *height, size_t num_rows, size_t num_columns, const Limits &limits) {
    const float low = static_cast<float>(limits.low), high = static_cast<float>(limits.high);
    std::vector<float> inside;
    size_t num_below = 0;
    std::vector<int64_t> taken(num_columns, 0);
    for (size_t row = 0; row < num_rows; ++row)
        for (size_t column = 0; column < num_columns; ++column) {
            const float below = -height[row * num_columns + column];
            if (std::isnan(below) || taken[column] >= limits.near_rows) continue;
            ++taken[column];
            ++num_below;
            if (below > low && below < high) inside.push_back(below);
        }
    if (inside.empty()) return 0.0;
    const double least = limits.min_share * static_cast<double>(num_below);
    if (static_cast<double>(inside.size()) < least &&
        (!limits.is_known || static_cast<int64_t>(inside.size()) < limits.near_rows))
        return 0.0;
    const float size = static_cast<float>(limits.height_bin);
    std::vector<int64_t> counts(3, 0);
    for (const float below : inside) {
        const size_t bin = static_cast<size_t>(below / size);
        if (bin >= counts.size()) counts.resize(bin + 1, 0);
        ++counts[bin];
    }
    size_t best = 1;
    int64_t most = -1;
    for (size_t bin = 1; bin + 1 < counts.size(); ++bin) {
        const int64_t near = counts[bin - 1] + counts[bin] + counts[bin + 1];
        if (near > most) most = near, best = bin;
    }
    const float middle = static_cast<float>((static_cast<double>(best) + 0.5) * limits.height_bin);
    const float reach = static_cast<float>(1.5 * limits.height_bin);
    std::vector<double> near;
    for (const float below : inside)
        if (std::abs(below - middle) < reach) near.push_back(below);
    if (near.empty() || (!limits.is_known && static_cast<double>(near.size()) < least)) return 0.0;
    return median_of(near);
}

// Solves three symmetric equations; false where they break down.
bool solve_three(const double (&matrix)[3][3], const double (&vector)[3], double (&solution)[3]) {
    double rows[3][4];
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) rows[i][j] = matrix[i][j];
        rows[i][3] = vector[i];
    }
    for (int i = 0; i < 3; ++i) {
        int pivot = i;
        for (int k = i + 1; k < 3; ++k)
            if (std::abs(rows[k][i]) > std::abs(rows[pivot][i])) pivot = k;
        if (rows[pivot][i] == 0.0) return false;
        std::swap(rows[i], rows[pivot]);
        for (int k = i + 1; k < 3; ++k) {
            const double factor = rows[k][i] / rows[i][i];
            for (int j = i; j < 4; ++j) rows[k][j] -= factor * rows[i][j];
        }
    }
    for (int i = 2; i >= 0; --i) {
        solution[i] = rows[i][3];
        for (int j = i + 1; j < 3; ++j) solution[i] -= rows[i][j] * solution[j];
        solution[i] /= rows[i][i];
    }
    return true;
}

// Slope along, slope across and height of the camera; false where too few rays are near the plane.
bool fit_plane(const float *distance, const float *height, const std::vector<float> &across, size_t num_rows,
               double first, const Limits &limits, double (&plane)[3]) {
    const size_t num_columns = across.size();
    const float base = static_cast<float>(limits.first_limit), per_metre = static_cast<float>(limits.first_per_metre);
    const float farthest = static_cast<float>(limits.max_range), start = static_cast<float>(first);
    std::vector<std::array<double, 3>> rays;  // forward and lateral distance, height
    for (size_t row = 0; row < num_rows; row += static_cast<size_t>(limits.row_step))
        for (size_t column = 0; column < num_columns; column += static_cast<size_t>(limits.column_step)) {
            const float s = distance[row * num_columns + column], z = height[row * num_columns + column];
            if (s < farthest && std::abs(z + start) < base + per_metre * s)
                rays.push_back({static_cast<double>(s), static_cast<double>(s) * static_cast<double>(across[column]),
                                static_cast<double>(z)});
        }
    plane[0] = plane[1] = 0.0, plane[2] = first;
    const size_t num_least = static_cast<size_t>(std::max<int64_t>(limits.near_rows, 3));
    if (rays.size() < num_least) return false;
    std::vector<double> forward;
    for (const auto &ray : rays) forward.push_back(ray[0]);
    std::nth_element(forward.begin(), forward.begin() + static_cast<std::ptrdiff_t>(num_least - 1), forward.end());
    double reach = limits.reach_growth * std::max(forward[num_least - 1], limits.least_distance);
    for (; reach < limits.reach_growth * limits.max_range; reach *= limits.reach_growth) {
        double matrix[3][3] = {}, vector[3] = {};
        size_t num_near = 0;
        for (const auto &[s, t, z] : rays) {
            const double off = z - (s * plane[0] + t * plane[1] - plane[2]);
            if (!(std::abs(off) < limits.noise + limits.noise_per_metre * s && s < reach)) continue;
            ++num_near;
            const double nearest = std::max(s, limits.least_distance), weight = 1.0 / (nearest * nearest);
            const double design[3] = {s, t, -1.0};
            for (int i = 0; i < 3; ++i) {
                for (int j = 0; j < 3; ++j) matrix[i][j] += weight * design[i] * design[j];
                vector[i] += weight * design[i] * z;
            }
        }
        if (num_near < num_least) return false;
        // A little of the level plane keeps what few rays leave open.
        matrix[0][0] += limits.steadiness, matrix[1][1] += limits.steadiness;
        if (!solve_three(matrix, vector, plane)) return false;
    }
    return true;
}

}  // namespace

nb::tuple fit_ground(nb::handle inverse_depth, nb::handle axes_rows, nb::handle slopes, nb::handle bearings,
                     const std::array<double, 5> &camera,
                     const std::tuple<double, double, double, int64_t, bool, double, int64_t, int64_t, double, double,
                                      double, double, double, double, double, double, int64_t, double> &limit_values) {
    Input<float, 2> image(inverse_depth, "inverse_depth");
    Input<double, 2> axes(axes_rows, "axes");
    Input<double, 1> slope(slopes, "slope"), bearing(bearings, "bearing");
    check_length(axes, "axes", 3);
    check_length(axes, "axes", 3, 1);
    const Limits limits = std::apply([](auto... values) { return Limits{values...}; }, limit_values);
    if (limits.row_step < 1 || limits.column_step < 1 || limits.num_bins < 1)
        refuse("limits: expected steps and a number of bins above 0, got others");
    if (!(limits.height_bin > 0 && 0 <= limits.low && limits.low <= limits.high &&
          limits.high < 1e4 * limits.height_bin))
        refuse("limits: expected bins above 0 and heights of at most 10,000 of them, got others");
    if (!(limits.reach_growth > 1.0 && limits.least_distance > 0.0))
        refuse("limits: expected a reach that grows from a distance above 0, got others");
    const size_t num_rows = slope.size(), num_columns = bearing.size();
    const size_t num_bins = static_cast<size_t>(limits.num_bins);
    std::vector<float> across(num_columns), distance(num_rows * num_columns), height(num_rows * num_columns);
    for (size_t i = 0; i < num_columns; ++i) across[i] = static_cast<float>(bearing[i]);
    Output<bool> is_seen({num_columns, num_bins});
    double plane[3];
    bool is_found = false;
    {
        nb::gil_scoped_release release;
        Lens lens;
        for (int axis = 0; axis < 3; ++axis) {
            lens.forward[axis] = static_cast<float>(axes[axis]);
            lens.up[axis] = static_cast<float>(axes[3 + axis]);
            lens.left[axis] = static_cast<float>(axes[6 + axis]);
        }
        lens.fx = static_cast<float>(camera[0]), lens.fy = static_cast<float>(camera[1]);
        lens.cx = static_cast<float>(camera[2]), lens.cy = static_cast<float>(camera[3]);
        lens.least = static_cast<float>(camera[4]);
        if (image.size() == 0) {
            std::fill(distance.begin(), distance.end(), NOTHING);
            std::fill(height.begin(), height.end(), NOTHING);
        } else
            for (size_t row = 0; row < num_rows; ++row)
                for (size_t column = 0; column < num_columns; column += BLOCK)
                    meet_block(image.data(), static_cast<int32_t>(image.shape(0)), static_cast<int32_t>(image.shape(1)),
                               lens, static_cast<float>(slope[row]), &across[column],
                               std::min(BLOCK, num_columns - column), &distance[row * num_columns + column],
                               &height[row * num_columns + column]);
        const double first = first_height(height.data(), num_rows, num_columns, limits);
        is_found = first > 0 && fit_plane(distance.data(), height.data(), across, num_rows, first, limits, plane);
    }
    const size_t rows_told = is_found ? num_rows : 0;
    Output<double> plane_values({is_found ? size_t{3} : size_t{0}});
    Output<float> crossing({rows_told, num_columns}), above({rows_told, num_columns});
    if (is_found) {
        nb::gil_scoped_release release;
        std::copy_n(plane, 3, plane_values.data());
        const float along = static_cast<float>(plane[0]), aside = static_cast<float>(plane[1]);
        const float lean = static_cast<float>(1.0 / std::sqrt(1.0 + plane[0] * plane[0] + plane[1] * plane[1]));
        const float range_bin = static_cast<float>(limits.range_bin);
        const float tolerances[4] = {static_cast<float>(limits.noise), static_cast<float>(limits.noise_per_metre),
                                     static_cast<float>(limits.max_range),
                                     static_cast<float>(static_cast<double>(limits.num_bins) * limits.range_bin)};
        std::vector<float> grade(num_columns);
        std::vector<int32_t> seen(num_columns);
        for (size_t i = 0; i < num_columns; ++i) grade[i] = along + aside * across[i];
        std::copy(height.begin(), height.end(), above.data());
        for (size_t row = 0; row < num_rows; ++row) {
            const size_t at = row * num_columns;
            tell_row(&distance[at], grade.data(), static_cast<float>(slope[row]), static_cast<float>(plane[2]), lean,
                     tolerances, num_columns, crossing.data() + at, above.data() + at, seen.data());
            for (size_t column = 0; column < num_columns; ++column)
                if (seen[column]) {
                    const size_t bin = static_cast<size_t>(crossing[at + column] / range_bin);
                    is_seen[column * num_bins + std::min(bin, num_bins - 1)] = true;
                }
        }
    }
    return nb::make_tuple(plane_values.object(), crossing.object(), above.object(), is_seen.object());
}

nb::tuple find_ledges(nb::handle crossings, nb::handle heights, double camera_height,
                      const std::tuple<double, double, double, double, double, double, int64_t, int64_t, int64_t,
                                       int64_t, int64_t, double, double, int64_t, double, double, double> &limits) {
    Input<float, 2> all_crossings(crossings, "crossing"), all_heights(heights, "height");
    check_length(all_heights, "height", all_crossings.shape(0));
    check_length(all_heights, "height", all_crossings.shape(1), 1);
    const auto [noise_d, per_metre_d, range_d, min_depth_d, far_depth_d, depth_per_metre_d, persistence, min_below,
                last_rays, min_last, max_mixed, gap_d, distance_d, rows_behind, share_d, min_fall_d, shift_d] = limits;
    if (std::min({persistence, last_rays, max_mixed + 1, rows_behind + 1}) < 1)
        refuse("limits: expected numbers of rays above 0, got others");
    std::vector<int64_t> columns;
    std::vector<double> distances, depths;
    if (all_crossings.size() > 0) {
        nb::gil_scoped_release release;
        const int64_t num_rows = static_cast<int64_t>(all_crossings.shape(0));
        const size_t num_columns = all_crossings.shape(1);
        const float noise = static_cast<float>(noise_d), per_metre = static_cast<float>(per_metre_d);
        const float farthest = static_cast<float>(range_d), min_depth = static_cast<float>(min_depth_d);
        const float far_depth = static_cast<float>(far_depth_d), depth_per_metre = static_cast<float>(depth_per_metre_d);
        const float max_gap = static_cast<float>(gap_d), max_distance = static_cast<float>(distance_d);
        const float min_share = static_cast<float>(share_d), min_fall = static_cast<float>(min_fall_d);
        const float max_shift = static_cast<float>(shift_d), camera = static_cast<float>(camera_height);
        std::vector<float> crossing(num_rows), height(num_rows), falls;
        // How many of the measured rays up to each are on the ground, and how many below it.
        std::vector<int64_t> ground(num_rows + 1, 0), below(num_rows + 1, 0);
        for (size_t column = 0; column < num_columns; ++column) {
            int64_t count = 0;
            bool is_any_below = false;
            for (int64_t row = 0; row < num_rows; ++row) {
                const size_t at = static_cast<size_t>(row) * num_columns + column;
                const float above = all_heights[at], place = all_crossings[at];
                if (!std::isfinite(above)) continue;
                const float tolerance = noise + per_metre * (place < farthest ? place : std::isnan(place) ? place : farthest);
                const float deep = far_depth + depth_per_metre * place;
                const bool is_below = above < -(std::isnan(deep) ? deep : std::max(min_depth, deep));
                crossing[count] = place, height[count] = above;
                ground[count + 1] = ground[count] + (std::abs(above) < tolerance ? 1 : 0);
                below[count + 1] = below[count] + (is_below ? 1 : 0);
                is_any_below |= is_below;
                ++count;
            }
            if (!is_any_below) continue;
            for (int64_t row = 0; row < count; ++row) {
                if (below[row + 1] == below[row]) continue;
                if (below[std::min(row + persistence, count)] - below[row] < min_below) continue;
                int64_t last = -1;
                for (int64_t step = 1; step <= max_mixed + 1 && last < 0 && row - step >= 0; ++step) {
                    const int64_t at = row - step;
                    if (ground[at + 1] > ground[at] &&
                        ground[at + 1] - ground[std::max<int64_t>(at + 1 - last_rays, 0)] >= min_last)
                        last = at;
                }
                if (last < 0) continue;
                const float low = crossing[last], high = crossing[row];
                if (!(high - low < max_gap && low < max_distance)) continue;
                // The nearest edge of this bearing: it counts if it falls in one or two steps, or steeply.
                const auto height_at = [&](int64_t at) { return at < count ? height[at] : NOTHING; };
                const auto distance_at = [&](int64_t at) {
                    return at < count ? crossing[at] * (1.0f - height[at] / camera) : NOTHING;
                };
                const auto inside = [&](int64_t at) { return std::clamp<int64_t>(at, 0, num_rows - 1); };
                const int64_t first = inside(row - max_mixed - 1), final = inside(row + rows_behind);
                falls.clear();
                float total = 0.0f;
                for (int64_t at = row - max_mixed - 1; at < row + rows_behind; ++at) {
                    const float fall = -(height_at(inside(at + 1)) - height_at(inside(at)));
                    falls.push_back(fall > 0.0f ? fall : 0.0f);
                    total = total + falls.back();
                }
                std::sort(falls.begin(), falls.end());
                float largest = 0.0f;
                for (size_t k = falls.size() > 2 ? falls.size() - 2 : 0; k < falls.size(); ++k) largest += falls[k];
                const float reach = distance_at(final) - distance_at(first);
                const float drop = height_at(first) - height_at(final);
                const bool is_steep = drop > min_fall * (reach > 0.0f || std::isnan(reach) ? reach : 0.0f);
                if (largest >= min_share * total || is_steep) {
                    const float half = 0.5f * (high - low);
                    columns.push_back(static_cast<int64_t>(column));
                    distances.push_back(static_cast<double>(low + (half < max_shift ? half : max_shift)));
                    depths.push_back(-static_cast<double>(height[row]));
                }
                break;
            }
        }
    }
    Output<int64_t> column_array({columns.size()});
    Output<double> distance_array({columns.size()}), depth_array({columns.size()});
    std::copy(columns.begin(), columns.end(), column_array.data());
    std::copy(distances.begin(), distances.end(), distance_array.data());
    std::copy(depths.begin(), depths.end(), depth_array.data());
    return nb::make_tuple(column_array.object(), distance_array.object(), depth_array.object());
}

}  // namespace stairmap
