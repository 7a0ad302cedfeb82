#include "app/python/array_database.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/widest_vectors.h"

namespace merl::python {
namespace {

/// NaN is not greater than anything.
double or_not_measured(double value) {
    return value >= 0 ? value : -1;
}

/// Whether all numbers of a row of voxels, which are put into the planes, are small enough.
template <typename Number>
[[gnu::always_inline]] inline bool read_numbers(const Number* numbers, std::uint64_t voxels,
                                                double* red, double* green, double* blue) {
    double most = 0;
    for (std::uint64_t i = 0; i < voxels; ++i) {
        red[i] = or_not_measured(static_cast<double>(numbers[3 * i]));
        green[i] = or_not_measured(static_cast<double>(numbers[3 * i + 1]));
        blue[i] = or_not_measured(static_cast<double>(numbers[3 * i + 2]));
        const double most_here = std::max(std::max(red[i], green[i]), blue[i]);
        most = most > most_here ? most : most_here;
    }
    return most <= engine::kMaxReflectance;
}

MERL_SCAN_WIDEST_VECTORS bool read_dense(const double* numbers, std::uint64_t voxels, double* red,
                                         double* green, double* blue) {
    return read_numbers(numbers, voxels, red, green, blue);
}

MERL_SCAN_WIDEST_VECTORS bool read_dense_float32(const float* numbers, std::uint64_t voxels,
                                                 double* red, double* green, double* blue) {
    return read_numbers(numbers, voxels, red, green, blue);
}

template <typename Number>
bool read_strided(const std::byte* from, std::uint64_t voxels, std::ptrdiff_t voxel_stride,
                  std::ptrdiff_t channel_stride, const std::array<double*, 3>& planes) {
    bool good = true;
    for (std::uint64_t i = 0; i < voxels; ++i) {
        for (std::size_t c = 0; c < planes.size(); ++c) {
            Number number = 0;  // which need not be aligned
            std::memcpy(&number,
                        from + static_cast<std::ptrdiff_t>(i) * voxel_stride +
                            static_cast<std::ptrdiff_t>(c) * channel_stride,
                        sizeof number);
            planes[c][i] = or_not_measured(static_cast<double>(number));
            good &= planes[c][i] <= engine::kMaxReflectance;
        }
    }
    return good;
}

template <typename Number>
bool read_row(const std::byte* from, std::uint64_t voxels, std::ptrdiff_t voxel_stride,
              std::ptrdiff_t channel_stride, const std::array<double*, 3>& planes) {
    constexpr std::ptrdiff_t kSize = sizeof(Number);
    const bool is_dense = channel_stride == kSize && voxel_stride == 3 * kSize &&
                          reinterpret_cast<std::uintptr_t>(from) % alignof(Number) == 0;
    if (!is_dense) {
        return read_strided<Number>(from, voxels, voxel_stride, channel_stride, planes);
    }
    const auto* const numbers = reinterpret_cast<const Number*>(from);
    if constexpr (sizeof(Number) == sizeof(float)) {
        return read_dense_float32(numbers, voxels, planes[0], planes[1], planes[2]);
    } else {
        return read_dense(numbers, voxels, planes[0], planes[1], planes[2]);
    }
}

}  // namespace

ArrayDatabase::ArrayDatabase(std::string name, const engine::Grid& grid,
                             std::vector<std::string> materials, std::vector<SampleArray> samples)
    : Database(std::move(name), "arrays"), samples_(std::move(samples)) {
    grid_ = grid;
    materials_ = std::move(materials);
    engine::require_usable(*this);
}

void ArrayDatabase::read(std::size_t material, engine::VoxelRange range, std::span<double> samples,
                         const engine::SampleSink& sink) const {
    const SampleArray& array = samples_.at(material);
    const auto& [theta_h_stride, theta_d_stride, phi_d_stride, channel_stride] = array.strides;
    const std::uint64_t phi_d_layers = grid_.phi_d;
    for (std::uint64_t voxel = range.first; voxel < range.last;) {
        const std::uint64_t phi_d = voxel % phi_d_layers;
        const std::uint64_t length = std::min(phi_d_layers - phi_d, range.last - voxel);
        const std::uint64_t theta_d = voxel / phi_d_layers % grid_.theta_d;
        const std::uint64_t theta_h = voxel / phi_d_layers / grid_.theta_d;
        const std::byte* const from = array.data +
                                      static_cast<std::ptrdiff_t>(theta_h) * theta_h_stride +
                                      static_cast<std::ptrdiff_t>(theta_d) * theta_d_stride +
                                      static_cast<std::ptrdiff_t>(phi_d) * phi_d_stride;
        double* const red = samples.data() + (voxel - range.first);
        const std::array planes = {red, red + range.size(), red + 2 * range.size()};
        const bool good =
            array.is_float32 ? read_row<float>(from, length, phi_d_stride, channel_stride, planes)
                             : read_row<double>(from, length, phi_d_stride, channel_stride, planes);
        if (!good) {
            for (std::uint64_t i = 0; i < length; ++i) {
                for (std::size_t c = 0; c < planes.size(); ++c) {
                    if (!(planes[c][i] <= engine::kMaxReflectance)) {
                        throw InputError(fmt::format(
                            "{}: {}[{}, {}, {}, {}] is {}/sr; expected a finite number, at most "
                            "{}, or NaN for what was not measured",
                            name_, materials_[material], theta_h, theta_d, phi_d + i, c,
                            planes[c][i], engine::kMaxReflectance));
                    }
                }
            }
        }
        voxel += length;
    }
    if (sink) {
        for (std::size_t plane = 0; plane < 3; ++plane) {
            sink(plane, std::as_bytes(samples.subspan(plane * range.size(), range.size())));
        }
    }
}

}  // namespace merl::python
