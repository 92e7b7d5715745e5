// Find where the surface seen in a scan ends, or leans back, and compare corners of neighbouring scans.
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels.hpp"

namespace stairmap {

namespace {

constexpr double PI = 3.14159265358979323846;

struct Found {
    std::vector<double> s, z;
    std::vector<int64_t> strip;
    std::vector<char> is_end;
};

template <class To, class From>
nb::object array_of(const std::vector<From> &values) {
    Output<To> array({values.size()});
    for (size_t i = 0; i < values.size(); ++i) array[i] = static_cast<To>(values[i]);
    return array.object();
}

void check_scans(const Input<double, 2> &q, const Input<double, 1> &slope) {
    if (q.size() == 0) refuse("inverse_distance: expected at least one cell, got none");
    check_length(slope, "slope", q.shape(0));
}

struct Line {  // through the measured cells of a window
    double count, offset, slope;
};

}  // namespace

nb::tuple find_jumps(nb::handle inverse_distance, nb::handle slopes, nb::handle jump_row_numbers,
                     const std::tuple<double, double, double, double, int64_t, double, double> &limits) {
    Input<double, 2> q(inverse_distance, "inverse_distance");
    Input<double, 1> slope(slopes, "slope");
    check_scans(q, slope);
    Input<int64_t, 1> jump_rows(jump_row_numbers, "jump_rows");
    for (size_t i = 0; i < jump_rows.size(); ++i)
        if (jump_rows[i] < 1) refuse("jump_rows: expected at least one number, all above 0, got others");
    if (jump_rows.size() == 0) refuse("jump_rows: expected at least one number, all above 0, got others");
    const auto [row_size, edge_shift, min_jump_length, min_difference, nothing, level_slope, max_deeper] = limits;
    Found found;
    {
        nb::gil_scoped_release release;
        const int64_t num_rows = static_cast<int64_t>(q.shape(0)), num_strips = static_cast<int64_t>(q.shape(1));
        const int64_t reach = *std::max_element(jump_rows.data(), jump_rows.data() + jump_rows.size());
        const auto slope_at = [&, row_size = row_size](int64_t row) {
            return row < num_rows ? slope[row] : slope[num_rows - 1] + row_size * static_cast<double>(row - num_rows + 1);
        };
        const auto cell = [&](int64_t row, int64_t strip) { return row < num_rows ? q[row * num_strips + strip] : 0.0; };
        std::vector<char> is_edge(q.size(), 0), is_last(q.size(), 0);
        std::vector<int64_t> until(num_strips, 0);  // rows above that hold nothing, counted downward
        std::vector<double> level(jump_rows.size());
        for (int64_t row = num_rows - 1; row >= 0; --row) {
            const double tau = slope[row], min_jump = min_jump_length / std::sqrt(1.0 + tau * tau);
            // What an upright surface and a level one would show above: farther than both is a jump.
            const double ratio = tau < 0 ? 1.0 / std::min(tau, -1e-6) : 0.0;
            for (size_t k = 0; k < level.size(); ++k)
                level[k] = std::min(tau < 0 ? slope_at(row + jump_rows[k]) * ratio : 1.0, 1.0);
            for (int64_t strip = 0; strip < num_strips; ++strip) {
                const double here = q[row * num_strips + strip];
                int64_t &empty = until[strip];
                if (!(here > 0)) {
                    ++empty;
                    continue;
                }
                bool is_jump = false;
                for (size_t k = 0; k < level.size() && !is_jump; ++k) {
                    const double above = cell(row + jump_rows[k], strip);
                    if (!(above > 0)) continue;
                    const double expected = here * level[k];
                    is_jump = above < std::min(expected / (1.0 + min_jump * expected), expected - min_difference);
                }
                const bool is_end = !is_jump && empty >= nothing && row + 1 + nothing <= num_rows;
                is_edge[row * num_strips + strip] = is_jump || is_end;
                is_last[row * num_strips + strip] = is_end;
                empty = 0;
            }
        }
        for (int64_t first = 0; first < num_rows; ++first)
            for (int64_t strip = 0; strip < num_strips; ++strip) {
                if (!is_edge[first * num_strips + strip]) continue;
                if (first > 0 && is_edge[(first - 1) * num_strips + strip]) continue;
                // Of neighbouring rows that all see the jump ahead, the edge is before the steepest fall.
                int64_t edge = first;
                double steepest = -INFINITY;
                for (int64_t row = first; row < std::min(first + reach, num_rows); ++row) {
                    if (!is_edge[row * num_strips + strip]) break;
                    const double fall = cell(row, strip) - cell(row + 1, strip);
                    if (fall > steepest) steepest = fall, edge = row;
                }
                const double at = std::min(slope[edge] + (0.5 - edge_shift) * row_size, slope_at(edge + 1));
                // The surface is followed to the edge at the distance it has where it is still itself.
                double s = 1.0 / cell(first, strip);
                const double own = 1.0 / cell(edge, strip);
                const double deeper = slope[edge] < -level_slope
                                          ? s * slope[first] / std::min(at, -0.5 * level_slope)
                                          : s;
                if (!(std::abs(own - s) <= std::abs(own - deeper))) s = std::min(deeper, own + max_deeper);
                found.s.push_back(s);
                found.z.push_back(s * at);
                found.strip.push_back(strip);
                found.is_end.push_back(is_last[edge * num_strips + strip]);
            }
    }
    return nb::make_tuple(array_of<double>(found.s), array_of<double>(found.z), array_of<int64_t>(found.strip),
                          array_of<bool>(found.is_end));
}

nb::tuple find_creases(nb::handle inverse_distance, nb::handle slopes,
                       const std::tuple<double, double, double, int64_t, int64_t, double, double, double, double,
                                        double, double, double> &limits) {
    Input<double, 2> q(inverse_distance, "inverse_distance");
    Input<double, 1> slope(slopes, "slope");
    check_scans(q, slope);
    const auto [row_size, noise, height, min_window, max_window, min_share, max_gap, min_corner, max_corner_std,
                min_lean, max_lean, min_upper_lean] = limits;
    Found found;
    {
        nb::gil_scoped_release release;
        const int64_t num_rows = static_cast<int64_t>(q.shape(0)), num_strips = static_cast<int64_t>(q.shape(1));
        double mean = 0.0;
        for (int64_t row = 0; row < num_rows; ++row) mean += slope[row];
        mean /= static_cast<double>(num_rows);
        std::vector<double> tau(num_rows), corner(q.size(), 0.0), meet(q.size()), q_meet(q.size());
        for (int64_t row = 0; row < num_rows; ++row) tau[row] = slope[row] - mean;
        // A little less than what the angles are held to in the end.
        const double least_sine = std::sin(min_corner) * (1.0 - 1e-6), least_square = least_sine * least_sine;
        int64_t largest = min_window;
        std::vector<std::array<double, 5>> sums(num_rows + 1);
        for (int64_t strip = 0; strip < num_strips; ++strip) {
            sums[0] = {};
            for (int64_t row = 0; row < num_rows; ++row) {
                const double value = q[row * num_strips + strip], weight = value > 0 ? 1.0 : 0.0, x = tau[row];
                const auto &before = sums[row];
                sums[row + 1] = {before[0] + weight, before[1] + weight * x, before[2] + weight * (x * x),
                                 before[3] + value, before[4] + value * x};
            }
            const auto fit = [&](int64_t from, int64_t to) {
                const auto &a = sums[std::max<int64_t>(from, 0)], &b = sums[std::min(to, num_rows)];
                const double count = b[0] - a[0], x = b[1] - a[1], xx = b[2] - a[2], y = b[3] - a[3], xy = b[4] - a[4];
                const double steepness = (count * xy - x * y) / (count * xx - x * x);
                return Line{count, (y - steepness * x) / count, steepness};
            };
            for (int64_t row = 0; row < num_rows; ++row) {
                const double value = q[row * num_strips + strip];
                const double wanted = std::clamp(height / row_size * value, static_cast<double>(min_window),
                                                 static_cast<double>(max_window));
                const int64_t window = std::lrint(wanted);
                const double rows = static_cast<double>(window);
                largest = std::max(largest, window);
                const double enough = min_share * rows;
                if (!(sums[row + 1][0] - sums[std::max<int64_t>(row + 1 - window, 0)][0] > enough)) continue;
                if (!(sums[std::min(row + 1 + window, num_rows)][0] - sums[row + 1][0] > enough)) continue;
                // The border lies above this row: the window below ends with it.
                const Line low = fit(row + 1 - window, row + 1), high = fit(row + 1, row + 1 + window);
                const double at = tau[row] + 0.5 * row_size, here = slope[row] + 0.5 * row_size;
                const double q_low = low.offset + low.slope * at, q_high = high.offset + high.slope * at;
                if (!(q_low > 0 && q_high > 0 && std::abs(1.0 / q_high - 1.0 / q_low) < max_gap)) continue;
                if (!(noise * std::sqrt(12.0 / (rows * rows * rows)) / row_size / std::max(q_low, 1e-6) < max_corner_std))
                    continue;
                double met = (high.offset - low.offset) / (low.slope - high.slope);
                met = std::min(std::max(met, at - rows * row_size), at + rows * row_size);
                const double q_met = low.offset + low.slope * met;
                if (!(q_met > 0 && std::isfinite(q_met))) continue;
                // s = 1/Q and z = tau/Q: a surface's inclination is 0 for a tread, a quarter turn for a riser.
                const double low_x = -low.slope, low_y = q_low - here * low.slope;
                const double high_x = -high.slope, high_y = q_high - here * high.slope;
                // Most are flat: the sine of the angle between both tells it at less cost than the angle itself.
                const double sine = high_x * low_y - high_y * low_x;
                const double lengths = (low_x * low_x + low_y * low_y) * (high_x * high_x + high_y * high_y);
                if (min_corner > 0 && min_corner < PI / 2 && !(sine > 0 && sine * sine > least_square * lengths)) continue;
                const double lean_low = std::atan2(low_y, low_x);
                if (!(lean_low > min_lean && lean_low < max_lean)) continue;
                const double lean_high = std::atan2(high_y, high_x);
                if (!(lean_high > min_upper_lean)) continue;
                double turn = std::fmod(lean_low - lean_high + PI, 2 * PI);
                turn = (turn < 0 ? turn + 2 * PI : turn) - PI;
                if (!(turn > min_corner && turn < PI - min_corner)) continue;
                const size_t index = static_cast<size_t>(row * num_strips + strip);
                corner[index] = turn, meet[index] = met, q_meet[index] = q_met;
            }
        }
        const int64_t reach = largest / 2;
        for (int64_t row = 0; row < num_rows; ++row)
            for (int64_t strip = 0; strip < num_strips; ++strip) {
                const size_t index = static_cast<size_t>(row * num_strips + strip);
                if (corner[index] == 0.0) continue;
                bool is_peak = true;
                for (int64_t other = std::max<int64_t>(row - reach, 0); other <= std::min(row + reach, num_rows - 1); ++other)
                    is_peak &= corner[index] >= corner[static_cast<size_t>(other * num_strips + strip)];
                if (!is_peak) continue;
                const double s = 1.0 / q_meet[index];
                found.s.push_back(s);
                found.z.push_back(s * (meet[index] + mean));
                found.strip.push_back(strip);
            }
    }
    return nb::make_tuple(array_of<double>(found.s), array_of<double>(found.z), array_of<int64_t>(found.strip));
}

nb::object find_edge_turns(nb::tuple corners, nb::handle bearings,
                           const std::tuple<int64_t, double, double, double, int64_t, double, int64_t, double> &limits,
                           int64_t max_turns) {
    if (corners.size() != 3) refuse("corners: expected three arrays, got " + std::to_string(corners.size()));
    Input<double, 1> s(corners[0], "corners[0]"), z(corners[1], "corners[1]");
    Input<int64_t, 1> strip(corners[2], "corners[2]");
    check_length(z, "corners[1]", s.size());
    check_length(strip, "corners[2]", s.size());
    Input<double, 1> bearing(bearings, "bearing");
    check_strips(strip, "corners[2]", bearing.size());
    const auto [max_strips, max_height, max_height_slope, max_turn, num_bins, reach, min_pairs, min_apart] = limits;
    if (num_bins < 1) refuse("limits: expected at least one bin, got none");
    std::vector<double> turns;
    {
        nb::gil_scoped_release release;
        std::vector<std::vector<size_t>> of_strip(bearing.size());
        for (size_t i = 0; i < s.size(); ++i) of_strip[static_cast<size_t>(strip[i])].push_back(i);
        std::vector<std::array<double, 2>> pairs;  // angle, and how far it reaches across
        std::vector<double> counts(static_cast<size_t>(num_bins), 0.0), smooth(counts.size());
        const double per_turn = static_cast<double>(num_bins) / PI;
        for (size_t i = 0; i < s.size(); ++i) {
            const int64_t last = std::min(strip[i] + max_strips, static_cast<int64_t>(bearing.size()) - 1);
            const double from = bearing[static_cast<size_t>(strip[i])] * s[i];
            for (int64_t other = strip[i] + 1; other <= last; ++other)
                for (const size_t j : of_strip[static_cast<size_t>(other)]) {
                    if (!(std::abs(z[i] - z[j]) < max_height + max_height_slope * s[j])) continue;
                    const double across = from - bearing[static_cast<size_t>(other)] * s[j];
                    if (!(across > 0)) continue;
                    const double angle = -std::atan2(s[i] - s[j], across);
                    if (!(std::abs(angle) < max_turn)) continue;
                    pairs.push_back({angle, across});
                    const double bin = std::floor((angle + PI / 2) * per_turn);
                    counts[static_cast<size_t>(std::clamp(bin, 0.0, static_cast<double>(num_bins - 1)))] += 1.0;
                }
        }
        const size_t size = counts.size();
        std::vector<size_t> order(size);
        for (size_t k = 0; k < size; ++k) {
            smooth[k] = counts[k] + 0.5 * (counts[(k + size - 1) % size] + counts[(k + 1) % size]);
            order[k] = k;
        }
        std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return smooth[a] > smooth[b]; });
        std::vector<std::array<double, 2>> near;
        for (const size_t peak : order) {
            const double center = (static_cast<double>(peak) + 0.5) * PI / static_cast<double>(size) - PI / 2;
            if (static_cast<int64_t>(turns.size()) >= max_turns) break;
            near.clear();
            for (const auto &pair : pairs)
                if (std::abs(pair[0] - center) < reach) near.push_back(pair);
            if (static_cast<int64_t>(near.size()) < std::max<int64_t>(min_pairs, 1)) break;
            std::stable_sort(near.begin(), near.end(), [](const auto &a, const auto &b) { return a[0] < b[0]; });
            double total = 0.0, half = 0.0;
            for (const auto &pair : near) total += pair[1];
            size_t middle = 0;
            while (middle + 1 < near.size() && half + near[middle][1] < 0.5 * total) half += near[middle++][1];
            const double turn = near[middle][0];
            const bool is_new = std::all_of(turns.begin(), turns.end(), [&, apart = min_apart](double known) {
                return std::abs(turn - known) > apart;
            });
            if (is_new) turns.push_back(turn);
        }
    }
    return array_of<double>(turns);
}

}  // namespace stairmap
