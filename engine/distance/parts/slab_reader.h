#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/database/content_hash.h"
#include "engine/database/database.h"
#include "engine/database/domain.h"
#include "engine/distance/parts/block_reader.h"
#include "engine/distance/parts/slab.h"

namespace merl::engine {

/// Reads a database slab by slab, in order.
class SlabReader {
  public:
    /// `marks_gaps`: whether anybody wants to know what was not measured.
    SlabReader(const Database& database, const VoxelList& voxels, bool marks_gaps = false);

    /// What is to be done with the samples of one material at the voxels of a slab, and with what
    /// was not measured of them (read_blocks); called from several threads, for each material once.
    using Use = std::function<void(std::size_t material, std::span<const BlockSamples> blocks,
                                   std::span<const BlockGaps> gaps)>;

    /// Slabs must come in order and without gaps.
    void read(const Slab& slab, const Use& use);

    /// After the last slab.
    const std::vector<MaterialCounts>& counts() const { return counts_; }

    std::vector<std::string> material_hashes() const;

    /// Of each material the hashes of its planes, from which all others are made (content_hash.h).
    std::vector<std::string> plane_hashes() const;

    /// What looks like a broken copy, for the user: damaged materials. Voxels that were not visited
    /// count as below the horizon.
    std::vector<std::string> warnings() const;

  private:
    void expect_all_read() const;

    const Database& database_;
    const VoxelList& voxels_;
    std::vector<MaterialCounts> counts_;
    std::vector<DamageCheck> checks_;
    ContentHash hash_;
    std::uint64_t file_position_ = 0;  // voxels of each file read so far
    bool marks_gaps_;
    struct Read {
        std::vector<BlockSamples> blocks;
        std::vector<BlockGaps> gaps;
    };
    tbb::enumerable_thread_specific<Read> read_;
};

}  // namespace merl::engine
