// Sample an image of inverse depth along rays that are told by slope and bearing.
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels.hpp"
#include "vectors.hpp"

namespace stairmap {

namespace {

// Where the rays of one slope meet the image: a camera, axes, and the bearings of the rays.
struct Lens {
    float forward[3], up[3], left[3], fx, fy, cx, cy, same, least;
};

// The image with a border of zeros, and one row more for its lower neighbours.
struct Padded {
    const float *pixels;
    int32_t stride, width, height;
};

constexpr size_t BLOCK = 64;  // rays that are worked on together

// Samples of up to BLOCK rays: between pixels of one surface interpolated, elsewhere the nearest.
STAIRMAP_VECTORS
void sample_block(const Padded &image, const Lens &lens, const float *ray, const float *__restrict__ across,
                  size_t count, float *__restrict__ out) {
    const float x = ray[0], y = ray[1], z = ray[2];
    const float width = static_cast<float>(image.width), height = static_cast<float>(image.height);
    const float left_x = lens.left[0], left_y = lens.left[1], left_z = lens.left[2], least = lens.least;
    const float fx = lens.fx, fy = lens.fy, cx = lens.cx, cy = lens.cy, same = lens.same;
    const int32_t stride = image.stride;
    const float *pixels = image.pixels;
    float depth[BLOCK], part_u[BLOCK], part_v[BLOCK], a[BLOCK], b[BLOCK], c[BLOCK], d[BLOCK];
    int32_t at[BLOCK], is_near[BLOCK], is_right[BLOCK], is_below[BLOCK];
    // Loops without branches, of which the compiler makes vectors, and one that looks up pixels.
    for (size_t i = 0; i < count; ++i) {
        depth[i] = z + across[i] * left_z;
        const float inverse = 1.0f / (depth[i] > least ? depth[i] : least);
        const float any_u = (x + across[i] * left_x) * inverse * fx + cx;
        const float any_v = (y + across[i] * left_y) * inverse * fy + cy;
        // Rays that miss the image by a pixel or more need no place in it.
        const int32_t near = (any_u > -1.0f ? 1 : 0) & (any_u < width ? 1 : 0) & (any_v > -1.0f ? 1 : 0) &
                             (any_v < height ? 1 : 0) & (depth[i] >= least ? 1 : 0);
        const float u = near ? any_u : 0.0f, v = near ? any_v : 0.0f;
        const int32_t whole_u = static_cast<int32_t>(u), whole_v = static_cast<int32_t>(v);
        const int32_t low_u = whole_u - (static_cast<float>(whole_u) > u ? 1 : 0);
        const int32_t low_v = whole_v - (static_cast<float>(whole_v) > v ? 1 : 0);
        part_u[i] = u - static_cast<float>(low_u);
        part_v[i] = v - static_cast<float>(low_v);
        at[i] = (low_v + 1) * stride + low_u + 1;
        // The nearest whole number: halves go to the even one.
        is_right[i] = (part_u[i] > 0.5f ? 1 : 0) | ((part_u[i] == 0.5f ? 1 : 0) & low_u);
        is_below[i] = (part_v[i] > 0.5f ? 1 : 0) | ((part_v[i] == 0.5f ? 1 : 0) & low_v);
        is_near[i] = near;
    }
    for (size_t i = 0; i < count; ++i) {
        const float *pixel = pixels + at[i];
        a[i] = pixel[0], b[i] = pixel[1], c[i] = pixel[stride], d[i] = pixel[stride + 1];
    }
    for (size_t i = 0; i < count; ++i) {
        const float upper = is_right[i] ? b[i] : a[i], lower = is_right[i] ? d[i] : c[i];
        const float nearest = is_below[i] ? lower : upper;
        const float above = a[i] * (1.0f - part_u[i]) + b[i] * part_u[i];
        const float below = c[i] * (1.0f - part_u[i]) + d[i] * part_u[i];
        const float linear = above * (1.0f - part_v[i]) + below * part_v[i];
        const float difference = std::abs(linear - nearest);
        const float sampled = (difference < same * nearest ? linear : nearest) * depth[i];
        out[i] = is_near[i] ? sampled : 0.0f;
    }
}

class Sampler {
  public:
    Sampler(const Input<float, 2> &image, const Input<double, 2> &axes, const Input<double, 1> &slope,
            std::vector<float> bearings, const std::array<double, 6> &view)
        : padded_((image.shape(0) + 2) * (image.shape(1) + 2), 0.0f), slope_(slope.data()),
          across_(std::move(bearings)) {
        const size_t stride = image.shape(1) + 2;
        for (size_t row = 0; row < image.shape(0); ++row)
            std::copy_n(image.row(row), image.shape(1), &padded_[(row + 1) * stride + 1]);
        image_ = Padded{padded_.data(), static_cast<int32_t>(stride), static_cast<int32_t>(image.shape(1)),
                        static_cast<int32_t>(image.shape(0))};
        for (int axis = 0; axis < 3; ++axis) {
            lens_.forward[axis] = static_cast<float>(axes[axis]);
            lens_.up[axis] = static_cast<float>(axes[3 + axis]);
            lens_.left[axis] = static_cast<float>(axes[6 + axis]);
        }
        lens_.fx = static_cast<float>(view[0]), lens_.fy = static_cast<float>(view[1]);
        lens_.cx = static_cast<float>(view[2]), lens_.cy = static_cast<float>(view[3]);
        lens_.same = static_cast<float>(view[4]), lens_.least = static_cast<float>(view[5]);
    }

