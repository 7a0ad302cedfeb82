#pragma once

#include <string>
#include <vector>

#include "engine/metric/metric.h"

namespace merl::app {

/// What --metrics takes, for the footers of --help.
inline constexpr const char* kMetricsHelp =
    "A metric is a name of the library (merl-scan metrics) or a file that ends in .glsl, with\n"
    "parameters after colons: pawcielab, pawcielab:white=80, ./my_metric.glsl:alpha=0.3:beta=2.\n";

/// pipeline::open_metrics(); a file is compiled and tried on `device` in a process of its own first
/// (guard.h: call this before a device is opened), so that none can hang or crash the program.
/// Throws what that throws, and Error (input) for a file that cannot be used.
std::vector<engine::Metric> open_metrics(const std::vector<std::string>& texts,
                                         const std::string& device);

}  // namespace merl::app
