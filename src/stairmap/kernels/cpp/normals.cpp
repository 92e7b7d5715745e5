// Sum up normals: which are level, which upright, which way they face.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "kernels.hpp"

namespace stairmap {

namespace {

constexpr double PI = 3.14159265358979323846;

double along(const float *vector, const double *axis) {
    return static_cast<double>(vector[0]) * axis[0] + static_cast<double>(vector[1]) * axis[1] +
           static_cast<double>(vector[2]) * axis[2];
}

}  // namespace

nb::tuple sum_normals(nb::handle normal_rows, nb::handle residuals, nb::handle inner, nb::handle axis_vector,
                      const std::array<double, 3> &limits) {
    Input<float, 2> normals(normal_rows, "normals");
    check_length(normals, "normals", 3, 1);
    Input<float, 1> residual(residuals, "residual");
    Input<bool, 1> is_inner(inner, "is_inner");
    Input<double, 1> axis(axis_vector, "axis");
    const size_t count = normals.shape(0);
    check_length(residual, "residual", count);
    check_length(is_inner, "is_inner", count);
    check_length(axis, "axis", 3);
    int64_t num_planes = 0, num_level = 0, num_upright = 0;
    Output<double> level({3}), scatter({3, 3});
    {
        nb::gil_scoped_release release;
        for (size_t i = 0; i < count; ++i) {
            if (!(static_cast<double>(residual[i]) <= limits[0])) continue;
            ++num_planes;
            const float *normal = normals.data() + 3 * i;
            const double cosine = along(normal, axis.data());
            if (is_inner[i] && cosine < limits[1]) {
                ++num_level;
                for (size_t k = 0; k < 3; ++k) level[k] += normal[k];
            }
            if (std::abs(cosine) < limits[2]) {
                ++num_upright;
                for (size_t k = 0; k < 3; ++k)
                    for (size_t l = 0; l < 3; ++l)
                        scatter[3 * k + l] += static_cast<double>(normal[k]) * static_cast<double>(normal[l]);
            }
        }
    }
    return nb::make_tuple(num_planes, num_level, level.object(), num_upright, scatter.object());
}

nb::tuple count_floor_cells(nb::handle normal_rows, nb::handle point_rows, double min_down, double min_distance,
                            int64_t num_cells) {
    Input<float, 2> normals(normal_rows, "normals");
    check_length(normals, "normals", 3, 1);
    Input<float, 2> points(point_rows, "points");
    check_length(points, "points", normals.shape(0));
    check_length(points, "points", 3, 1);
    if (num_cells < 1) refuse("num_cells: expected at least 1, got " + std::to_string(num_cells));
    const size_t side = static_cast<size_t>(num_cells) + 1;
    Output<int64_t> counts({side, side});
    std::vector<float> chosen;
    {
        nb::gil_scoped_release release;
        const double scale = static_cast<double>(num_cells) / 2;
        const auto cell = [&](float value) {
            const double place = std::floor((static_cast<double>(value) + 1.0) * scale);
            return place > 0 ? static_cast<size_t>(std::min(place, static_cast<double>(num_cells))) : size_t{0};
        };
        for (size_t i = 0; i < normals.shape(0); ++i) {
            const float *normal = normals.data() + 3 * i, *point = points.data() + 3 * i;
            const double at[3] = {point[0], point[1], point[2]};
            if (!(static_cast<double>(normal[1]) > min_down && along(normal, at) > min_distance)) continue;
            chosen.insert(chosen.end(), normal, normal + 3);
            ++counts[cell(normal[0]) * side + cell(normal[2])];
        }
    }
    Output<float> rows({chosen.size() / 3, 3});
    std::copy(chosen.begin(), chosen.end(), rows.data());
    return nb::make_tuple(rows.object(), counts.object());
}

nb::tuple find_facing(nb::handle normal_rows, nb::handle point_rows, nb::handle axis_rows,
                      const std::tuple<double, int64_t, int64_t, int64_t, double, double, double, int64_t, int64_t>
                          &limits) {
    Input<float, 2> normals(normal_rows, "normals");
    check_length(normals, "normals", 3, 1);
    Input<float, 2> points(point_rows, "points");
    Input<double, 2> axes(axis_rows, "axes");
    check_length(points, "points", normals.shape(0));
    check_length(points, "points", 3, 1);
    check_length(axes, "axes", 3);
    check_length(axes, "axes", 3, 1);
    const auto [max_upright, min_count, num_bins, max_peaks, reach, max_angle, width, max_bins, min_in_bin] = limits;
    if (num_bins < 3 || max_bins < 1)
        refuse("limits: expected at least 3 bins of angles and 1 of distances, got fewer");
    std::vector<double> found;
    std::vector<int64_t> numbers;
    {
        nb::gil_scoped_release release;
        std::vector<size_t> upright;
        std::vector<double> angles;
        std::vector<int64_t> counts(num_bins, 0), smooth(num_bins), peaks;
        for (size_t i = 0; i < normals.shape(0); ++i) {
            const float *normal = normals.data() + 3 * i;
            if (!(std::abs(along(normal, axes.data())) < max_upright)) continue;
            const double angle = std::atan2(along(normal, axes.data() + 6), along(normal, axes.data() + 3));
            if (!std::isfinite(angle)) continue;
            upright.push_back(i);
            angles.push_back(angle);
            const double bin = (angle + PI) * (static_cast<double>(num_bins) / (2 * PI));
            ++counts[static_cast<int64_t>(bin) % num_bins];
        }
        const bool enough = static_cast<int64_t>(upright.size()) >= min_count;
        for (int64_t i = 0; i < num_bins; ++i)
            smooth[i] = counts[(i + num_bins - 1) % num_bins] + 2 * counts[i] + counts[(i + 1) % num_bins];
        for (int64_t i = 0; i < num_bins && enough; ++i)
            if (smooth[i] >= smooth[(i + num_bins - 1) % num_bins] && smooth[i] > smooth[(i + 1) % num_bins] &&
                smooth[i] > min_count)
                peaks.push_back(i);
        std::stable_sort(peaks.begin(), peaks.end(), [&](int64_t a, int64_t b) { return smooth[a] > smooth[b]; });
        if (static_cast<int64_t>(peaks.size()) > max_peaks) peaks.resize(std::max<int64_t>(max_peaks, 0));
        for (const int64_t peak : peaks) {
            const double center = (static_cast<double>(peak) + 0.5) * 2 * PI / static_cast<double>(num_bins) - PI;
            std::vector<double> offsets;
            std::vector<size_t> near;
            for (size_t k = 0; k < upright.size(); ++k) {
                double turn = std::fmod(angles[k] - center + PI, 2 * PI);
                turn = (turn < 0 ? turn + 2 * PI : turn) - PI;
                if (!(std::abs(turn) < reach)) continue;
                offsets.push_back(turn);
                near.push_back(upright[k]);
            }
            const double angle = center + median_of(offsets);
            if (std::abs(angle) > max_angle) continue;
            double direction[3];
            for (size_t k = 0; k < 3; ++k)
                direction[k] = std::cos(angle) * axes[3 + k] + std::sin(angle) * axes[6 + k];
            std::vector<int64_t> histogram(max_bins + 1, 0);
            for (const size_t i : near) {
                const double place = along(points.data() + 3 * i, direction) / width;
                ++histogram[place > 0 ? static_cast<size_t>(std::min(place, static_cast<double>(max_bins))) : 0];
            }
            found.push_back(angle);
            numbers.push_back(std::count_if(histogram.begin(), histogram.end(),
                                            [limit = min_in_bin](int64_t in_bin) { return in_bin > limit; }));
        }
    }
    Output<double> all_angles({found.size()});
    Output<int64_t> all_numbers({found.size()});
    std::copy(found.begin(), found.end(), all_angles.data());
    std::copy(numbers.begin(), numbers.end(), all_numbers.data());
    return nb::make_tuple(all_angles.object(), all_numbers.object());
}

}  // namespace stairmap
