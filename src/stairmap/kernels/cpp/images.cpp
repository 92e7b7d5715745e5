// Reduce a depth image to inverse depth, and look at how sharp its jumps are.
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels.hpp"

namespace stairmap {

namespace {

// Shares of jumps along scans whose pixels lie `along` apart and which lie `across` apart.
void jumps_along(const float *pixels, size_t length, size_t along, size_t num_scans, size_t across,
                 const std::tuple<int64_t, int64_t, int64_t, double, double> &shape, std::vector<float> &shares) {
    const size_t reach = static_cast<size_t>(std::get<1>(shape)), far = static_cast<size_t>(std::get<2>(shape));
    const float min_share = static_cast<float>(std::get<3>(shape)), max_plateau = static_cast<float>(std::get<4>(shape));
    if (length < 2 * far + 1) return;
    for (size_t row = far; row + far < length; ++row)
        for (size_t scan = 0; scan < num_scans; ++scan) {
            const float *at = pixels + row * along + scan * across;
            const auto pixel = [&](size_t back, size_t ahead) { return *(at + ahead * along - back * along); };
            const float before = pixel(reach, 0), behind = pixel(0, reach);
            const float total = std::abs(behind - before);
            if (!(total > min_share * std::max(behind, before))) continue;
            const float limit = max_plateau * total;
            if (!(std::abs(before - pixel(far, 0)) < limit && std::abs(pixel(0, far) - behind) < limit)) continue;
            const float *first = at - far * along;
            bool is_measured = true;
            for (size_t i = 0; i <= 2 * far; ++i) is_measured &= first[i * along] > 0.0f;
            if (!is_measured) continue;
            float largest = -1.0f;
            size_t steepest = 0;
            for (size_t i = 0; i < 2 * reach; ++i) {
                const float *step = first + (far - reach + i) * along;
                const float change = std::abs(step[along] - step[0]);
                if (change > largest) largest = change, steepest = i;
            }
            if (std::abs(static_cast<double>(steepest) - (static_cast<double>(reach) - 0.5)) < 1.0)
                shares.push_back(largest / total);
        }
}

struct Range {
    float least, most, same;
};

// Reduces an image by a stride, which is SIDE where that is not 0.
template <size_t SIDE>
void reduce_rows(const float *pixels, size_t columns, size_t any_stride, std::array<size_t, 2> size, Range range,
                 float *reduced) {
    const size_t stride = SIDE ? SIDE : any_stride, height = size[0], width = size[1], used = width * stride;
    std::vector<float> inverse(stride * used + 1), nearest(width), total(width), count(width);
    for (size_t row = 0; row < height; ++row) {
        float *out = reduced + row * width;
        for (size_t i = 0; i < stride; ++i) {
            const float *from = pixels + (row * stride + i) * columns;
            float *to = SIDE == 1 ? out : &inverse[i * used];
            for (size_t k = 0; k < used; ++k) {
                const float value = 1.0f / from[k];
                to[k] = value > range.least ? (value > range.most ? 0.0f : value) : 0.0f;
            }
        }
        if (SIDE == 1) continue;
        std::fill(nearest.begin(), nearest.end(), 0.0f);
        for (size_t i = 0; i < stride; ++i)
            for (size_t k = 0; k < width; ++k)
                for (size_t j = 0; j < stride; ++j) {
                    const float value = inverse[i * used + k * stride + j];
                    nearest[k] = value > nearest[k] ? value : nearest[k];
                }
        std::fill(total.begin(), total.end(), 0.0f);
        std::fill(count.begin(), count.end(), 0.0f);
        for (size_t i = 0; i < stride; ++i)
            for (size_t k = 0; k < width; ++k) {
                const float limit = nearest[k] * range.same;
                for (size_t j = 0; j < stride; ++j) {
                    const float value = inverse[i * used + k * stride + j];
                    total[k] += value > limit ? value : 0.0f;
                    count[k] += value > limit ? 1.0f : 0.0f;
                }
            }
        for (size_t k = 0; k < width; ++k) out[k] = total[k] / (count[k] > 1.0f ? count[k] : 1.0f);
    }
}

}  // namespace

nb::object reduce_depth(nb::handle depth_image, int64_t block, const std::array<double, 3> &limits) {
    Input<float, 2> depth(depth_image, "depth");
    if (block < 1) refuse("stride: expected at least 1, got " + std::to_string(block));
    const size_t stride = static_cast<size_t>(block);
    const size_t height = depth.shape(0) / stride, width = depth.shape(1) / stride, columns = depth.shape(1);
    Output<float> reduced({height, width});
    {
        nb::gil_scoped_release release;
        const Range range{static_cast<float>(limits[0]), static_cast<float>(limits[1]), static_cast<float>(limits[2])};
        const float *pixels = depth.data();
        // A side that the compiler knows makes vectors of the inner loops.
        if (stride == 1) reduce_rows<1>(pixels, columns, stride, {height, width}, range, reduced.data());
        else if (stride == 2) reduce_rows<2>(pixels, columns, stride, {height, width}, range, reduced.data());
        else if (stride == 3) reduce_rows<3>(pixels, columns, stride, {height, width}, range, reduced.data());
        else if (stride == 4) reduce_rows<4>(pixels, columns, stride, {height, width}, range, reduced.data());
        else if (stride == 6) reduce_rows<6>(pixels, columns, stride, {height, width}, range, reduced.data());
        else reduce_rows<0>(pixels, columns, stride, {height, width}, range, reduced.data());
    }
    return reduced.object();
}

nb::object measure_jumps(nb::handle inverse_depth, const std::tuple<int64_t, int64_t, int64_t, double, double> &shape) {
    Input<float, 2> image(inverse_depth, "inverse_depth");
    const int64_t step = std::get<0>(shape), reach = std::get<1>(shape), far = std::get<2>(shape);
    if (!(step > 0 && reach > 0 && reach <= far))
        refuse("shape: expected a step above 0 and reach from 1 to far, got others");
    const size_t height = image.shape(0), width = image.shape(1), every = static_cast<size_t>(step);
    std::vector<float> shares;
    {
        nb::gil_scoped_release release;
        jumps_along(image.data(), height, width, (width + every - 1) / every, every, shape, shares);
        jumps_along(image.data(), width, 1, (height + every - 1) / every, every * width, shape, shares);
    }
    Output<float> array({shares.size()});
    std::copy(shares.begin(), shares.end(), array.data());
    return array.object();
}

}  // namespace stairmap
