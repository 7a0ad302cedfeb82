#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/database/domain.h"
#include "engine/metric/metric_header.h"

namespace merl::engine {

// What shaders and C++ share: metric_kernels.cpp defines these in every shader of the framework.

/// The voxels over which one partial sum runs.
constexpr std::uint32_t kBlockVoxels = 1024;

/// Voxels of a cell, the unit that a kernel prepares at a time.
constexpr std::uint32_t kCellVoxels = 4;

/// Texels of a chunk, of which the smallest and the largest number are taken for the error bound.
constexpr std::uint32_t kChunkTexels = 1;

/// Texels that a shader adds in float32 before it compensates (shaders/framework/difference.comp).
constexpr std::uint32_t kRunTexels = 8;

/// Numbers that are summed side by side over a window of a summary metric, before they are added
/// (shaders/framework/window_sums.comp).
constexpr std::uint32_t kWindowLanes = 32;

/// One block of one material: red, green and blue (or what a transform makes of them), zero beyond
/// the last voxel.
using BlockSamples = std::array<std::array<double, kBlockVoxels>, 3>;
using BlockWeights = std::array<double, kBlockVoxels>;

/// The mean of red, green and blue over a window of a summary metric.
using WindowMean = std::array<double, 3>;

/// Numbers of one block of one material in the grid of a metric with a degree, a channel after the
/// other.
constexpr std::size_t kBlockScalars = std::size_t{3} * kBlockVoxels;
using BlockScalars = std::array<float, kBlockScalars>;
using SingleWeights = std::array<float, kBlockVoxels>;

/// The same metric file compiled as C++ in float64: the reference that device results are held to,
/// and what refines them. One block at a time; sums have a fixed order on every processor. All take
/// the values of the metric's parameters.
struct MetricTwin {
    /// transform(f, v) of every voxel of a block.
    void (*transform)(std::span<const double> parameters,
                      std::span<const Voxel, kBlockVoxels> voxels, const BlockSamples& samples,
                      BlockSamples& transformed) = nullptr;
    /// The same, each times its voxel's factor, rounded once.
    void (*scale)(std::span<const double> parameters, std::span<const Voxel, kBlockVoxels> voxels,
                  const BlockSamples& samples, const BlockWeights& factors,
                  std::span<float, kBlockScalars> scaled) = nullptr;
    /// weight(v) of every voxel of a block.
    void (*weigh)(std::span<const double> parameters, std::span<const Voxel, kBlockVoxels> voxels,
                  BlockWeights& weights) = nullptr;
    /// Σ g·h of a block; a and b are transformed samples.
    double (*sum)(std::span<const double> parameters, const BlockSamples& a, const BlockSamples& b,
                  const BlockWeights& weights) = nullptr;
    /// The same in float32 but for the sum of its terms, of a metric without a degree: several
    /// times faster. There is no bound on its error.
    double (*sum_in_float32)(std::span<const double> parameters, const BlockScalars& a,
                             const BlockScalars& b, const SingleWeights& weights) = nullptr;

    /// window(w, v) of every voxel of a block, of a metric that has windows: of a summary, and of
    /// another only to see whether a grid has voxels in them.
    void (*window)(std::span<const double> parameters, std::span<const Voxel, kBlockVoxels> voxels,
                   std::uint32_t window, BlockWeights& weights) = nullptr;

    // Of a summary instead of all but the last.
    /// feature(i, m) for each i; a mean for each window.
    void (*features)(std::span<const double> parameters, std::span<const WindowMean> means,
                     std::span<double> features) = nullptr;
    /// Bounds on the errors of those, where the means have this relative error (counted.h).
    void (*errors)(std::span<const double> parameters, std::span<const WindowMean> means,
                   double error_of_means, std::span<double> errors) = nullptr;
};

/// One metric (docs/metrics.md), and the values of its parameters: of the family of Ryman
/// 2018, 4.9, a transform, a weight and a difference; or a summary, windows and the features of
/// their means. It comes from one GLSL file: of the library, or a user's.
struct Metric {
    std::string name;    // with the parameters that are not at their defaults: "pawcielab:white=80"
    std::string file;    // what messages call the file
    std::string source;  // the text of the file
    MetricHeader header;             // what the text says of itself
    std::vector<double> parameters;  // the chosen value of each of header.parameters
    MetricTwin twin;                 // of a library metric; a user's has none

    /// Whether there is one: float64 distances can be had on the CPU (float64_distances.h).
    bool has_twin() const { return twin.sum != nullptr || twin.features != nullptr; }

    /// Whether its distance is that of features, all of it in float64, and not a sum over voxels.
    bool is_summary() const { return header.features > 0; }

    /// Whether its difference is a sum over channels of |d|^degree.
    bool has_degree() const { return header.degree > 0; }

    /// Whether it is known how far its distances can be from exact ones; of a user's summary, as an
    /// estimate.
    bool has_bound() const { return has_degree() || is_summary(); }

    /// Whether it is proven to be a pseudometric (docs/metrics.md, "Is it a metric?"): the root of
    /// a weighted sum of |d|^p keeps the triangle inequality; of any other difference nobody knows.
    bool is_pseudometric() const { return has_degree() || is_summary(); }

    /// Whether its bound needs ranges and slopes (docs/numerics.md): a power below one is steep
    /// near zero.
    bool has_slopes() const { return has_degree() && header.degree < 1; }

    /// Whether its bound needs norms.
    bool has_norms() const { return header.degree >= 1; }

    /// Whether distances under it that float32 leaves open can be had in float64
    /// (Engines::float64_distances): by its twin, or on a device, where it has a degree. Those of a
    /// summary are float64 already.
    bool can_be_refined() const { return !is_summary() && (has_twin() || has_degree()); }

    /// Whether kernels look for what is wrong with it (check.comp): nobody has tested it.
    bool is_checked() const { return !has_twin(); }

    /// Whether a kernel gives a workgroup to each row of a tile: any_difference.comp.
    bool has_row_groups() const { return !has_degree(); }

    /// How the grid of this metric is cut into texels (shaders/framework/metric.glsl).
    std::uint32_t cell_texels() const { return has_degree() ? 3 : 4; }
    std::uint32_t block_texels() const { return kBlockVoxels / kCellVoxels * cell_texels(); }
};

/// Every metric of the library with its parameters at their defaults, by name.
std::span<const Metric> metrics();

/// The three metrics of the framework test (Ryman 2018, table 4.2): one, uniform, projected-area.
std::span<const Metric> framework_test_metrics();

/// The library's metric with this name. Throws Error (usage) that lists the names there are.
const Metric& find_metric(std::string_view name);

/// The metric that `text` names, with its parameters: "pawcielab", "pawcielab:white=80",
/// "./my_metric.glsl:alpha=0.3:beta=2". A name that ends in .glsl is a file. Nothing is compiled
/// yet. Throws Error: (usage) for an unknown name or parameter or a value out of range, (input) for
/// a file that cannot be read or has a bad header.
Metric open_metric(const std::string& text);

/// What open_metric() takes to open the same metric again.
std::string text_of(const Metric& metric);

/// The metric with these values of all its parameters, which must be in their ranges, and the name
/// that they give it.
Metric with_parameters(Metric metric, std::span<const double> parameters);

}  // namespace merl::engine
