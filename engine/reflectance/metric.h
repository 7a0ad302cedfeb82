#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/reflectance/domain.h"

namespace merl::reflectance {

/// The voxels over which one float32 partial sum runs; shaders/framework/metric.glsl has the same.
constexpr std::uint32_t kBlockVoxels = 1024;

using Rgb = std::array<double, 3>;

/// The same metric file compiled as C++ in float64: the reference that device results are held to.
struct MetricTwin {
    /// transform(f, v): one BRDF's sample (1/sr) in the metric's own space.
    Rgb (*transform)(const Rgb& f, const Voxel& voxel);
    /// weight(v): what the voxel weighs.
    double (*weight)(const Voxel& voxel);
    /// Σ g·h over `weights.size()` voxels; a and b are transformed samples, three numbers a voxel.
    double (*sum)(std::span<const Rgb> a, std::span<const Rgb> b, std::span<const double> weights);
};

/// One metric of the family of SPEC §2: a transform, a weight and a difference (SPEC §3), made by
/// the build from one file of shaders/metrics/ (or shaders/verify/).
struct Metric {
    std::string_view name;    // the file's name without extension
    std::string_view source;  // the text of the file
    bool per_channel =
        false;  // declares a `degree`: h is a sum of homogeneous functions of channels
    std::span<const std::uint32_t> prepare_spirv;
    std::span<const std::uint32_t> difference_spirv;
    MetricTwin twin;

    /// The value of `// key: value` in the file's header; empty when there is none.
    std::string_view header(std::string_view key) const;

    /// How the grid of this metric is cut into texels (shaders/framework/metric.glsl).
    std::uint32_t voxels_per_cell() const { return per_channel ? 4 : 1; }
    std::uint32_t texels_per_cell() const { return per_channel ? 3 : 1; }
    std::uint32_t block_texels() const {
        return kBlockVoxels / voxels_per_cell() * texels_per_cell();
    }
};

/// Every metric of the library, by name.
std::span<const Metric> metrics();

/// The three metrics of the framework test (SPEC §2): one, uniform, projected-area.
std::span<const Metric> framework_test_metrics();

/// The metric with this name. Throws Error (usage) that lists the names there are.
const Metric& find_metric(std::string_view name);

}  // namespace merl::reflectance
