// Fit a section of stairs to rays: rounds of robust Gauss-Newton over what its outline predicts.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels.hpp"
#include "section.hpp"
#include "table.hpp"

namespace stairmap {

namespace {

// Places of a section's values in the equations; each nosing's and each tread's own place follows.
enum Value { DISTANCE, HEIGHT, RUN, RISE, OVERHANG, THICKNESS, RAKE, GROUND, SLOPE, SHIFT, TILT, ROLL, TURN, NUM_VALUES };

struct Limits {
    double spacing;
    int64_t max_entries;
    double irregularity, floor_irregularity, step_tail, place_std, tail, back_rake_std, floor_before, level_behind,
        above_last, max_change, max_move, max_angle;
};

struct State {
    std::array<double, NUM_VALUES> values;
    std::vector<double> places;  // of n nosings, then of n + 1 treads

    size_t num_steps() const { return places.size() / 2; }
    double nosing(size_t k) const { return values[DISTANCE] + values[RUN] * static_cast<double>(k) + places[k]; }
    double tread(size_t r) const {  // from the floor on
        return values[HEIGHT] + values[RISE] * (static_cast<double>(r) - 1.0) + places[num_steps() + r];
    }
};

// Slopes between which rays are fitted: from a piece of floor before the stairs to the level behind.
std::array<double, 2> slope_range(const State &state, double nearest, const Limits &limits) {
    const size_t n = state.num_steps();
    const double run = std::abs(state.values[RUN]), rise = state.values[RISE];
    const double first = std::max(state.nosing(0), nearest), last = std::max(state.nosing(n - 1), nearest);
    const double floor = state.tread(0), top = state.tread(n);
    if (state.values[RUN] > 0) {
        const double low = floor / std::max(first - limits.floor_before * run, nearest);
        if (top < 0) return {low, top / (last + limits.level_behind * run)};
        return {low, (top + limits.above_last * rise) / last};
    }
    return {top / std::max(last - limits.floor_before * run, nearest), floor / (first + limits.level_behind * run)};
}

// The equations' values that an outline's value, or an angle, depends on, and by how much.
struct Links {
    std::array<size_t, 3> to;
    std::array<double, 3> by;
    size_t count;
};

std::vector<Links> find_links(size_t n, bool is_fine) {
    std::vector<Links> links;
    for (size_t k = 0; k < n; ++k)
        links.push_back({{DISTANCE, RUN, NUM_VALUES + k}, {1.0, static_cast<double>(k), 1.0}, is_fine ? 3u : 2u});
    for (size_t r = 0; r <= n; ++r)
        links.push_back(
            {{HEIGHT, RISE, NUM_VALUES + n + r}, {1.0, static_cast<double>(r) - 1.0, 1.0}, is_fine ? 3u : 2u});
    for (size_t value = OVERHANG; value < NUM_VALUES; ++value) links.push_back({{value, 0, 0}, {1.0, 0.0, 0.0}, 1});
    return links;
}

// Equations in `size` values from those of an outline's.
void link_equations(const std::vector<Links> &links, const std::vector<double> &own, const std::vector<double> &pull,
                    size_t size, std::vector<double> &matrix, std::vector<double> &vector) {
    const size_t count = links.size();
    std::vector<double> half(count * size, 0.0);
    for (size_t i = 0; i < count; ++i)
        for (size_t j = 0; j < count; ++j)
            for (size_t k = 0; k < links[j].count; ++k)
                half[i * size + links[j].to[k]] += own[i * count + j] * links[j].by[k];
    matrix.assign(size * size, 0.0);
    vector.assign(size, 0.0);
    for (size_t i = 0; i < count; ++i)
        for (size_t k = 0; k < links[i].count; ++k) {
            double *row = &matrix[links[i].to[k] * size];
            for (size_t j = 0; j < size; ++j) row[j] += links[i].by[k] * half[i * size + j];
            vector[links[i].to[k]] += links[i].by[k] * pull[i];
        }
}

void add_prior(const State &state, const double *mean, const double *std, const Limits &limits, size_t size,
               std::vector<double> &matrix, std::vector<double> &vector) {
    for (size_t i = 0; i < NUM_VALUES; ++i) {
        const double spread = i == RAKE && state.values[RAKE] < 0 ? limits.back_rake_std : std[i];
        const double information = 1.0 / (spread * spread);
        matrix[i * size + i] += information;
        vector[i] += information * (state.values[i] - mean[i]);
    }
    if (size == NUM_VALUES) return;
    const size_t n = state.num_steps(), count = state.places.size();
    const auto add = [&](size_t i, size_t j, double weight) {
        matrix[(NUM_VALUES + i) * size + NUM_VALUES + j] += weight;
        vector[NUM_VALUES + i] += weight * state.places[j];
    };
    for (size_t i = 0; i + 1 < count; ++i) {
        if (i + 1 == n) continue;  // the last nosing and the floor are no neighbours
        const double allowed = i == n ? limits.floor_irregularity : limits.irregularity;
        const double off = (state.places[i + 1] - state.places[i]) / allowed, share = off / limits.step_tail;
        const double weight = 1.0 / ((1.0 + share * share) * (allowed * allowed));
        add(i, i, weight), add(i + 1, i + 1, weight), add(i, i + 1, -weight), add(i + 1, i, -weight);
    }
    for (size_t i = 0; i < count; ++i) {
        if (i == n) continue;  // the floor is no step
        const double far = state.places[i] / limits.tail;
        add(i, i, 1.0 / (limits.place_std * limits.place_std + far * far));
    }
}

// Factors of a matrix, rows exchanged where another pivot is larger.
class Factors {
  public:
    Factors(std::vector<double> matrix, size_t size) : size_(size), rows_(std::move(matrix)), order_(size) {
        for (size_t i = 0; i < size_; ++i) order_[i] = i;
        for (size_t i = 0; i < size_; ++i) {
            size_t pivot = i;
            for (size_t k = i + 1; k < size_; ++k)
                if (std::abs(at(k, i)) > std::abs(at(pivot, i))) pivot = k;
            if (at(pivot, i) == 0.0) {
                is_regular_ = false;
                return;
            }
            if (pivot != i) {
                std::swap_ranges(&at(i, 0), &at(i, 0) + size_, &at(pivot, 0));
                std::swap(order_[i], order_[pivot]);
            }
            for (size_t k = i + 1; k < size_; ++k) {
                const double factor = at(k, i) / at(i, i);
                at(k, i) = factor;
                if (factor == 0.0) continue;
                for (size_t j = i + 1; j < size_; ++j) at(k, j) -= factor * at(i, j);
            }
        }
    }

