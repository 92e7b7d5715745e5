// Join corners of neighbouring scans, and score lattices of what was joined.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "kernels.hpp"

namespace stairmap {

namespace {

size_t root_of(std::vector<size_t> &parent, size_t place) {
    while (parent[place] != place) place = parent[place] = parent[parent[place]];
    return place;
}

}  // namespace

nb::object label_close(nb::tuple corners, nb::tuple reach, int64_t max_gap) {
    if (corners.size() != 3) refuse("corners: expected three arrays, got " + std::to_string(corners.size()));
    if (reach.size() != 2) refuse("reach: expected two arrays, got " + std::to_string(reach.size()));
    Input<double, 1> distance(corners[0], "corners[0]"), height(corners[1], "corners[1]");
    Input<int64_t, 1> strip(corners[2], "corners[2]");
    const size_t count = distance.size();
    check_length(height, "corners[1]", count);
    check_length(strip, "corners[2]", count);
    Input<double, 1> along(reach[0], "reach[0]"), up(reach[1], "reach[1]");
    check_length(up, "reach[1]", along.size());
    check_length(along, "reach[0]", count);
    Output<int64_t> labels({count});
    {
        nb::gil_scoped_release release;
        std::vector<size_t> order(count), parent(count);
        std::iota(order.begin(), order.end(), size_t{0});
        std::iota(parent.begin(), parent.end(), size_t{0});
        std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return strip[a] < strip[b]; });
        for (size_t i = 0; i < count; ++i)
            for (size_t j = i + 1; j < count; ++j) {
                const size_t a = order[i], b = order[j];
                if (strip[b] - strip[a] > max_gap) break;
                const double ds = std::abs(distance[a] - distance[b]), dz = std::abs(height[a] - height[b]);
                if (!((ds < along[a] && dz < up[a]) || (ds < along[b] && dz < up[b]))) continue;
                // The first corner of a group is its root.
                const size_t first = root_of(parent, a), second = root_of(parent, b);
                parent[std::max(first, second)] = std::min(first, second);
            }
        std::vector<int64_t> number(count, -1);
        int64_t next = 0;
        for (size_t i = 0; i < count; ++i) {
            int64_t &mine = number[root_of(parent, i)];
            if (mine < 0) mine = next++;
            labels[i] = mine;
        }
    }
    return labels.object();
}

nb::tuple score_lattices(nb::tuple places, nb::handle strip_masks, nb::handle free_mask,
                         const std::tuple<double, double, double, double, double, double, int64_t, int64_t, double,
                                          double, double, double, double, int64_t, double> &limits) {
    if (places.size() != 3) refuse("places: expected three arrays, got " + std::to_string(places.size()));
    Input<double, 1> distance(places[0], "places[0]"), height(places[1], "places[1]"), size(places[2], "places[2]");
    const size_t count = distance.size();
    check_length(height, "places[1]", count);
    check_length(size, "places[2]", count);
    Input<bool, 2> strips(strip_masks, "strips");
    Input<bool, 1> free(free_mask, "free");
    check_length(strips, "strips", count);
    check_length(free, "free", count);
    const auto [min_rise, max_rise, min_run, max_run, min_pitch, max_pitch, max_steps, min_shared, max_distance,
                max_height, noise, max_spread, growth_rate, max_index, gap_cost] = limits;
    double best_run = 0.0, best_rise = 0.0, best_score = 0.0;
    int64_t best_anchor = -1, best_present = 0;
    {
        nb::gil_scoped_release release;
        const size_t num_strips = strips.shape(1);
        std::vector<int64_t> overlap(count * count, 0);
        for (size_t i = 0; i < count; ++i)
            for (size_t j = i; j < count; ++j) {
                const bool *a = strips.data() + i * num_strips, *b = strips.data() + j * num_strips;
                int64_t shared = 0;
                for (size_t k = 0; k < num_strips; ++k) shared += a[k] & b[k];
                overlap[i * count + j] = overlap[j * count + i] = shared;
            }
        std::vector<double> spread(count), per_index(2 * static_cast<size_t>(max_index));
        for (size_t i = 0; i < count; ++i)
            spread[i] = std::min(2.0 * noise * (distance[i] * distance[i]), max_spread);
        std::vector<size_t> members;
        for (size_t lower = 0; lower < count; ++lower) {
            if (!free[lower]) continue;
            members.clear();
            for (size_t k = 0; k < count; ++k)
                if (free[k] && overlap[lower * count + k] >= 1) members.push_back(k);
            for (size_t upper = 0; upper < count; ++upper) {
                if (!free[upper] || !(height[upper] - height[lower] > min_rise)) continue;
                if (overlap[lower * count + upper] < min_shared) continue;
                for (int64_t steps = 1; steps <= max_steps; ++steps) {
                    const double run = (distance[upper] - distance[lower]) / static_cast<double>(steps);
                    const double rise = (height[upper] - height[lower]) / static_cast<double>(steps);
                    const double level = std::abs(run);
                    if (!(rise > min_rise && rise < max_rise && level > min_run && level < max_run)) continue;
                    const double pitch = std::atan2(rise, level);
                    if (!(pitch > min_pitch && pitch < max_pitch)) continue;
                    std::fill(per_index.begin(), per_index.end(), 0.0);
                    const double square = run * run + rise * rise;
                    for (const size_t k : members) {
                        const double s = distance[k] - distance[lower], z = height[k] - height[lower];
                        const double place = (s * run + z * rise) / square;
                        if (!(std::abs(place) < static_cast<double>(max_index))) continue;
                        const double index = static_cast<double>(std::lrint(place));
                        const double far = std::abs(index), growth = 1.0 + growth_rate * far;
                        if (!(far < static_cast<double>(max_index))) continue;
                        if (!(std::abs(s - index * run) < (max_distance + spread[k]) * growth)) continue;
                        if (!(std::abs(z - index * rise) < (max_height + 0.5 * spread[k]) * std::min(growth, 2.0)))
                            continue;
                        double &mine = per_index[static_cast<size_t>(index + static_cast<double>(max_index))];
                        mine = std::max(mine, size[k]);
                    }
                    int64_t first = -1, last = -1, num_present = 0;
                    double total = 0.0;
                    for (size_t k = 0; k < per_index.size(); ++k) {
                        if (!(per_index[k] > 0)) continue;
                        if (first < 0) first = static_cast<int64_t>(k);
                        last = static_cast<int64_t>(k);
                        ++num_present;
                        total += per_index[k];
                    }
                    const double gaps = static_cast<double>(first < 0 ? 0 : last - first + 1 - num_present);
                    const double typical = total / static_cast<double>(std::max<int64_t>(num_present, 1));
                    const double score = total - gap_cost * gaps * typical;
                    if (best_anchor >= 0 && !(score > best_score)) continue;
                    best_run = run, best_rise = rise, best_score = score;
                    best_anchor = static_cast<int64_t>(lower), best_present = num_present;
                }
            }
        }
    }
    return nb::make_tuple(best_run, best_rise, best_anchor, best_score, best_present);
}

}  // namespace stairmap
