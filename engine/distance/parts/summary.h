#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/distance/parts/pair_totals.h"
#include "engine/metric/metric.h"

namespace merl::engine {

// What the engines share of summary metrics: means over windows, and the distances between what a
// metric makes of them (docs/numerics.md).

/// What is summed over a window, of each channel: weight times sample, and the weight, where the
/// sample was measured. A device gives it so (shaders/framework/window_sums.comp).
struct WindowSum {
    std::array<double, 3> samples = {};
    std::array<double, 3> weights = {};
};

/// The sums of one summary metric over all blocks so far, by material and window.
class WindowTotals {
  public:
    WindowTotals(const Metric& metric, std::uint32_t materials);

    /// Bytes of memory that this takes.
    static std::uint64_t bytes(const Metric& metric, std::uint32_t materials);

    /// The sum over the next block; those of a material come from one thread at a time. Kahan's
    /// compensation keeps what each addition rounds off.
    void add(std::size_t material, std::size_t window, const WindowSum& sum);

    /// Σ w f / Σ w, [material][window]; 0 where nothing was measured.
    std::vector<WindowMean> means() const;

  private:
    struct Total {
        WindowSum sum, lost;
    };
    std::size_t windows_;
    std::vector<Total> totals_;  // [material][window]
};

/// Evaluates the features of some rows of means, [row][window], as [row][feature].
using Features = std::function<void(std::span<const WindowMean> means, std::span<double> features)>;

/// The most rows that summary_distances() has evaluated at a time.
std::size_t most_rows(const Metric& metric);

/// By the metric's twin, on all threads or on that which asks.
enum class Threads { all, own };
Features twin_features(const Metric& metric, Threads threads = Threads::all);

/// The distances between the features of the means, [material][window], with their bounds. Throws
/// InputError where a feature or a distance is NaN or infinite, which names the material as the
/// database does.
MetricDistances summary_distances(const Metric& metric, std::vector<WindowMean> means,
                                  const Features& features, std::span<const std::string> materials);

/// The same distances without their bounds: what a search for parameters takes, again and again.
/// Throws likewise.
std::vector<double> summary_values(const Metric& metric, std::span<const WindowMean> means,
                                   const Features& features,
                                   std::span<const std::string> materials);

/// The first window of a summary metric with a twin that weighs no voxel of the grid above the
/// horizon; none when there is none.
std::optional<std::string> empty_window(const Metric& metric, const Grid& grid);

/// Throws InputError that names the window and the grid.
[[noreturn]] void refuse_empty_window(const Metric& metric, const std::string& window,
                                      const Grid& grid);

}  // namespace merl::engine
