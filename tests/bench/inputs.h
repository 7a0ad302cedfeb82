#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/device/context.h"
#include "engine/distance/distances.h"
#include "engine/metric/metric.h"
#include "scan/pairs/pairs.h"

namespace merl::bench {

// Made when first asked for, and kept.

device::Context& context();

/// As the rule has it with that device, and its shaders for everything.
engine::Engines& engines();
engine::Engines& shader_engines();

/// The database of the settings; for --check a small part of the built-in one.
const engine::Database& database();

/// cwcbrt and pawcielab.
const std::array<const engine::Metric*, 2>& two_metrics();

/// Distances of database() under two_metrics(), in float32 with bounds.
const scan::Distances& device_distances();

/// The same after refinement.
const scan::Distances& exact_distances();

/// Made-up distances of many materials under two metrics that agree more often than not.
scan::Distances made_up_distances(std::uint32_t materials);

/// Holds the distances of these pairs to the float64 reference on some of them: each within its
/// bound, or where none is known within 1e-5 of itself. Returns the largest relative error. Throws
/// std::runtime_error.
double check_distances(const engine::Database& database,
                       std::span<const engine::Metric* const> metrics,
                       const engine::PairList& pairs,
                       std::span<const engine::MetricDistances> distances);

/// The built-in materials and blends of them (blends_database.h), with `divisor` times fewer steps
/// of MERL's grid along each angle; ten times for --check.
std::unique_ptr<engine::Database> coarse_blends(std::size_t materials, std::uint32_t divisor);

/// The grid of that.
engine::Grid coarse_grid(std::uint32_t divisor);

}  // namespace merl::bench
