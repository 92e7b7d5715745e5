// What is seen of a section of stairs: straight pieces in inverse forward distance, with their derivatives.
#include "section.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels.hpp"

namespace stairmap {

namespace {

constexpr double INF = std::numeric_limits<double>::infinity();
enum Surface { RISER = 0, UNDERSIDE = 1, FRONT = 2, TREAD = 3, BEHIND = 4 };

struct Section {
    const double *s, *z;  // nosings' distances (n), treads' heights from the floor on (n + 1)
    size_t n;
    double run, overhang, thickness, rake, ground, slope;
    bool is_open;
    double min_forward, behind_share, min_level, least_extent, min_extent;
};

// All surfaces in the order in which a path away from the camera meets them: four for each level.
class Pieces {
  public:
    explicit Pieces(const Section &section)
        : p(section),
          num_values(2 * section.n + 6),
          surface(4 * (section.n + 1)),
          end(4 * (section.n + 1), -INF),
          line(8 * (section.n + 1), 0.0),
          line_gradient(8 * (section.n + 1) * num_values, 0.0),
          end_gradient(4 * (section.n + 1) * num_values, 0.0) {
        for (size_t i = 0; i < surface.size(); ++i) surface[i] = static_cast<int64_t>(i % 4);
    }

    void add_ascending() {
        add_treads();
        std::vector<double> tread_end(p.n + 1);
        const double deep = p.run + p.overhang;
        for (size_t k = 0; k < p.n; ++k) tread_end[k] = p.z[k] / near(k);
        tread_end[p.n] = p.z[p.n] / (near(p.n - 1) + p.run);
        if (p.is_open) tread_end[0] = p.z[0] / (near(0) + p.behind_share * p.run);
        for (size_t k = 0; k < p.n; ++k) {
            const size_t r = k + 1;
            const double s = near(k), top = p.z[r], under = top - p.thickness;
            const bool is_above = under > 0, seen = p.s[k] > p.min_forward;
            set_line(r, FRONT, 1.0 / s, 0.0);
            line_by(r, FRONT, 0, nosing(k)) = -1.0 / (s * s);
            const double inverse = 1.0 / (is_above ? under : 1.0);
            set_line(r, UNDERSIDE, 0.0, inverse);
            line_by(r, UNDERSIDE, 1, level(r)) = -(inverse * inverse);
            line_by(r, UNDERSIDE, 1, thickness()) = inverse * inverse;
            double riser_end;
            if (p.is_open) {
                set_line(r, RISER, 1.0 / (s + p.behind_share * p.run), 0.0);
                surface[4 * r + RISER] = BEHIND;
                riser_end = under / (s + deep);
                tread_end[r] = top / (s + deep);
            } else {
                add_riser(r);
                riser_end = crossing(&line[2 * (4 * r + RISER)], &line[2 * (4 * r + UNDERSIDE)]);
                tread_end[k] = crossing(&line[2 * (4 * k + TREAD)], &line[2 * (4 * r + RISER)]);
            }
            // From above, the front's lower edge hides the top of the riser behind it.
            end[4 * r + RISER] = seen ? (is_above ? riser_end : under / s) : -INF;
            if (!is_above) set_nosing_slope(r, RISER, r, under, -1.0);
            end[4 * r + UNDERSIDE] = seen && is_above ? under / s : -INF;
            set_nosing_slope(r, UNDERSIDE, r, under, -1.0);
            end[4 * r + FRONT] = seen ? top / s : -INF;
            set_nosing_slope(r, FRONT, r, top, 0.0);
        }
        // From high above, it also hides the back of the tread below.
        for (size_t k = 0; k < p.n; ++k) {
            const double under = p.z[k + 1] - p.thickness;
            if (!(p.s[k] > p.min_forward && under / near(k) < tread_end[k])) continue;
            tread_end[k] = under / near(k);
            set_nosing_slope(k, TREAD, k + 1, under, -1.0);
        }
        for (size_t r = 0; r <= p.n; ++r) end[4 * r + TREAD] = p.z[r] < 0 ? tread_end[r] : -INF;
    }

