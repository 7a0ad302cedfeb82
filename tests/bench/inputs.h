#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/device/context.h"
#include "engine/reflectance/database.h"
#include "engine/reflectance/distances.h"
#include "engine/reflectance/metric.h"
#include "scan/pairs.h"

namespace merl::bench {

// Made when first asked for, and kept.

device::Context& context();

/// The database of the settings; for --check a small part of the built-in one.
const reflectance::Database& database();

/// cwcbrt and pawcielab.
const std::array<const reflectance::Metric*, 2>& two_metrics();

/// Distances of database() under two_metrics(), in float32 with bounds.
const scan::Distances& device_distances();

/// The same after refinement.
const scan::Distances& exact_distances();

/// Made-up distances of many materials under two metrics that agree more often than not.
scan::Distances made_up_distances(std::uint32_t materials);

/// Holds distances to the float64 reference on some pairs: each within its bound, or where none is
/// known within 1e-5 of itself. Returns the largest relative error. Throws std::runtime_error.
double check_distances(const reflectance::Database& database,
                       std::span<const reflectance::Metric* const> metrics,
                       std::span<const reflectance::MetricDistances> distances);

/// `materials` materials from the samples of another database, which it keeps in memory: every
/// n-th of them where there are enough, else those and blends of two of them.
class BlendedDatabase final : public reflectance::Database {
  public:
    BlendedDatabase(const reflectance::Database& original, std::size_t materials);
    void read(std::size_t material, reflectance::VoxelRange range, std::span<double> samples,
              reflectance::ContentHash* hash) const override;

  private:
    struct Blend {
        std::size_t a, b;
    };
    std::vector<std::vector<double>> samples_;  // of the original: [material][channel][voxel]
    std::vector<Blend> blends_;
};

}  // namespace merl::bench
