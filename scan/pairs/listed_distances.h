#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scan/pairs/distance_table.h"
#include "scan/pairs/pairs.h"

namespace merl::scan {

/// The distances of some pairs of materials under any number of metrics.
struct ListedDistances {
    std::vector<std::string> names;     ///< ascending bytewise
    std::vector<Pair> pairs;            ///< indices into names, ascending, each once
    std::vector<MetricColumn> metrics;  ///< with a number a pair, in the order of `pairs`

    std::uint32_t materials() const { return static_cast<std::uint32_t>(names.size()); }
};

}  // namespace merl::scan
