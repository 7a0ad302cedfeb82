#include "scan/statistics/krippendorff.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>

namespace merl::scan {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

/// `times` says how often each unit counts; empty: once.
double alpha(std::span<const UnitCounts> units, std::span<const std::uint32_t> times) {
    const std::size_t values = units.empty() ? 0 : units[0].size();
    std::vector<double> totals(values);          // n_c
    std::vector<double> pairs(values * values);  // o_ck, the coincidences
    for (std::size_t u = 0; u < units.size(); ++u) {
        const double judges = std::accumulate(units[u].begin(), units[u].end(), 0.0);
        const double weight = times.empty() ? 1 : times[u];
        if (judges < 2 || weight == 0) {
            continue;
        }
        for (std::size_t c = 0; c < values; ++c) {
            totals[c] += weight * units[u][c];
            for (std::size_t k = 0; k < values; ++k) {
                const double others = units[u][k] - (c == k ? 1.0 : 0.0);
                pairs[c * values + k] += weight * units[u][c] * others / (judges - 1);
            }
        }
    }
    const double all = std::accumulate(totals.begin(), totals.end(), 0.0);
    double observed = 0;
    double expected = 0;
    for (std::size_t c = 0; c < values; ++c) {
        double between = totals[c] / 2;
        for (std::size_t k = c + 1; k < values; ++k) {
            // The values from c to k, the ends by half.
            const double distance = between + totals[k] / 2;
            between += totals[k];
            observed += pairs[c * values + k] * distance * distance;
            expected += totals[c] * totals[k] * distance * distance;
        }
    }
    return expected == 0 ? none : 1 - (all - 1) * observed / expected;
}

}  // namespace

double ordinal_alpha(std::span<const UnitCounts> units) {
    return alpha(units, {});
}

Estimate ordinal_alpha(std::span<const UnitCounts> units, const BootstrapOptions& options,
                       const std::function<void(double share)>& progress) {
    const auto judged = std::ranges::count_if(units, [](const auto& unit) {
        return std::accumulate(unit.begin(), unit.end(), std::uint64_t{0}) > 1;
    });
    const auto reason =
        too_few(static_cast<std::uint64_t>(judged), "configurations with two votes or more");
    std::vector<double> samples;
    for (std::uint32_t i = 0; i < options.replicates && reason.empty(); ++i) {
        const auto times = resample(options.seed, i, static_cast<std::uint32_t>(units.size()));
        samples.push_back(alpha(units, times));
        if (progress && i % replicates_per_update == 0) {
            progress(static_cast<double>(i) / options.replicates);
        }
    }
    return bootstrapped(ordinal_alpha(units), samples, reason);
}

}  // namespace merl::scan
