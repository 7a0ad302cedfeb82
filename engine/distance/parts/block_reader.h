#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/database/damage.h"
#include "engine/database/database.h"
#include "engine/database/domain.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// What reading a material found.
struct MaterialCounts {
    std::uint64_t negative = 0;                // samples with at least one negative channel
    std::uint64_t negative_above_horizon = 0;  // of them, where a metric would have seen them

    MaterialCounts& operator+=(const MaterialCounts& more) {
        negative += more.negative;
        negative_above_horizon += more.negative_above_horizon;
        return *this;
    }
};

/// The samples of one block of one material that were not measured, of each channel.
using BlockGaps = std::array<std::bitset<kBlockVoxels>, 3>;

/// Blocks that hold so many voxels.
constexpr std::uint64_t block_count(std::uint64_t voxels) {
    return (voxels + kBlockVoxels - 1) / kBlockVoxels;
}

/// Reads the range `file` of a material and fills `blocks` with its samples at the visited voxels
/// `runs`, all of which are in that range: negative numbers as zero, and zeros after the last
/// voxel. With `gaps` that becomes which samples were negative, for each block, or empty where none
/// was. With `sink` and `check`, what was read goes to them. Any thread may call it. Throws what
/// Database::read() throws.
MaterialCounts read_blocks(const Database& database, std::size_t material, VoxelRange file,
                           std::span<const VoxelRun> runs, std::span<BlockSamples> blocks,
                           const SampleSink& sink = {}, DamageCheck* check = nullptr,
                           std::vector<BlockGaps>* gaps = nullptr);

/// The voxels themselves, in whole blocks that are filled up with empty ones.
std::vector<Voxel> voxels_of(const Domain& domain, std::span<const VoxelRun> runs);

}  // namespace merl::engine