    void sample(size_t row, float *out) const {
        const float climb = static_cast<float>(slope_[row]);
        float ray[3];
        for (int axis = 0; axis < 3; ++axis) ray[axis] = lens_.forward[axis] + climb * lens_.up[axis];
        for (size_t first = 0; first < across_.size(); first += BLOCK)
            sample_block(image_, lens_, ray, &across_[first], std::min(BLOCK, across_.size() - first), out + first);
    }

  private:
    std::vector<float> padded_;
    const double *slope_;
    std::vector<float> across_;
    Padded image_;
    Lens lens_;
};

std::vector<float> floats_of(const Input<double, 1> &values) {
    std::vector<float> floats(values.size());
    for (size_t i = 0; i < floats.size(); ++i) floats[i] = static_cast<float>(values[i]);
    return floats;
}

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

// Least, greatest and sum of the samples of each strip, which stand one row of strips after another.
STAIRMAP_VECTORS
void sum_samples(const float *cells, size_t num_samples, size_t num_strips, float *low, float *high, double *sum) {
    for (size_t strip = 0; strip < num_strips; ++strip) {
        low[strip] = high[strip] = cells[strip];
        sum[strip] = static_cast<double>(cells[strip]);
    }
    for (size_t k = 1; k < num_samples; ++k) {
        const float *values = cells + k * num_strips;
        for (size_t strip = 0; strip < num_strips; ++strip) {
            low[strip] = values[strip] < low[strip] ? values[strip] : low[strip];
            high[strip] = values[strip] > high[strip] ? values[strip] : high[strip];
        }
        for (size_t strip = 0; strip < num_strips; ++strip) sum[strip] += static_cast<double>(values[strip]);
    }
}

// Adds the rows about each row, with the weights of a kernel; rows beyond the first and the last are those.
STAIRMAP_VECTORS
void smooth_rows(const float *values, size_t num_rows, size_t width, const float *kernel, size_t size,
                 float *__restrict__ out) {
    const int64_t reach = static_cast<int64_t>(size / 2), last = static_cast<int64_t>(num_rows) - 1;
    for (int64_t row = 0; row <= last; ++row) {
        float *__restrict__ to = out + static_cast<size_t>(row) * width;
        for (size_t i = 0; i < width; ++i) to[i] = 0.0f;
        for (size_t k = 0; k < size; ++k) {
            const int64_t other = row + static_cast<int64_t>(k) - reach;
            const int64_t inside = other < 0 ? 0 : other > last ? last : other;
            const float *from = values + static_cast<size_t>(inside) * width;
            const float weight = kernel[k];
            for (size_t i = 0; i < width; ++i) to[i] = to[i] + weight * from[i];
        }
    }
}

STAIRMAP_VECTORS
void add_difference(const float *__restrict__ again, const float *__restrict__ scale, const float *__restrict__ measured,
                    const float *__restrict__ is_measured, size_t count, float *__restrict__ sharp) {
    for (size_t i = 0; i < count; ++i) sharp[i] = sharp[i] + is_measured[i] * (measured[i] - again[i] * scale[i]);
}

}  // namespace

nb::object sharpen_scans(nb::handle inverse_distance, nb::handle kernel_weights, int64_t num_rounds, double min_share) {
    Input<double, 2> scans(inverse_distance, "inverse_distance");
    Input<float, 1> kernel(kernel_weights, "kernel");
    if (kernel.size() % 2 != 1)
        refuse("kernel: expected an odd number of weights, got " + std::to_string(kernel.size()));
    const size_t num_rows = scans.shape(0), width = scans.shape(1), count = scans.size();
    Output<double> sharpened({num_rows, width});
    if (count > 0) {
        nb::gil_scoped_release release;
        std::vector<float> measured(count), is_measured(count), share(count), scale(count), again(count);
        for (size_t i = 0; i < count; ++i) {
            measured[i] = static_cast<float>(scans[i]);
            is_measured[i] = measured[i] > 0.0f ? 1.0f : 0.0f;
        }
        smooth_rows(is_measured.data(), num_rows, width, kernel.data(), kernel.size(), share.data());
        for (size_t i = 0; i < count; ++i) scale[i] = 1.0f / std::max(share[i], 1e-3f);
        std::vector<float> sharp = measured;
        for (int64_t round = 0; round < num_rounds; ++round) {
            smooth_rows(sharp.data(), num_rows, width, kernel.data(), kernel.size(), again.data());
            add_difference(again.data(), scale.data(), measured.data(), is_measured.data(), count, sharp.data());
        }
        const float least = static_cast<float>(min_share);
        for (size_t i = 0; i < count; ++i) {
            const bool is_better = share[i] > least && sharp[i] > 0.0f && measured[i] > 0.0f;
            sharpened[i] = is_better ? static_cast<double>(sharp[i]) : scans[i];
        }
    }
    return sharpened.object();
}

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
        const Sampler sampler(image, axes, slope, floats_of(bearing), view);
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
        // The first sample of all strips, then the second of all, and so on.
        const size_t per_strip = static_cast<size_t>(num_samples);
        const float most = static_cast<float>(spread);
        std::vector<float> ordered(num_columns);
        for (size_t i = 0; i < num_columns; ++i)
            ordered[i % per_strip * num_strips + i / per_strip] = static_cast<float>(bearing[i]);
        const Sampler sampler(image, axes, slope, std::move(ordered), view);
        std::vector<float> cells(num_columns + 1), low(num_strips), high(num_strips), strip_cells(per_strip);
        std::vector<double> sum(num_strips);
        const bool may_be_plain = num_samples >= min_valid && num_samples >= min_near;
        for (size_t row = 0; row < num_rows; ++row) {
            sampler.sample(row, cells.data());
            sum_samples(cells.data(), per_strip, num_strips, low.data(), high.data(), sum.data());
            double *out = averaged.data() + row * num_strips;
            for (size_t strip = 0; strip < num_strips; ++strip) {
                if (high[strip] == 0.0f) continue;
                // On one surface, the usual case, all are near their median, whichever it is: they need no order.
                if (may_be_plain && low[strip] > 0.0f && high[strip] - low[strip] < most * low[strip]) {
                    out[strip] = sum[strip] / static_cast<double>(num_samples);
                    continue;
                }
                for (size_t k = 0; k < per_strip; ++k) strip_cells[k] = cells[k * num_strips + strip];
                out[strip] = mean_near_median(strip_cells.data(), num_samples, most, min_valid, min_near);
            }
        }
    }
    return averaged.object();
}

}  // namespace stairmap
