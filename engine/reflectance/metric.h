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

/// Voxels of a cell, the unit that a kernel prepares at a time; likewise.
constexpr std::uint32_t kCellVoxels = 4;

/// Texels of a chunk, over which ranges.comp takes smallest and largest numbers; likewise.
constexpr std::uint32_t kChunkTexels = 8;

/// One block of one material: red, green and blue (or what a transform makes of them), zero beyond
/// the last voxel.
using BlockSamples = std::array<std::array<double, kBlockVoxels>, 3>;
using BlockWeights = std::array<double, kBlockVoxels>;

/// The same metric file compiled as C++ in float64: the reference that device results are held to,
/// and what refines them. One block at a time; sums have a fixed order on every processor.
struct MetricTwin {
    /// transform(f, v) of every voxel of a block, in place.
    void (*transform)(std::span<const Voxel, kBlockVoxels> voxels, BlockSamples& samples);
    /// weight(v) of every voxel of a block.
    void (*weigh)(std::span<const Voxel, kBlockVoxels> voxels, BlockWeights& weights);
    /// Σ g·h of a block; a and b are transformed samples.
    double (*sum)(const BlockSamples& a, const BlockSamples& b, const BlockWeights& weights);
};

/// One metric of the family of SPEC §2: a transform, a weight and a difference (SPEC §3), made by
/// the build from one file of shaders/metrics/ (or shaders/verify/).
struct Metric {
    std::string_view name;    // the file's name without extension
    std::string_view source;  // the text of the file
    /// The declared `degree` p: h is a sum over channels of a function with h(s·d) = |s|^p·h(d).
    /// 0 when there is none: any function of two samples, for which no error bound is known.
    double degree = 0;
    std::span<const std::uint32_t> weigh_spirv;
    std::span<const std::uint32_t> prepare_spirv;
    std::span<const std::uint32_t> norms_spirv;
    std::span<const std::uint32_t> ranges_spirv = {};  // empty unless has_slopes()
    std::span<const std::uint32_t> slopes_spirv = {};  // likewise
    std::span<const std::uint32_t> difference_spirv;
    MetricTwin twin;

    /// The value of `// key: value` in the file's header; empty when there is none.
    std::string_view header(std::string_view key) const;

    /// Whether its bound needs ranges.comp and slopes.comp: a power below one is steep near zero.
    bool has_slopes() const { return degree > 0 && degree < 1; }

    /// Whether its bound needs norms.comp.
    bool has_norms() const { return degree >= 1; }

    /// Materials along one side of a tile of pairs (shaders/framework/metric.glsl).
    std::uint32_t tile() const {
        if (degree == 0) {
            return 5;
        }
        return degree < 1 ? 10 : 20;
    }

    /// How the grid of this metric is cut into texels (shaders/framework/metric.glsl).
    std::uint32_t cell_texels() const { return degree > 0 ? 3 : 4; }
    std::uint32_t block_texels() const { return kBlockVoxels / kCellVoxels * cell_texels(); }
};

/// Every metric of the library, by name.
std::span<const Metric> metrics();

/// The three metrics of the framework test (SPEC §2): one, uniform, projected-area.
std::span<const Metric> framework_test_metrics();

/// The metric with this name. Throws Error (usage) that lists the names there are.
const Metric& find_metric(std::string_view name);

}  // namespace merl::reflectance
