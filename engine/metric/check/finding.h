#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "engine/database/database.h"
#include "engine/database/domain.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// What kernels found wrong with a metric (shaders/framework/finding.glsl), as they write it.
struct Finding {
    enum Kind : std::uint32_t {
        fine,
        weight,      // negative, NaN or infinite
        first,       // the first material's transformed sample is NaN or infinite
        second,      // the second's
        not_finite,  // the difference is
        negative,    // likewise
        asymmetric,  // likewise
        not_degree,  // it is not |d|^degree
        fault        // it went wrong on the way
    };
    std::array<std::uint32_t, 4> places;  // the kernels' own
    Kind kind;
    std::uint32_t first_material;  // kNone of what does not depend on materials
    std::uint32_t second_material;
    std::uint32_t voxel;  // of the slab
    std::uint32_t channel;
    std::array<float, 3> a;
    std::array<float, 3> b;
    float there;
    float back;
    float voxel_weight;
    // The first voxel of the slab at which a material differs from itself; kNone when none does.
    std::uint32_t same_voxel;
    std::uint32_t same_material;
    float same_difference;

    static constexpr std::uint32_t kNone = 0xffffffff;
};

/// One line for the user: what is wrong, at which voxel, between which materials, with which
/// numbers. `file_index` is the voxel's, of a finding that has materials.
std::string explain(const Finding& finding, const Metric& metric, const Database& database,
                    std::uint64_t file_index);

/// Likewise, that the weight of a voxel in a window of a summary is no weight.
std::string explain_window(const Metric& metric, std::size_t window, float weight,
                           const Database& database, std::uint64_t file_index);

/// Likewise, that a material differs from itself. `file_index` is that of the voxel where.
std::string warn_of_same(const Finding& finding, const Metric& metric, const Database& database,
                         std::uint64_t file_index);

}  // namespace merl::engine
