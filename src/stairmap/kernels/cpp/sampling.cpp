// Sample an image of inverse depth along rays that are told by slope and bearing.
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels.hpp"

namespace stairmap {

namespace {

class Sampler {
  public:
    Sampler(const Input<float, 2> &image, const Input<double, 2> &axes, const Input<double, 1> &slope,
            const Input<double, 1> &bearing, const std::array<double, 6> &view)
        : width_(static_cast<int>(image.shape(1))), height_(static_cast<int>(image.shape(0))),
          stride_(image.shape(1) + 2), padded_((image.shape(0) + 2) * stride_, 0.0f),
          slope_(slope.data()), across_(bearing.size()), depth_(bearing.size()),
          map_u_(bearing.size()), map_v_(bearing.size()) {
        for (size_t row = 0; row < image.shape(0); ++row)
            std::copy_n(image.row(row), image.shape(1), &padded_[(row + 1) * stride_ + 1]);
        for (int axis = 0; axis < 3; ++axis) {
            forward_[axis] = static_cast<float>(axes[axis]);
            up_[axis] = static_cast<float>(axes[3 + axis]);
            left_[axis] = static_cast<float>(axes[6 + axis]);
        }
        for (size_t i = 0; i < across_.size(); ++i) across_[i] = static_cast<float>(bearing[i]);
        fx_ = static_cast<float>(view[0]), fy_ = static_cast<float>(view[1]);
        cx_ = static_cast<float>(view[2]), cy_ = static_cast<float>(view[3]);
        same_ = static_cast<float>(view[4]), least_ = static_cast<float>(view[5]);
    }

    // Samples of one slope.
    void sample(size_t row, float *out) {
        const float climb = static_cast<float>(slope_[row]);
        const float x = forward_[0] + climb * up_[0], y = forward_[1] + climb * up_[1];
        const float z = forward_[2] + climb * up_[2];
        const size_t count = across_.size();
        const float *across = across_.data();
        float *depth = depth_.data(), *map_u = map_u_.data(), *map_v = map_v_.data();
        for (size_t i = 0; i < count; ++i) {
            depth[i] = z + across[i] * left_[2];
            const float inverse = 1.0f / std::max(depth[i], least_);
            map_u[i] = (x + across[i] * left_[0]) * inverse * fx_ + cx_;
            map_v[i] = (y + across[i] * left_[1]) * inverse * fy_ + cy_;
        }
        const float width = static_cast<float>(width_), height = static_cast<float>(height_);
        for (size_t i = 0; i < count; ++i) {
            const float u = map_u[i], v = map_v[i];
            // Rays that miss the image by a pixel or more need no place in it.
            if (!(u > -1.0f && u < width && v > -1.0f && v < height && depth[i] >= least_)) {
                out[i] = 0.0f;
                continue;
            }
            const int low_u = rounded_down(u), low_v = rounded_down(v);
            const float part_u = u - static_cast<float>(low_u), part_v = v - static_cast<float>(low_v);
            const float *at = &padded_[static_cast<size_t>(low_v + 1) * stride_ + static_cast<size_t>(low_u + 1)];
            const int up = rounds_up(part_v, low_v), right = rounds_up(part_u, low_u);
            const float nearest = at[static_cast<size_t>(up) * stride_ + static_cast<size_t>(right)];
            const float above = at[0] * (1.0f - part_u) + at[1] * part_u;
            const float below = at[stride_] * (1.0f - part_u) + at[stride_ + 1] * part_u;
            const float linear = above * (1.0f - part_v) + below * part_v;
            out[i] = (std::abs(linear - nearest) < same_ * nearest ? linear : nearest) * depth[i];
        }
    }

  private:
    // Without SSE 4.1, std::floor is a call.
    static int rounded_down(float value) {
        const int whole = static_cast<int>(value);
        return whole - (static_cast<float>(whole) > value ? 1 : 0);
    }

    // Whether the nearest whole number lies above; halves go to the even one.
    static int rounds_up(float part, int low) { return part > 0.5f || (part == 0.5f && (low & 1)) ? 1 : 0; }

