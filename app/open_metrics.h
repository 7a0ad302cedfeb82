#pragma once

#include <string>
#include <vector>

#include "engine/reflectance/metric.h"

namespace merl::app {

/// What --metrics takes, for the footers of --help.
inline constexpr const char* kMetricsHelp =
    "A metric is a name of the library (merl-scan metrics) or a file that ends in .glsl, with\n"
    "parameters after colons: pawcielab, pawcielab:white=80, ./my_metric.glsl:alpha=0.3:beta=2.\n";

/// The metrics that the texts name, in their order; "all" is the whole library. Throws Error: what
/// open_metric() throws, and (usage) when two have the same name, as columns of tables would.
std::vector<reflectance::Metric> open_metrics(const std::vector<std::string>& texts);

}  // namespace merl::app
