// Join corners of neighbouring scans, and search the lattices on which what was joined lies.
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

struct Limits {
    double min_rise, max_rise, min_run, max_run, min_pitch, max_pitch;
    int64_t max_steps, min_shared;
    double max_distance, max_height, noise, max_spread, growth;
    int64_t max_index, max_size;
    double gap_cost;
    int64_t max_gap;
};

struct Places {
    const double *distance, *height;
    const bool *strips;
    size_t count, num_strips;
    std::vector<double> size, spread;
    std::vector<int64_t> overlap;

    int64_t shared(size_t i, size_t j) const { return overlap[i * count + j]; }
};

struct Pair {  // that suggests a lattice
    double run = 0.0, rise = 0.0, score = 0.0;
    int64_t anchor = -1, num_present = 0;
};

// The index of a nosing on a lattice; false where it does not lie on it.
bool index_on(const Places &places, const Limits &limits, double run, double rise, size_t anchor, size_t k, int64_t &index) {
    const double s = places.distance[k] - places.distance[anchor], z = places.height[k] - places.height[anchor];
    const double place = (s * run + z * rise) / (run * run + rise * rise), most = static_cast<double>(limits.max_index);
    if (!(std::abs(place) < most)) return false;
    index = std::lrint(place);
    const double whole = static_cast<double>(index), far = std::abs(whole), growth = 1.0 + limits.growth * far;
    return far < most && std::abs(s - whole * run) < (limits.max_distance + places.spread[k]) * growth &&
           std::abs(z - whole * rise) < (limits.max_height + 0.5 * places.spread[k]) * std::min(growth, 2.0);
}

Pair find_best_pair(const Places &places, const std::vector<char> &free, const Limits &limits) {
    Pair best;
    const size_t count = places.count;
    const auto most = static_cast<size_t>(limits.max_index);
    std::vector<double> per_index(2 * most);
    std::vector<size_t> members;
    for (size_t lower = 0; lower < count; ++lower) {
        if (!free[lower]) continue;
        members.clear();
        for (size_t k = 0; k < count; ++k)
            if (free[k] && places.shared(lower, k) >= 1) members.push_back(k);
        for (size_t upper = 0; upper < count; ++upper) {
            if (!free[upper] || !(places.height[upper] - places.height[lower] > limits.min_rise)) continue;
            if (places.shared(lower, upper) < limits.min_shared) continue;
            for (int64_t steps = 1; steps <= limits.max_steps; ++steps) {
                const double run = (places.distance[upper] - places.distance[lower]) / static_cast<double>(steps);
                const double rise = (places.height[upper] - places.height[lower]) / static_cast<double>(steps);
                const double level = std::abs(run);
                if (!(rise > limits.min_rise && rise < limits.max_rise && level > limits.min_run && level < limits.max_run))
                    continue;
                const double pitch = std::atan2(rise, level);
                if (!(pitch > limits.min_pitch && pitch < limits.max_pitch)) continue;
                std::fill(per_index.begin(), per_index.end(), 0.0);
                for (const size_t k : members) {
                    int64_t index;
                    if (!index_on(places, limits, run, rise, lower, k, index)) continue;
                    double &mine = per_index[static_cast<size_t>(index + limits.max_index)];
                    mine = std::max(mine, places.size[k]);
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
                const double score = total - limits.gap_cost * gaps * typical;
                if (best.anchor >= 0 && !(score > best.score)) continue;
                best = {run, rise, score, static_cast<int64_t>(lower), num_present};
            }
        }
    }
    return best;
}

// Nosings on a lattice with their indices, from the first on; of its largest part where gaps are long.
struct Members {
    std::vector<size_t> nosing;
    std::vector<int64_t> index;
};

Members find_members(const Places &places, const std::vector<char> &free, const Pair &pair, const Limits &limits,
                     double &score) {
    Members all;
    const size_t anchor = static_cast<size_t>(pair.anchor);
    std::vector<double> largest(2 * static_cast<size_t>(limits.max_index), 0.0);
    for (size_t k = 0; k < places.count; ++k) {
        int64_t index;
        if (!free[k] || places.shared(anchor, k) < 1) continue;
        if (!index_on(places, limits, pair.run, pair.rise, anchor, k, index)) continue;
        all.nosing.push_back(k);
        all.index.push_back(index);
        double &mine = largest[static_cast<size_t>(index + limits.max_index)];
        mine = std::max(mine, places.size[k]);
    }
    // Parts between gaps: first and last index, number of indices and sum of their sizes.
    struct Part {
        int64_t first, last, number;
        double total;
    };
    std::vector<Part> parts;
    for (size_t k = 0; k < largest.size(); ++k) {
        if (!(largest[k] > 0)) continue;
        const int64_t index = static_cast<int64_t>(k) - limits.max_index;
        if (parts.empty() || index - parts.back().last > limits.max_gap + 1) parts.push_back({index, index, 0, 0.0});
        parts.back().last = index;
        ++parts.back().number;
        parts.back().total += largest[k];
    }
    const Part *chosen = nullptr;
    for (const Part &part : parts)
        if (part.number > 1 && (chosen == nullptr || part.total > chosen->total)) chosen = &part;
    score = pair.score;
    if (parts.size() > 1 && chosen != nullptr) {
        const double number = static_cast<double>(chosen->number);
        const double gaps = static_cast<double>(chosen->last - chosen->first + 1 - chosen->number);
        score = chosen->total - limits.gap_cost * gaps * (chosen->total / number);
        Members inside;
        for (size_t i = 0; i < all.nosing.size(); ++i)
            if (all.index[i] >= chosen->first && all.index[i] <= chosen->last) {
                inside.nosing.push_back(all.nosing[i]);
                inside.index.push_back(all.index[i]);
            }
        all = std::move(inside);
    }
    const int64_t lowest = *std::min_element(all.index.begin(), all.index.end());
    for (int64_t &index : all.index) index -= lowest;
    return all;
}

// Step and start of the weighted line value = start + index * step.
std::array<double, 2> fit_line(const Members &members, const double *value, const std::vector<double> &weight,
                               double fallback) {
    double total = 0.0, mean_index = 0.0, mean_value = 0.0, spread = 0.0, product = 0.0;
    for (size_t i = 0; i < weight.size(); ++i) {
        total += weight[i];
        mean_index += static_cast<double>(members.index[i]) * weight[i];
        mean_value += value[members.nosing[i]] * weight[i];
    }
    mean_index /= total, mean_value /= total;
    for (size_t i = 0; i < weight.size(); ++i) {
        const double off = static_cast<double>(members.index[i]) - mean_index;
        spread += off * off * weight[i];
        product += off * (value[members.nosing[i]] - mean_value) * weight[i];
    }
    spread /= total, product /= total;
    const double step = spread < 1e-9 ? fallback : product / spread;
    return {step, mean_value - mean_index * step};
}

}  // namespace

