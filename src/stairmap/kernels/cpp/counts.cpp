// Turn rays, and count what they say for and against each step of a prediction, or for a flat surface.
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels.hpp"
#include "section.hpp"
#include "table.hpp"

namespace stairmap {

namespace {

constexpr int64_t OWN = 1, BESIDE = 2;
constexpr int64_t RISER = 0, UNDERSIDE = 1, FRONT = 2, TREAD = 3;
constexpr double MAX_ENTRIES = 1e6;

struct Limits {
    double spacing, noise, tolerance, num_sigma, max_tolerance_share, side_share;
    int64_t min_rays;
    double least_expected, min_difference, max_hiding_share, continued_height, least_depth;
};

struct Told {  // of each entry of a table: how far rays may be off, of which step, in what role, away from edges or not
    std::vector<double> tolerance;
    const int64_t *step;
    std::vector<char> role, is_plain;
};

Told tell_entries(const TableView &table, const int64_t *surface, const int64_t *step, double run, double rise,
                  const Limits &limits) {
    Told told{std::vector<double>(table.count), step, std::vector<char>(table.count), std::vector<char>(table.count)};
    for (size_t i = 0; i < table.count; ++i) {
        const bool is_tread = surface[i] == TREAD, is_face = surface[i] == RISER || surface[i] == FRONT;
        const double most = (is_tread || surface[i] == UNDERSIDE ? rise : std::abs(run)) * limits.max_tolerance_share;
        told.tolerance[i] = std::min(limits.tolerance * table.sensitivity[i] + limits.num_sigma * limits.noise,
                                     most * table.sensitivity[i]);
        told.role[i] = run > 0 ? (is_face ? OWN : is_tread ? BESIDE : 0) : (is_tread ? OWN : 0);
        told.is_plain[i] = table.spread[i] < told.tolerance[i];
    }
    return told;
}

// Counts rays on, nearer, farther and unmeasured of what tells each step, then on and farther of what is beside it.
void count_on_steps(const RaysView &rays, const TableView &table, const Told &told, size_t n, const Limits &limits,
                    int64_t *counts, std::vector<char> &inside, std::vector<double> &least) {
    const size_t count = rays.count;
    std::vector<size_t> entry(count);
    std::vector<double> across(count);
    std::vector<char> relation(count);  // 0 on, 1 nearer, 2 farther, 3 unmeasured, 4 none of these
    std::vector<std::vector<double>> on_step(n);
    for (size_t i = 0; i < count; ++i) {
        const size_t at = table.entry(rays.slope[i]);
        const double q = rays.q[i], predicted = table.expected(rays.slope[i], at), off = q - predicted;
        entry[i] = at;
        least[i] = std::max(predicted, table.farthest[at]);
        across[i] = rays.bearing[i] / std::max(predicted, limits.least_expected);
        const double limit = told.tolerance[at];
        relation[i] = !(q > 0) ? 3 : std::abs(off) < limit ? 0 : off >= limit ? 1 : off <= -limit ? 2 : 4;
        if (relation[i] == 0 && told.role[at] == OWN && told.step[at] >= 0)
            on_step[static_cast<size_t>(told.step[at])].push_back(across[i]);
    }
    // The medians of the steps' sides, so that a floor that is wider, or a step that is cut, does not decide.
    std::vector<double> rights, lefts;
    for (auto &mine : on_step) {
        const int64_t num = static_cast<int64_t>(mine.size());
        const int64_t few = static_cast<int64_t>(limits.side_share * static_cast<double>(num));
        if (num < limits.min_rays || few < 0 || num - 1 - few < 0 || few >= num) continue;
        const auto value_at = [&](int64_t place) {
            std::nth_element(mine.begin(), mine.begin() + place, mine.end());
            return mine[static_cast<size_t>(place)];
        };
        rights.push_back(value_at(few));
        lefts.push_back(value_at(num - 1 - few));
    }
    const bool is_known = !lefts.empty();
    const double right = is_known ? median_of(rights) : INFINITY, left = is_known ? median_of(lefts) : -INFINITY;
    for (size_t i = 0; i < count; ++i) {
        inside[i] = across[i] >= right && across[i] <= left;
        const size_t at = entry[i];
        if (!inside[i] || !told.is_plain[at] || told.step[at] < 0 || relation[i] == 4) continue;
        const size_t place = static_cast<size_t>(told.step[at]);
        if (told.role[at] == OWN) ++counts[static_cast<size_t>(relation[i]) * n + place];
        if (told.role[at] == BESIDE && relation[i] == 0) ++counts[4 * n + place];
        if (told.role[at] == BESIDE && relation[i] == 2) ++counts[5 * n + place];
    }
}

// Nosings in the order in which they are seen, and the surfaces above and beneath each that would go on.
struct Surfaces {
    std::vector<size_t> order;
    std::vector<double> nosing;  // slopes, ascending
    // Of each step: up to which slope, offset and steepness above it; from which slope, and steepness beneath it.
    std::vector<double> upper_end, upper_offset, upper_by, lower_end, lower_by;
};

Surfaces surfaces_about(const double *distances, const double *heights, size_t n, double run, double rise,
                        double min_forward, const Limits &limits) {
    Surfaces found;
    double highest = -INFINITY;
    for (size_t i = 0; i < n; ++i) {
        const size_t k = run > 0 ? i : n - 1 - i;
        if (!(distances[k] > min_forward)) continue;
        highest = std::max(highest, heights[k + 1] / std::max(distances[k], min_forward));
        found.order.push_back(k);
        found.nosing.push_back(highest);
    }
    for (size_t k = 0; k < n; ++k) {
        const double s = std::max(distances[k], min_forward), z = heights[k + 1];
        const double level = 1.0 / std::min(z, -limits.least_depth);
        found.lower_by.push_back(level);
        if (run > 0) {
            found.upper_end.push_back((z + limits.continued_height * rise) / s);
            found.upper_offset.push_back(1.0 / s), found.upper_by.push_back(0.0);
            found.lower_end.push_back(z < 0 ? heights[k] / s : INFINITY);
        } else {
            found.upper_end.push_back(z / (s + limits.continued_height * std::abs(run)));
            found.upper_offset.push_back(0.0), found.upper_by.push_back(level);
            found.lower_end.push_back(INFINITY);
        }
    }
    return found;
}

// Counts rays that see a surface go on where it should end, and that do not: above the nosings, then beneath them.
void count_going_on(const RaysView &rays, const std::vector<char> &usable, const std::vector<double> &least,
                    const Surfaces &surfaces, const Limits &limits, int64_t *counts) {
    const size_t n = surfaces.lower_by.size();
    const auto count = [&](size_t row, size_t step, double surface, double q, double stairs) {
        // Only where the two can be told apart; what is nearer than both hides them.
        if (!(surface - stairs > limits.min_difference * limits.noise)) return;
        const double near = limits.tolerance * (surface * surface) + limits.num_sigma * limits.noise;
        if (!(q < surface + std::min(near, limits.max_hiding_share * surface))) return;
        const bool goes_on = q > 0.5 * (surface + stairs);
        ++counts[(2 * row + (goes_on ? 0 : 1)) * n + step];
    };
    const auto first = surfaces.nosing.begin(), end = surfaces.nosing.end();
    for (size_t i = 0; i < rays.count && first != end; ++i) {
        if (!usable[i] || !(rays.q[i] > 0)) continue;
        const double tau = rays.slope[i];
        const size_t place = static_cast<size_t>(std::lower_bound(first, end, tau) - first);
        if (place > 0) {
            const size_t above = surfaces.order[place - 1];
            if (tau < surfaces.upper_end[above])
                count(0, above, surfaces.upper_offset[above] + surfaces.upper_by[above] * tau, rays.q[i], least[i]);
        }
        if (place < surfaces.nosing.size()) {
            const size_t beneath = surfaces.order[place];
            if (tau > surfaces.lower_end[beneath])
                count(1, beneath, surfaces.lower_by[beneath] * tau, rays.q[i], least[i]);
        }
    }
}

void check_count(const nb::tuple &arrays, const char *name, size_t expected, const char *word) {
    if (arrays.size() != expected)
        refuse(std::string(name) + ": expected " + word + " arrays, got " + std::to_string(arrays.size()));
}

}  // namespace

nb::tuple turn_rays(nb::tuple ray_arrays, double tilt, double roll, double turn) {
    const Rays rays(ray_arrays);
    Output<double> slope({rays.size()}), bearing({rays.size()}), q({rays.size()});
    {
        nb::gil_scoped_release release;
        for (size_t i = 0; i < rays.size(); ++i) {
            const double ahead = 1.0 - tilt * rays.slope[i] + turn * rays.bearing[i];
            slope[i] = (rays.slope[i] + tilt + roll * rays.bearing[i]) / ahead;
            bearing[i] = (rays.bearing[i] - roll * rays.slope[i] - turn) / ahead;
            q[i] = rays.q[i] / ahead;
        }
    }
    return nb::make_tuple(slope.object(), bearing.object(), q.object());
}

nb::object sum_risers(nb::tuple ray_arrays, nb::handle nosing_distances, const std::array<double, 7> &limits) {
    const Rays rays(ray_arrays);
    Input<double, 1> nosings(nosing_distances, "nosings");
    const size_t n = nosings.size();
    const auto [floor, rise, height_share, overhang, band, right, left] = limits;
    Output<double> sums({6, n});
    {
        nb::gil_scoped_release release;
        const double count = static_cast<double>(n);
        for (size_t i = 0; i < rays.size(); ++i) {
            if (!(rays.q[i] > 0)) continue;
            const double s = 1.0 / rays.q[i], z = rays.slope[i] / rays.q[i], t = rays.bearing[i] / rays.q[i];
            const double phase = (z - floor) / rise, place = std::floor(phase);
            if (!(place >= 0 && place < count && std::abs(phase - place - 0.5) < height_share)) continue;
            if (t < right || t > left) continue;
            const size_t step = static_cast<size_t>(place);
            if (!(std::abs(s - nosings[step] - overhang) < band)) continue;
            const double values[6] = {1.0, s, t, s * s, s * t, t * t};
            for (size_t k = 0; k < 6; ++k) sums[k * n + step] += values[k];
        }
    }
    return sums.object();
}

nb::tuple count_steps(nb::tuple ray_arrays, nb::tuple places, double rise, const std::array<double, 6> &shape,
                      bool is_open, const std::array<double, 8> &edges, const std::array<int64_t, 3> &kinds,
                      const std::array<double, 5> &section,
                      const std::tuple<double, double, double, double, double, double, int64_t, double, double, double,
                                       double, double> &limit_values) {
    const Rays all_rays(ray_arrays);
    check_count(places, "places", 2, "two");
    Input<double, 1> distances(places[0], "places[0]"), heights(places[1], "places[1]");
    if (distances.size() == 0) refuse("places[0]: expected at least one nosing, got none");
    check_length(heights, "places[1]", distances.size() + 1);
    const Limits limits = std::apply([](auto... values) { return Limits{values...}; }, limit_values);
    const size_t n = distances.size();
    Output<int64_t> counts({6, n}), continued({2, 2, n});
    if (all_rays.size() > 0) {
        nb::gil_scoped_release release;
        const RaysView rays = all_rays.view();
        const auto [lowest, highest] = std::minmax_element(rays.slope, rays.slope + rays.count);
        const double low = *lowest, spacing = limits.spacing;
        const double entries = std::min((*highest - low) / spacing, MAX_ENTRIES);
        const size_t count = static_cast<size_t>(std::max(static_cast<int64_t>(entries) + 2, int64_t{1}));
        std::vector<int64_t> surface(count), step(count);
        std::vector<double> slope(count), value(count), by_slope(count), sensitivity(count), spread(count), farthest(count);
        for (size_t i = 0; i < count; ++i) slope[i] = low + spacing * static_cast<double>(i);
        const Outline outline = outline_of(distances.data(), heights.data(), n, shape, is_open, section);
        predict_slopes(view_of(outline), slope.data(), count, edges, kinds,
                       {surface.data(), step.data(), value.data(), by_slope.data(), sensitivity.data(), spread.data(),
                        farthest.data(), nullptr});
        const TableView table{count,           count > 1 ? slope[1] - slope[0] : 1.0,
                              slope.data(),    value.data(),
                              by_slope.data(), sensitivity.data(),
                              spread.data(),   farthest.data()};
        const Told told = tell_entries(table, surface.data(), step.data(), shape[0], rise, limits);
        std::vector<char> inside(rays.count);
        std::vector<double> least(rays.count);
        count_on_steps(rays, table, told, n, limits, counts.data(), inside, least);
        count_going_on(rays, inside, least, surfaces_about(distances.data(), heights.data(), n, shape[0], rise, section[0], limits),
                       limits, continued.data());
    }
    return nb::make_tuple(counts.object(), continued.object());
}

nb::tuple compare_with_line(nb::tuple ray_arrays, nb::tuple table_arrays,
                            const std::tuple<double, double, double, double, double, double, double, int64_t,
                                             int64_t, double> &limits) {
    const Rays rays(ray_arrays);
    const Table table(table_arrays);
    const auto [low, high, right, left, noise, surface_std, tail, num_rounds, min_rays, least_expected] = limits;
    std::vector<double> tau, q, by_steps, variance, weight, by_flat;
    double cost_of_steps = 0.0, cost_of_line = 0.0;
    {
        nb::gil_scoped_release release;
        for (size_t i = 0; i < rays.size(); ++i) {
            if (!(rays.slope[i] > low && rays.slope[i] < high && rays.q[i] > 0)) continue;
            const size_t at = table.entry(rays.slope[i]);
            const double expected = table.expected(rays.slope[i], at);
            const double across = rays.bearing[i] / std::max(expected, least_expected);
            if (!(across > right && across < left)) continue;
            const double surface = surface_std * table.sensitivity[at];
            // What lies behind an edge may be as far as it likes.
            const double off = std::max(rays.q[i], table.farthest[at]) - expected;
            tau.push_back(rays.slope[i]);
            q.push_back(rays.q[i]);
            by_steps.push_back(off * off);
            variance.push_back(noise * noise + surface * surface);
        }
        const size_t count = tau.size();
        if (static_cast<int64_t>(count) >= min_rays && count > 0) {
            double middle = 0.0;
            for (const double value : tau) middle += value;
            middle /= static_cast<double>(count);
            for (double &value : tau) value -= middle;
            for (const double value : variance) weight.push_back(1.0 / value);
            by_flat.assign(count, 0.0);
            for (int64_t round = 0; round < num_rounds; ++round) {
                double total = 0.0, mean = 0.0, center = 0.0, spread = 0.0, steepness = 0.0;
                for (size_t i = 0; i < count; ++i)
                    total += weight[i], mean += weight[i] * q[i], center += weight[i] * tau[i];
                mean /= total, center /= total;
                for (size_t i = 0; i < count; ++i) {
                    const double x = tau[i] - center;
                    spread += weight[i] * (x * x);
                    steepness += weight[i] * x * (q[i] - mean);
                }
                steepness /= std::max(spread, 1e-12);
                for (size_t i = 0; i < count; ++i) {
                    const double off = q[i] - mean - steepness * (tau[i] - center);
                    by_flat[i] = off * off;
                    const double doubt = 1.0 + by_flat[i] / variance[i] / (tail * tail);
                    weight[i] = 1.0 / (variance[i] * (doubt * doubt));
                }
            }
            for (size_t i = 0; i < count; ++i) {
                const double steps = by_steps[i] / variance[i], line = by_flat[i] / variance[i];
                cost_of_steps += steps / (1.0 + steps / (tail * tail));
                cost_of_line += line / (1.0 + line / (tail * tail));
            }
        }
    }
    return nb::make_tuple(static_cast<int64_t>(tau.size()), cost_of_steps, cost_of_line);
}

}  // namespace stairmap