    bool is_regular() const { return is_regular_; }

    std::vector<double> solved(const std::vector<double> &right) const {
        std::vector<double> x(size_);
        for (size_t i = 0; i < size_; ++i) {
            x[i] = right[order_[i]];
            for (size_t j = 0; j < i; ++j) x[i] -= at(i, j) * x[j];
        }
        for (size_t i = size_; i-- > 0;) {
            for (size_t j = i + 1; j < size_; ++j) x[i] -= at(i, j) * x[j];
            x[i] /= at(i, i);
        }
        return x;
    }

  private:
    double &at(size_t i, size_t j) { return rows_[i * size_ + j]; }
    double at(size_t i, size_t j) const { return rows_[i * size_ + j]; }

    size_t size_;
    std::vector<double> rows_;
    std::vector<size_t> order_;
    bool is_regular_ = true;
};

// Whether the fit has not run away from where it began.
bool is_sane(const State &state, const std::array<double, NUM_VALUES> &first, const Limits &limits) {
    const auto &values = state.values;
    const double run = values[RUN] / first[RUN], rise = values[RISE] / first[RISE];
    const double angle = std::max({std::abs(values[TILT]), std::abs(values[ROLL]), std::abs(values[TURN])});
    const bool is_finite = std::isfinite(values[DISTANCE] + values[HEIGHT] + values[SHIFT]);
    return is_finite && 1.0 / limits.max_change < run && run < limits.max_change && 1.0 / limits.max_change < rise &&
           rise < limits.max_change && std::abs(values[DISTANCE] - first[DISTANCE]) < limits.max_move * std::abs(first[RUN]) &&
           angle < limits.max_angle && !std::isnan(values[TILT] + values[ROLL] + values[TURN]);
}

// Predictions at evenly spaced slopes, in memory that rounds share.
struct Entries {
    std::vector<int64_t> surface, step;
    std::vector<double> slope, value, by_slope, sensitivity, spread, farthest, gradient;