nb::tuple join_corners(nb::tuple corners, int64_t num_strips,
                       const std::tuple<double, double, double, double, int64_t, int64_t> &limits) {
    if (corners.size() != 3) refuse("corners: expected three arrays, got " + std::to_string(corners.size()));
    Input<double, 1> distance(corners[0], "corners[0]"), height(corners[1], "corners[1]");
    Input<int64_t, 1> strip(corners[2], "corners[2]");
    const size_t count = distance.size(), num_all = static_cast<size_t>(std::max<int64_t>(num_strips, 0));
    check_length(height, "corners[1]", count);
    check_length(strip, "corners[2]", count);
    check_strips(strip, "corners[2]", num_all);
    const auto [least, noise, max_distance, max_height, max_gap, min_strips] = limits;
    std::vector<double> distances, heights;
    std::vector<std::vector<char>> seen;
    {
        nb::gil_scoped_release release;
        std::vector<size_t> order(count), parent(count);
        std::vector<double> along(count), up(count);
        for (size_t i = 0; i < count; ++i) {
            const double reach = least + noise * (distance[i] * distance[i]);
            along[i] = std::min(reach, max_distance), up[i] = std::min(reach, max_height);
        }
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
        std::vector<size_t> number(count, count);
        std::vector<double> sizes;
        for (size_t i = 0; i < count; ++i) {
            size_t &mine = number[root_of(parent, i)];
            if (mine == count) {
                mine = sizes.size();
                sizes.push_back(0.0), distances.push_back(0.0), heights.push_back(0.0);
                seen.emplace_back(num_all, 0);
            }
            sizes[mine] += 1.0, distances[mine] += distance[i], heights[mine] += height[i];
            seen[mine][static_cast<size_t>(strip[i])] = 1;
        }
        size_t kept = 0;
        for (size_t i = 0; i < sizes.size(); ++i) {
            if (std::count(seen[i].begin(), seen[i].end(), 1) < min_strips) continue;
            distances[kept] = distances[i] / sizes[i], heights[kept] = heights[i] / sizes[i];
            if (kept != i) seen[kept] = std::move(seen[i]);
            ++kept;
        }
        distances.resize(kept), heights.resize(kept), seen.resize(kept);
    }
    Output<double> mean_distance({distances.size()}), mean_height({heights.size()});
    Output<bool> strips({seen.size(), num_all});
    std::copy(distances.begin(), distances.end(), mean_distance.data());
    std::copy(heights.begin(), heights.end(), mean_height.data());
    for (size_t i = 0; i < seen.size(); ++i)
        for (size_t k = 0; k < num_all; ++k) strips[i * num_all + k] = seen[i][k] != 0;
    return nb::make_tuple(mean_distance.object(), mean_height.object(), strips.object());
}

