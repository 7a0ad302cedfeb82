#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/database/domain.h"
#include "engine/metric/metric.h"

namespace merl::engine {

// Small grids have no voxel in some windows of a metric. Where a metric with a twin has windows, of
// which it takes means or in which its weight lies, that can be asked before anything is read.

/// The windows of the metric that weigh no voxel of the grid above the horizon, in the order of its
/// header. None of a metric without a twin: its engine sees that.
std::vector<std::string> empty_windows(const Metric& metric, const Grid& grid);

/// What to tell of them, which are some.
std::string empty_windows_text(const Metric& metric, std::span<const std::string> windows,
                               const Grid& grid);

/// Throws InputError with that text if there are any.
void refuse_empty_windows(const Metric& metric, std::span<const std::string> windows,
                          const Grid& grid);

}  // namespace merl::engine