    void resize(size_t count, size_t columns) {
        for (auto *integers : {&surface, &step}) integers->resize(count);
        for (auto *reals : {&slope, &value, &by_slope, &sensitivity, &spread, &farthest}) reals->resize(count);
        gradient.resize(count * columns);
    }
    PredictionTarget target() {
        return {surface.data(),     step.data(),   value.data(),    by_slope.data(),
                sensitivity.data(), spread.data(), farthest.data(), gradient.data()};
    }
    TableView view() const {
        return {slope.size(),    slope.size() > 1 ? slope[1] - slope[0] : 1.0,
                slope.data(),    value.data(),
                by_slope.data(), sensitivity.data(),
                spread.data(),   farthest.data()};
    }
};

}  // namespace

nb::tuple fit_section(nb::tuple ray_arrays, nb::tuple start, nb::tuple prior, nb::tuple rounds, bool is_open,
                      const std::array<double, 8> &edge_values, const std::array<int64_t, 3> &kinds,
                      const std::array<double, 5> &section, const std::array<double, 12> &equation_values,
                      const std::tuple<double, int64_t, double, double, double, double, double, double, double, double,
                                       double, double, double, double> &limit_values) {
    const Rays rays(ray_arrays);
    if (start.size() != 2) refuse("start: expected two arrays, got " + std::to_string(start.size()));
    Input<double, 1> first_values(start[0], "start[0]"), first_places(start[1], "start[1]");
    check_length(first_values, "start[0]", NUM_VALUES);
    if (first_places.size() < 3 || first_places.size() % 2 != 1)
        refuse("start[1]: expected an odd number of values above 1, got " + std::to_string(first_places.size()));
    if (prior.size() != 2) refuse("prior: expected two arrays, got " + std::to_string(prior.size()));
    Input<double, 1> mean(prior[0], "prior[0]"), std(prior[1], "prior[1]");
    check_length(std, "prior[1]", mean.size());
    check_length(mean, "prior[0]", NUM_VALUES);
    if (rounds.size() != 3) refuse("rounds: expected three values, got " + std::to_string(rounds.size()));
    Input<double, 1> coarse(rounds[0], "rounds[0]");
    if (coarse.size() == 0) refuse("rounds[0]: expected at least one round, got none");
    const int64_t num_coarse = nb::cast<int64_t>(rounds[1]);
    double noise = nb::cast<double>(rounds[2]), cost = 0.0;
    const Limits limits = std::apply([](auto... values) { return Limits{values...}; }, limit_values);

    State state;
    std::copy_n(first_values.data(), static_cast<size_t>(NUM_VALUES), state.values.begin());
    state.places.assign(first_places.data(), first_places.data() + first_places.size());
    const auto first = state.values;
    const size_t n = state.num_steps(), num_values = 2 * n + 6, num_own = num_values + 4;
    size_t size = 0;
    bool is_found = true;
    std::vector<double> matrix, vector, covariance;
    {
        nb::gil_scoped_release release;
        auto edges = edge_values;
        auto equations = equation_values;
        std::vector<double> distances(n), heights(n + 1), own(num_own * num_own), pull(num_own);
        Entries table;
        for (size_t round = 0; round < coarse.size() && is_found; ++round) {
            const auto [low, high] = slope_range(state, section[0], limits);
            const double count = (high - low) / limits.spacing;
            if (!(count < static_cast<double>(limits.max_entries))) {
                is_found = false;
                break;
            }
            const size_t num_slopes = static_cast<size_t>(std::max(static_cast<int64_t>(count) + 2, int64_t{1}));
            table.resize(num_slopes, num_values + 1);
            for (size_t i = 0; i < num_slopes; ++i) table.slope[i] = low + limits.spacing * static_cast<double>(i);
            for (size_t k = 0; k < n; ++k) distances[k] = state.nosing(k);
            for (size_t r = 0; r <= n; ++r) heights[r] = state.tread(r);
            const auto &v = state.values;
            const Outline outline = outline_of(distances.data(), heights.data(), n,
                                               {v[RUN], v[OVERHANG], v[THICKNESS], v[RAKE], v[GROUND], v[SLOPE]},
                                               is_open, section);
            edges[2] = v[SHIFT];
            predict_slopes(view_of(outline), table.slope.data(), num_slopes, edges, kinds, table.target());
            equations[8] = equation_values[8] + coarse[round] * coarse[round];
            const EquationSums sums = sum_rays(rays.view(), {v[TILT], v[ROLL], v[TURN], low, high}, table.view(),
                                               table.gradient.data(), num_values + 1, equations, round + 1 == coarse.size(),
                                               own.data(), pull.data());
            noise = sums.noise, cost = sums.cost;
            if (sums.weight < equations[6]) {
                is_found = false;
                break;
            }
            const bool is_fine = static_cast<int64_t>(round) >= num_coarse;
            size = NUM_VALUES + (is_fine ? state.places.size() : 0);
            link_equations(find_links(n, is_fine), own, pull, size, matrix, vector);
            add_prior(state, mean.data(), std.data(), limits, size, matrix, vector);
            const Factors factors(matrix, size);
            if (!factors.is_regular()) {
                is_found = false;
                break;
            }
            const std::vector<double> change = factors.solved(vector);
            for (size_t i = 0; i < NUM_VALUES; ++i) state.values[i] -= change[i];
            for (size_t i = NUM_VALUES; i < size; ++i) state.places[i - NUM_VALUES] -= change[i];
            is_found = is_sane(state, first, limits);
            if (!is_found || round + 1 < coarse.size()) continue;
            covariance.resize(size * size);
            std::vector<double> unit(size, 0.0);
            for (size_t j = 0; j < size; ++j) {
                unit[j] = 1.0;
                const std::vector<double> column = factors.solved(unit);
                unit[j] = 0.0;
                for (size_t i = 0; i < size; ++i) covariance[i * size + j] = column[i];
            }
        }
    }
    if (!is_found) size = 0;
    Output<double> values({size_t{NUM_VALUES}}), places({2 * n + 1}), inverse({size, size});
    std::copy(state.values.begin(), state.values.end(), values.data());
    std::copy(state.places.begin(), state.places.end(), places.data());
    if (is_found) std::copy(covariance.begin(), covariance.end(), inverse.data());
    else {
        std::copy(first.begin(), first.end(), values.data());
        std::copy_n(first_places.data(), first_places.size(), places.data());
        noise = nb::cast<double>(rounds[2]), cost = 0.0;
    }
    return nb::make_tuple(is_found, values.object(), places.object(), noise, cost, inverse.object());
}

}  // namespace stairmap