    void add_descending() {
        add_treads();
        for (size_t k = 0; k < p.n; ++k) {
            const size_t r = k + 1;
            const bool seen = p.s[k] > p.min_forward && p.z[r] < 0;
            end[4 * r + TREAD] = seen ? p.z[r] / near(k) : -INF;
            set_nosing_slope(r, TREAD, r, p.z[r], 0.0);
        }
        end[TREAD] = p.z[0] < 0 ? p.z[0] / (near(0) - p.run) : -INF;
    }

    Outline visible() {
        const bool ascends = p.run > 0;
        std::vector<size_t> order;
        for (size_t i = 0; i <= p.n; ++i)
            for (size_t part = 0; part < 4; ++part) order.push_back(4 * (ascends ? i : p.n - i) + part);
        std::vector<bool> is_seen(order.size());
        double highest = -INF;
        for (size_t i = 0; i < order.size(); ++i) {
            const size_t at = order[i];
            const bool is_level = ascends && (surface[at] == TREAD || surface[at] == UNDERSIDE);
            is_seen[i] = end[at] > highest + (is_level ? p.min_extent : p.least_extent);
            highest = std::isnan(end[at]) || std::isnan(highest) ? NAN : std::max(highest, end[at]);
        }
        // A riser then ends where the front before it begins.
        for (size_t i = 0; i < order.size(); ++i) {
            const size_t at = order[i];
            if (surface[at] != UNDERSIDE || is_seen[i] || !std::isfinite(end[at])) continue;
            end[at - 1] = end[at];
            std::copy_n(&end_gradient[at * num_values], num_values, &end_gradient[(at - 1) * num_values]);
        }
        size_t count = 1;
        for (bool is_one : is_seen) count += is_one;
        Outline seen;
        seen.num_values = num_values;
        seen.surface.resize(count), seen.step.resize(count), seen.line.resize(2 * count), seen.top.resize(count);
        seen.line_gradient.assign(2 * count * num_values, 0.0);
        seen.top_gradient.assign(count * num_values, 0.0);
        size_t out = 0;
        for (size_t i = 0; i < order.size(); ++i) {
            if (!is_seen[i]) continue;
            const size_t at = order[i];
            seen.surface[out] = surface[at];
            seen.step[out] = static_cast<int64_t>(at / 4) - 1;
            std::copy_n(&line[2 * at], 2, &seen.line[2 * out]);
            seen.top[out] = end[at];
            std::copy_n(&line_gradient[2 * at * num_values], 2 * num_values,
                        &seen.line_gradient[2 * out * num_values]);
            std::copy_n(&end_gradient[at * num_values], num_values, &seen.top_gradient[out * num_values]);
            ++out;
        }
        const size_t last = ascends ? p.n - 1 : 0;
        seen.surface[out] = BEHIND;
        seen.step[out] = static_cast<int64_t>(last);
        seen.line[2 * out] = 1.0 / (near(last) + p.behind_share * std::abs(p.run));
        // The last level seen goes on for as long as nothing is known of its end.
        if (out > 0 && seen.surface[out - 1] == TREAD) std::copy_n(&seen.line[2 * out - 2], 2, &seen.line[2 * out]);
        seen.top[out] = INF;
        return seen;
    }

  private:
    double near(size_t k) const { return std::max(p.s[k], p.min_forward); }
    size_t nosing(size_t k) const { return k; }
    size_t level(size_t r) const { return p.n + r; }
    size_t overhang() const { return 2 * p.n + 1; }
    size_t thickness() const { return 2 * p.n + 2; }
    size_t rake() const { return 2 * p.n + 3; }
    size_t ground() const { return 2 * p.n + 4; }
    size_t slope() const { return 2 * p.n + 5; }

    double &line_by(size_t r, size_t part, size_t coefficient, size_t value) {
        return line_gradient[(2 * (4 * r + part) + coefficient) * num_values + value];
    }
    void set_line(size_t r, size_t part, double a, double b) {
        line[2 * (4 * r + part)] = a;
        line[2 * (4 * r + part) + 1] = b;
    }
    static double crossing(const double *lower, const double *upper) {
        return (upper[0] - lower[0]) / (lower[1] - upper[1]);
    }

    // Derivatives of the slope of a nosing, or of the lower edge of its front, where it ends a surface.
    void set_nosing_slope(size_t ended, size_t part, size_t r, double height, double by_thickness) {
        double *gradient = &end_gradient[(4 * ended + part) * num_values];
        const double s = near(r - 1);
        gradient[level(r)] = 1.0 / s;
        gradient[nosing(r - 1)] = -height / (s * s);
        gradient[thickness()] = by_thickness / s;
    }

