#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "scan/statistics/bootstrap.h"
#include "scan/statistics/estimate.h"

namespace merl::scan {

/// How many judges gave a unit each of the ordered values.
using UnitCounts = std::vector<std::uint32_t>;

/// Krippendorff's alpha for ordinal data (K. Krippendorff, Computing Krippendorff's
/// Alpha-Reliability, 2011): 1 - D_o / D_e. All units have as many values; judges may be missing
/// anywhere, and units with fewer than two judges are left out. Not a number where all that is left
/// is one value, or nothing.
double ordinal_alpha(std::span<const UnitCounts> units);

/// The same with a 95 % percentile interval from drawing the units with replacement; those with
/// fewer than two judges do not count among them. `progress` is called with the share that is done;
/// what it throws comes out.
Estimate ordinal_alpha(std::span<const UnitCounts> units, const BootstrapOptions& options,
                       const std::function<void(double share)>& progress = {});

}  // namespace merl::scan
