#include "engine/reflectance/slab_reader.h"

#include <tbb/parallel_for.h>

#include <stdexcept>

namespace merl::reflectance {

SlabReader::SlabReader(const Database& database, const VoxelList& voxels)
    : database_(database),
      voxels_(voxels),
      counts_(database.materials().size()),
      hash_(database.materials().size()) {}

void SlabReader::read(const Slab& slab, const Use& use) {
    // What lies below the horizon belongs to the content too.
    const bool is_last = slab.first + slab.voxels == voxels_.size() || slab.runs.empty();
    const VoxelRange file = {file_position_,
                             is_last ? database_.grid().voxels()
                                     : slab.runs.back().file_index + slab.runs.back().length};
    file_position_ = file.last;
    tbb::parallel_for(std::size_t{0}, counts_.size(), [&](std::size_t material) {
        auto& blocks = blocks_.local();
        blocks.resize(slab.blocks());
        counts_[material] += read_blocks(database_, material, file, slab.runs, blocks, &hash_);
        use(material, blocks);
    });
}

std::string SlabReader::content_hash() const {
    if (file_position_ != database_.grid().voxels()) {
        throw std::logic_error("the content hash was asked for before the whole database was read");
    }
    return hash_.digest(database_.materials(), database_.grid().text());
}

}  // namespace merl::reflectance