    void add_riser(size_t r) {
        const size_t k = r - 1;
        const double foot =
            std::max(p.s[k] + p.overhang + p.rake * p.z[r], 0.5 * p.min_forward);
        set_line(r, RISER, 1.0 / foot, p.rake / foot);
        const size_t values[] = {nosing(k), overhang(), level(r), rake()};
        const double by[] = {1.0, 1.0, p.rake, p.z[r]};
        for (int i = 0; i < 4; ++i) {
            line_by(r, RISER, 0, values[i]) = -by[i] / (foot * foot);
            line_by(r, RISER, 1, values[i]) = -p.rake * by[i] / (foot * foot);
        }
        line_by(r, RISER, 1, rake()) += 1.0 / foot;
    }

    // Treads from -1, the floor, on; the floor's height is that where one more nosing would be.
    void add_treads() {
        const double sign = p.run > 0 ? 1.0 : -1.0;
        for (size_t r = 0; r <= p.n; ++r) {
            const double climb = sign * (p.ground + (r > 0 ? p.slope : 0.0));
            const double s = r == 0 ? p.s[0] - p.run : p.s[r - 1];
            const double height = p.z[r] - climb * s;
            const double inverse = 1.0 / (std::abs(height) > p.min_level ? height : -p.min_level);
            const double offset = -climb * inverse;
            set_line(r, TREAD, offset, inverse);
            line_by(r, TREAD, 1, level(r)) = -(inverse * inverse);
            line_by(r, TREAD, 0, level(r)) = -offset * inverse;
            const size_t values[] = {nosing(r == 0 ? 0 : r - 1), ground(), slope()};
            const double by[] = {-climb, -sign * s, r > 0 ? -sign * s : 0.0};
            const double direct[] = {0.0, sign, r > 0 ? sign : 0.0};
            for (int i = 0; i < 3; ++i) {
                line_by(r, TREAD, 1, values[i]) = -(inverse * inverse) * by[i];
                line_by(r, TREAD, 0, values[i]) = -(offset * by[i] + direct[i]) * inverse;
            }
        }
    }

    const Section &p;
    size_t num_values;
    std::vector<int64_t> surface;
    std::vector<double> end, line, line_gradient, end_gradient;
};

}  // namespace

Outline outline_of(const double *distances, const double *heights, size_t n, const std::array<double, 6> &shape,
                   bool is_open, const std::array<double, 5> &limits) {
    const Section section{distances, heights, n, shape[0], shape[1], shape[2], shape[3], shape[4], shape[5],
                          is_open, limits[0], limits[1], limits[2], limits[3], limits[4]};
    Pieces pieces(section);
    section.run > 0 ? pieces.add_ascending() : pieces.add_descending();
    return pieces.visible();
}

nb::tuple trace_outline(nb::handle distances, nb::handle heights, const std::array<double, 6> &shape,
                        bool is_open, const std::array<double, 5> &limits) {
    Input<double, 1> s(distances, "distances"), z(heights, "heights");
    if (s.size() == 0) refuse("distances: expected at least one nosing, got none");
    check_length(z, "heights", s.size() + 1);
    const Outline outline = outline_of(s.data(), z.data(), s.size(), shape, is_open, limits);
    const size_t count = outline.surface.size();
    Output<int64_t> surface({count}), step({count});
    Output<double> line({count, 2}), top({count});
    Output<double> line_gradient({count, 2, outline.num_values}), top_gradient({count, outline.num_values});
    std::copy(outline.surface.begin(), outline.surface.end(), surface.data());
    std::copy(outline.step.begin(), outline.step.end(), step.data());
    std::copy(outline.line.begin(), outline.line.end(), line.data());
    std::copy(outline.top.begin(), outline.top.end(), top.data());
    std::copy(outline.line_gradient.begin(), outline.line_gradient.end(), line_gradient.data());
    std::copy(outline.top_gradient.begin(), outline.top_gradient.end(), top_gradient.data());
    return nb::make_tuple(surface.object(), step.object(), line.object(), top.object(), line_gradient.object(),
                          top_gradient.object());
}

}  // namespace stairmap
