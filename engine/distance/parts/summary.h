#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/distance/parts/pair_list.h"
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

    /// Σ w f / Σ w, [material][window]; 0 where nothing was measured. Throws InputError where Σ w
    /// is so small or large that products leave the range of float64.
    std::vector<WindowMean> means() const;

  private:
    struct Total {
        WindowSum sum, lost;
    };
    const Metric* metric_;
    std::size_t windows_;
    std::vector<Total> totals_;  // [material][window]
};

/// The distances of pairs between the features of the means, [material][window], by the metric's
/// twin: the same bits whatever engine summed. `bounds` are proven (docs/numerics.md). Throws
/// InputError where a feature of a material in a pair or a distance is NaN or infinite, which names
/// the material as the database does.
MetricDistances summary_distances(const Metric& metric, std::vector<WindowMean> means,
                                  const PairList& pairs, std::span<const std::string> materials);

/// Evaluates the features of some rows of means, [row][window], as [row][feature].
using Features = std::function<void(std::span<const WindowMean> means, std::span<double> features)>;

/// The same of a metric without a twin, whose features something else evaluates. `bounds` are
/// estimates. Throws likewise.
MetricDistances estimated_summary_distances(const Metric& metric, std::vector<WindowMean> means,
                                            const Features& features, const PairList& pairs,
                                            std::span<const std::string> materials);

/// The most rows that are evaluated at a time for that.
std::size_t most_rows(const Metric& metric);

/// By the metric's twin, on the thread that asks.
Features twin_features(const Metric& metric);

/// The distances of all pairs without bounds, by whatever evaluates features: what a search for
/// parameters takes, again and again. Throws likewise.
std::vector<double> summary_values(const Metric& metric, std::span<const WindowMean> means,
                                   const Features& features,
                                   std::span<const std::string> materials);

}  // namespace merl::engine
