#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/device/context.h"
#include "engine/metric/metric.h"

namespace merl::pipeline {

/// The metrics that the texts name (open_metric), in their order; "all" is the whole library. A
/// user's is not compiled yet. Throws Error: what open_metric() throws, and (usage) when two have
/// the same name, as columns of tables would.
std::vector<engine::Metric> open_metrics(std::span<const std::string> texts);

/// Takes metrics that are here because of "all" off those that open_metrics() made of the texts,
/// where a window of theirs has no voxel on the grid. Returns why, one line for each.
std::vector<std::string> leave_out_empty(std::vector<engine::Metric>& metrics,
                                         std::span<const std::string> texts,
                                         const engine::Grid& grid);

/// Compiles a user's metric and computes a distance of two materials on a tiny grid with it, on a
/// device as Engines takes them. A hostile file may hang or crash the compiler or the driver: a
/// program runs this in a process of its own. Throws Error (input) for a file that cannot be used.
void try_metric(const engine::Metric& metric, const device::ContextOptions& device);

}  // namespace merl::pipeline
