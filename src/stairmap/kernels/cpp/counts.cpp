// Turn rays, and count what they say for and against each step of a prediction, or for a flat surface.
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels.hpp"
#include "table.hpp"

namespace stairmap {

namespace {

constexpr int64_t OWN = 1, BESIDE = 2;

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

nb::tuple count_rays(nb::tuple ray_arrays, nb::tuple table_arrays, nb::tuple entries, int64_t num_steps,
                     const std::tuple<double, int64_t, double> &limits) {
    const Rays rays(ray_arrays);
    const Table table(table_arrays);
    check_count(entries, "entries", 4, "four");
    Input<double, 1> tolerance(entries[0], "entries[0]");
    Input<int64_t, 1> step(entries[1], "entries[1]"), role(entries[2], "entries[2]");
    Input<bool, 1> is_plain(entries[3], "entries[3]");
    check_length(step, "entries[1]", tolerance.size());
    check_length(role, "entries[2]", tolerance.size());
    check_length(is_plain, "entries[3]", tolerance.size());
    check_length(tolerance, "entries[0]", table.size());
    if (num_steps < 1) refuse("num_steps: expected at least 1, got " + std::to_string(num_steps));
    for (size_t i = 0; i < step.size(); ++i)
        if (step[i] >= num_steps)
            refuse("entries[1]: expected steps below " + std::to_string(num_steps) + ", got others");
    const auto [side_share, min_rays, least_expected] = limits;
    const size_t count = rays.size(), n = static_cast<size_t>(num_steps);
    Output<int64_t> counts({6, n});
    Output<bool> inside({count});
    Output<double> least({count});
    {
        nb::gil_scoped_release release;
        std::vector<size_t> entry(count);
        std::vector<double> across(count);
        std::vector<char> relation(count);  // 0 on, 1 nearer, 2 farther, 3 unmeasured, 4 none of these
        std::vector<std::vector<double>> on_step(n);
        for (size_t i = 0; i < count; ++i) {
            const size_t at = table.entry(rays.slope[i]);
            const double q = rays.q[i], predicted = table.expected(rays.slope[i], at), off = q - predicted;
            entry[i] = at;
            least[i] = std::max(predicted, table.farthest[at]);
            across[i] = rays.bearing[i] / std::max(predicted, least_expected);
            const double limit = tolerance[at];
            relation[i] = !(q > 0) ? 3 : std::abs(off) < limit ? 0 : off >= limit ? 1 : off <= -limit ? 2 : 4;
            if (relation[i] == 0 && role[at] == OWN && step[at] >= 0)
                on_step[static_cast<size_t>(step[at])].push_back(across[i]);
        }
        // The medians of the steps' sides, so that a floor that is wider, or a step that is cut, does not decide.
        std::vector<double> rights, lefts;
        for (auto &mine : on_step) {
            const int64_t num = static_cast<int64_t>(mine.size());
            const int64_t few = static_cast<int64_t>(side_share * static_cast<double>(num));
            if (num < min_rays || few < 0 || num - 1 - few < 0 || few >= num) continue;
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
            if (!inside[i] || !is_plain[at] || step[at] < 0 || relation[i] == 4) continue;
            const size_t place = static_cast<size_t>(step[at]);
            if (role[at] == OWN) ++counts[static_cast<size_t>(relation[i]) * n + place];
            if (role[at] == BESIDE && relation[i] == 0) ++counts[4 * n + place];
            if (role[at] == BESIDE && relation[i] == 2) ++counts[5 * n + place];
        }
    }
    return nb::make_tuple(counts.object(), inside.object(), least.object());
}

nb::object count_continuations(nb::tuple ray_arrays, nb::tuple seen, nb::tuple order, nb::tuple surfaces,
                               const std::array<double, 5> &limits) {
    const Rays rays(ray_arrays);
    check_count(seen, "seen", 2, "two");
    Input<double, 1> least(seen[0], "seen[0]");
    Input<bool, 1> usable(seen[1], "seen[1]");
    check_length(usable, "seen[1]", least.size());
    check_length(least, "seen[0]", rays.size());
    check_count(order, "order", 2, "two");
    Input<int64_t, 1> steps(order[0], "order[0]");
    Input<double, 1> nosing(order[1], "order[1]");
    check_length(nosing, "order[1]", steps.size());
    check_count(surfaces, "surfaces", 2, "two");
    Input<double, 2> upper(surfaces[0], "surfaces[0]"), lower(surfaces[1], "surfaces[1]");
    const size_t n = upper.shape(1);
    check_length(upper, "surfaces[0]", 3);
    check_length(lower, "surfaces[1]", 2);
    check_length(lower, "surfaces[1]", n, 1);
    for (size_t i = 0; i < steps.size(); ++i)
        if (steps[i] < 0 || static_cast<uint64_t>(steps[i]) >= n)
            refuse("order[0]: expected steps below " + std::to_string(n) + ", got others");
    const auto [noise, min_difference, tolerance, num_sigma, max_share] = limits;
    Output<int64_t> counts({2, 2, n});
    {
        nb::gil_scoped_release release;
        const auto count = [&, noise = noise, min_difference = min_difference, tolerance = tolerance,
                            num_sigma = num_sigma, max_share = max_share](size_t row, size_t step, double surface,
                                                                          double q, double stairs) {
            // Only where the two can be told apart; what is nearer than both hides them.
            if (!(surface - stairs > min_difference * noise)) return;
            const double near = tolerance * (surface * surface) + num_sigma * noise;
            if (!(q < surface + std::min(near, max_share * surface))) return;
            const bool goes_on = q > 0.5 * (surface + stairs);
            ++counts[(2 * row + (goes_on ? 0 : 1)) * n + step];
        };
        const double *first = nosing.data(), *end = first + nosing.size();
        for (size_t i = 0; i < rays.size() && first != end; ++i) {
            if (!usable[i] || !(rays.q[i] > 0)) continue;
            const double tau = rays.slope[i];
            const size_t place = static_cast<size_t>(std::lower_bound(first, end, tau) - first);
            if (place > 0) {
                const size_t above = static_cast<size_t>(steps[place - 1]);
                if (tau < upper[above]) count(0, above, upper[n + above] + upper[2 * n + above] * tau, rays.q[i], least[i]);
            }
            if (place < nosing.size()) {
                const size_t beneath = static_cast<size_t>(steps[place]);
                if (tau > lower[beneath]) count(1, beneath, lower[n + beneath] * tau, rays.q[i], least[i]);
            }
        }
    }
    return counts.object();
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
