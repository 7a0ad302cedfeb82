#include "engine/distance/parts/pair_totals.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <stdexcept>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

void add_blocks(std::span<const float> parts, std::size_t blocks, std::vector<double>& totals) {
    constexpr std::size_t kAtATime = 512;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, totals.size(), kAtATime),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                          for (std::size_t block = 0; block < blocks; ++block) {
                              const float* const part = parts.data() + block * totals.size();
                              for (std::size_t i = range.begin(); i < range.end(); ++i) {
                                  totals[i] += static_cast<double>(part[i]);
                              }
                          }
                      });
}

}  // namespace

PairTotals::PairTotals(const Metric& metric, const PairTiles& tiles, std::uint64_t grid_voxels,
                       const Roundings& roundings)
    : metric_(&metric),
      tiles_(tiles),
      grid_voxels_(grid_voxels),
      bound_(metric, grid_voxels, roundings),
      differences_(tiles.count() * tiles.pairs_of_tile()),
      slopes_(metric.has_slopes() ? differences_.size() : 0),
      norms_(metric.has_norms() ? tiles.padded_materials() : 0) {}

std::uint64_t PairTotals::bytes(const Metric& metric, const PairTiles& tiles) {
    const std::uint64_t pairs = tiles.count() * tiles.pairs_of_tile();
    return ((metric.has_slopes() ? 2 : 1) * pairs +
            (metric.has_norms() ? tiles.padded_materials() : 0)) *
           sizeof(double);
}

void PairTotals::add(const PartialSums& sums, std::size_t blocks) {
    add_blocks(sums.differences, blocks, differences_);
    add_blocks(sums.slopes, blocks, slopes_);
    add_blocks(sums.norms, blocks, norms_);
}

MetricDistances PairTotals::distances() const {
    MetricDistances result;
    result.values.reserve(tiles_.pairs->size());
    result.bounds.reserve(tiles_.pairs->size());
    tiles_.pairs->each([&](std::size_t pair, std::uint32_t i, std::uint32_t j) {
        const std::size_t at = tiles_.sum_index(pair, i, j);
        const double sum = differences_[at];
        if (!std::isfinite(sum) && metric_->is_checked()) {
            throw InputError(
                fmt::format("{}: the sum over the voxels is {} for materials {} and "
                            "{}: beyond the range of float32",
                            metric_->file, sum, i, j));
        }
        if (!std::isfinite(sum) || sum < 0) {
            throw std::logic_error(fmt::format("metric {}: the sum of materials {} and {} is {}",
                                               metric_->name, i, j, sum));
        }
        result.values.push_back(std::sqrt(sum / static_cast<double>(grid_voxels_)));
        result.bounds.push_back(
            bound_.distance(sum, {.norm_a = norms_.empty() ? 0 : norms_[i],
                                  .norm_b = norms_.empty() ? 0 : norms_[j],
                                  .slopes = slopes_.empty() ? 0 : slopes_[at]}));
    });
    return result;
}

}  // namespace merl::engine
