#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/database/content_hash.h"
#include "engine/database/database.h"
#include "engine/database/domain.h"

namespace merl::engine {

/// Looks for what a broken copy leaves in a file that still has the right size, while its samples
/// are read; costs nothing that can be measured on a file that is whole.
class DamageCheck {
  public:
    explicit DamageCheck(const Grid& grid) : grid_(grid) {}

    /// Takes the samples of a range, as Database::read gives them. Ranges come in order and without
    /// gaps; `above_horizon` are the voxels of it that are above the horizon.
    void add(VoxelRange range, std::span<const double> samples,
             std::span<const VoxelRun> above_horizon);

    /// The same in two steps, for who goes through the runs anyway: any stretch of consecutive
    /// voxels above the horizon, and the whole range.
    void add_above_horizon(std::array<const double*, 3> planes, std::uint64_t length) {
        above_ += length;
        if (!settled_) {
            look_at(planes, length);
        }
    }
    void add_range(VoxelRange range, std::span<const double> samples);

    /// After the last range: what is wrong, in words that follow the name of the material; empty
    /// when nothing is. `negative_above_horizon` counts samples with a negative channel there,
    /// `hash` has seen the same samples as its `material`.
    std::string fault(std::uint64_t negative_above_horizon, const ContentHash& hash,
                      std::size_t material) const;

  private:
    /// What is known of a channel above the horizon. Negative numbers do not count.
    struct Channel {
        std::optional<double> first;  // number, if there is one
        bool positive = false;        // some number is above zero
        bool varies = false;          // some number is not the first
    };

    /// Consecutive samples of a channel that are exactly zero, in the order of the file.
    struct Zeros {
        std::uint64_t first = 0;     // file index of the voxel
        std::uint64_t length = 0;    // 0: there is none
        std::uint64_t contrast = 0;  // how many have another channel that is not zero
        bool unmeasured = false;     // some have another channel that is negative
    };

    void look_at(std::array<const double*, 3> planes, std::uint64_t length);
    void extend(std::size_t channel, VoxelRange range, std::span<const double> samples,
                std::uint64_t from, std::uint64_t to);
    void close(std::size_t channel);

    Grid grid_;
    std::array<Channel, 3> channels_;
    bool settled_ = false;                     // all channels are positive somewhere and vary
    std::uint64_t above_ = 0;                  // voxels above the horizon so far
    std::array<Zeros, 3> open_;                // those that may go on in the next range
    std::array<std::uint64_t, 3> holes_ = {};  // zeros that a broken copy has left
    std::array<std::uint64_t, 3> first_hole_ = {};
};

/// Those of the materials that have the same content as others, together; `hashes` has that of
/// each.
std::vector<std::vector<std::string>> copies_among(std::span<const std::string> materials,
                                                   std::span<const std::string> hashes);

}  // namespace merl::engine
