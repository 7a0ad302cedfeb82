#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "scan/statistics/bootstrap.h"

namespace merl::scan {

/// A number that one judge gave to one configuration.
struct CrossedValue {
    std::uint32_t judge;
    std::uint32_t configuration;
    double value;
};

/// Means of `values` as they would be with other judges and other materials: both are drawn with
/// replacement, independently, and each draw changes the mean by the influence of the values
/// that belong to it (docs/experiment.md). `materials` has those of each configuration, 0 to
/// `material_count` - 1, each once. The same seed gives the same draws for any values, so figures
/// of the same votes can be compared draw by draw. Empty without values. `progress` is called with
/// the share that is done; what it throws comes out.
std::vector<double> crossed_bootstrap(std::span<const CrossedValue> values, std::uint32_t judges,
                                      std::span<const std::vector<std::uint32_t>> materials,
                                      std::uint32_t material_count, const BootstrapOptions& options,
                                      const std::function<void(double share)>& progress = {});

}  // namespace merl::scan