nb::tuple search_lattices(nb::tuple nosings,
                          const std::tuple<double, double, double, double, double, double, int64_t, int64_t, double,
                                           double, double, double, double, int64_t, int64_t, double, int64_t> &limit_values,
                          int64_t max_lattices) {
    if (nosings.size() != 3) refuse("nosings: expected three arrays, got " + std::to_string(nosings.size()));
    Input<double, 1> distance(nosings[0], "nosings[0]"), height(nosings[1], "nosings[1]");
    Input<bool, 2> strips(nosings[2], "nosings[2]");
    const size_t count = distance.size(), num_strips = strips.shape(1);
    check_length(height, "nosings[1]", count);
    check_length(strips, "nosings[2]", count);
    const Limits limits = std::apply([](auto... values) { return Limits{values...}; }, limit_values);
    if (limits.max_index < 1) refuse("limits: expected at least one index, got none");
    const size_t num_indices = 2 * static_cast<size_t>(limits.max_index);
    std::vector<std::array<double, 5>> numbers;
    std::vector<Members> found;
    {
        nb::gil_scoped_release release;
        Places places{distance.data(), height.data(), strips.data(), count, num_strips, {}, {}, {}};
        places.size.resize(count), places.spread.resize(count), places.overlap.assign(count * count, 0);
        for (size_t i = 0; i < count; ++i) {
            for (size_t j = i; j < count; ++j) {
                const bool *a = strips.data() + i * num_strips, *b = strips.data() + j * num_strips;
                int64_t shared = 0;
                for (size_t k = 0; k < num_strips; ++k) shared += a[k] & b[k];
                places.overlap[i * count + j] = places.overlap[j * count + i] = shared;
            }
            places.size[i] = static_cast<double>(std::min(places.overlap[i * count + i], limits.max_size));
            places.spread[i] = std::min(2.0 * limits.noise * (distance[i] * distance[i]), limits.max_spread);
        }
        std::vector<char> free(count, 1);
        size_t num_free = count;
        while (static_cast<int64_t>(numbers.size()) < max_lattices && num_free >= 2) {
            const Pair pair = find_best_pair(places, free, limits);
            if (pair.num_present < 2) break;
            double score;
            Members members = find_members(places, free, pair, limits, score);
            std::vector<double> weight;
            for (const size_t k : members.nosing) {
                weight.push_back(static_cast<double>(places.overlap[k * count + k]));
                free[k] = 0;
                --num_free;
            }
            const auto [run, start_s] = fit_line(members, distance.data(), weight, pair.run);
            const auto [rise, start_z] = fit_line(members, height.data(), weight, pair.rise);
            numbers.push_back({start_s, start_z, run, rise, score});
            found.push_back(std::move(members));
        }
    }
    Output<double> lines({numbers.size(), 5});
    Output<bool> presence({numbers.size(), num_indices}), seen({numbers.size(), num_strips});
    for (size_t i = 0; i < numbers.size(); ++i) {
        std::copy(numbers[i].begin(), numbers[i].end(), lines.data() + 5 * i);
        for (size_t k = 0; k < found[i].nosing.size(); ++k) {
            presence[i * num_indices + static_cast<size_t>(found[i].index[k])] = true;
            for (size_t strip = 0; strip < num_strips; ++strip)
                seen[i * num_strips + strip] |= strips[found[i].nosing[k] * num_strips + strip];
        }
    }
    return nb::make_tuple(lines.object(), presence.object(), seen.object());
}

}  // namespace stairmap