    int width_, height_;
    size_t stride_;
    std::vector<float> padded_;  // the image with a border of zeros, and one row more for its lower neighbours
    const double *slope_;
    std::vector<float> across_, depth_, map_u_, map_v_;
    float forward_[3], up_[3], left_[3];
    float fx_, fy_, cx_, cy_, same_, least_;
};

void check_sampling(const Input<float, 2> &image, const Input<double, 2> &axes) {
    if (image.size() == 0) refuse("inverse_depth: expected at least one pixel, got none");
    check_length(axes, "axes", 3);
    check_length(axes, "axes", 3, 1);
}

// Puts values in order; eight, the usual number, without a branch.
void sort_few(float *values, int64_t count) {
    if (count == 8) {
        constexpr int pairs[19][2] = {{0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6},
                                      {3, 7}, {0, 1}, {2, 3}, {4, 5}, {6, 7}, {2, 4}, {3, 5},
                                      {1, 4}, {3, 6}, {1, 2}, {3, 4}, {5, 6}};
        for (const auto &pair : pairs) {
            const float first = values[pair[0]], second = values[pair[1]];
            values[pair[0]] = std::min(first, second);
            values[pair[1]] = std::max(first, second);
        }
        return;
    }
    std::sort(values, values + count);
}

// Mean of the values near their median; they are put in order.
double mean_near_median(float *values, int64_t count, float spread, int64_t min_valid, int64_t min_near) {
    // On one surface, the usual case, all are near their median, whichever it is: they need no order.
    float low = values[0], high = values[0];
    for (int64_t i = 1; i < count; ++i) {
        low = std::min(low, values[i]);
        high = std::max(high, values[i]);
    }
    if (high == 0.0f) return 0.0;
    if (low > 0.0f && high - low < spread * low && count >= min_valid && count >= min_near) {
        double all = 0.0;
        for (int64_t i = 0; i < count; ++i) all += values[i];
        return all / static_cast<double>(count);
    }
    sort_few(values, count);
    int64_t num_valid = 0;
    for (int64_t i = 0; i < count; ++i) num_valid += values[i] != 0.0f;
    if (num_valid < min_valid) return 0.0;
    const float median = values[std::min(count - num_valid + num_valid / 2, count - 1)];
    const float limit = spread * median;
    double total = 0.0;
    int64_t num_near = 0;
    for (int64_t i = 0; i < count; ++i)
        if (std::abs(values[i] - median) < limit) {
            total += values[i];
            ++num_near;
        }
    return num_near >= min_near ? total / static_cast<double>(std::max<int64_t>(num_near, 1)) : 0.0;
}

}  // namespace

nb::object sample_rays(nb::handle inverse_depth, nb::handle axes_rows, nb::handle slopes, nb::handle bearings,
                       const std::array<double, 6> &view) {
    Input<float, 2> image(inverse_depth, "inverse_depth");
    Input<double, 2> axes(axes_rows, "axes");
    Input<double, 1> slope(slopes, "slope"), bearing(bearings, "bearing");
    check_sampling(image, axes);
    const size_t num_rows = slope.size(), num_columns = bearing.size();
    Output<float> sampled({num_rows, num_columns});
    {
        nb::gil_scoped_release release;
        Sampler sampler(image, axes, slope, bearing, view);
        for (size_t row = 0; row < num_rows; ++row) sampler.sample(row, sampled.data() + row * num_columns);
    }
    return sampled.object();
}

nb::object sample_strips(nb::handle inverse_depth, nb::handle axes_rows, nb::handle slopes, nb::handle bearings,
                         const std::array<double, 6> &view,
                         const std::tuple<int64_t, double, int64_t, int64_t> &means) {
    Input<float, 2> image(inverse_depth, "inverse_depth");
    Input<double, 2> axes(axes_rows, "axes");
    Input<double, 1> slope(slopes, "slope"), bearing(bearings, "bearing");
    check_sampling(image, axes);
    const auto [num_samples, spread, min_valid, min_near] = means;
    const size_t num_rows = slope.size(), num_columns = bearing.size();
    if (num_samples < 1 || num_columns % static_cast<size_t>(num_samples) != 0)
        refuse("bearing: expected a multiple of " + std::to_string(num_samples) + " values, got " +
               std::to_string(num_columns));
    const size_t num_strips = num_columns / static_cast<size_t>(num_samples);
    Output<double> averaged({num_rows, num_strips});
    {
        nb::gil_scoped_release release;
        Sampler sampler(image, axes, slope, bearing, view);
        std::vector<float> cells(num_columns + 1);
        for (size_t row = 0; row < num_rows; ++row) {
            sampler.sample(row, cells.data());
            for (size_t strip = 0; strip < num_strips; ++strip)
                averaged[row * num_strips + strip] =
                    mean_near_median(&cells[strip * static_cast<size_t>(num_samples)], num_samples,
                                     static_cast<float>(spread), min_valid, min_near);
        }
    }
    return averaged.object();
}

}  // namespace stairmap
