#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "engine/database/database.h"

namespace merl::engine {

/// Keeps samples that take time to compute, as many as it may, so that reading them again is a
/// copy. For a database that is computed: its read() and keep() hand on to these.
class KeptSamples {
  public:
    /// What it does with more than it may keep: keep what came first, for materials that are read
    /// from end to end one after the other, or what came last, where ranges of all of them are.
    enum class Order { first, last };

    KeptSamples(const Grid& grid, std::size_t materials, Order order = Order::first);

    /// As Database::keep(). Until it is called nothing is kept.
    std::uint64_t keep(std::uint64_t bytes);

    /// Computes the three planes of a range of one material.
    using Compute = std::function<void(VoxelRange range, std::span<double> samples)>;

    /// As Database::read(); `compute` has to give the same numbers whatever the range. Any thread
    /// may call it, and `compute` must not run other work of its caller's meanwhile.
    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const Compute& compute);

  private:
    /// Three planes of the voxels of a chunk.
    using Planes = std::shared_ptr<const std::vector<double>>;

    VoxelRange chunk(std::uint64_t number) const;
    Planes obtain(std::size_t material, std::uint64_t number, const Compute& compute);
    bool has_room(std::uint64_t bytes) const;

    const std::uint64_t voxels_;
    const std::uint64_t chunks_;     // of a material
    const std::uint64_t all_bytes_;  // of all materials
    const Order order_;
    std::mutex mutex_;                // of what follows
    std::vector<Planes> kept_;        // [material][chunk]
    std::deque<std::size_t> places_;  // in it, as they came; of Order::last
    std::uint64_t kept_bytes_ = 0;
    std::uint64_t most_bytes_ = 0;
};

}  // namespace merl::engine
