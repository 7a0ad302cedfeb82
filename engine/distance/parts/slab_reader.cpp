#include "engine/distance/parts/slab_reader.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <stdexcept>

namespace merl::engine {

SlabReader::SlabReader(const Database& database, const VoxelList& voxels, bool marks_gaps)
    : database_(database),
      voxels_(voxels),
      counts_(database.materials().size()),
      checks_(database.materials().size(), DamageCheck(database.grid())),
      hash_(database.materials().size()),
      marks_gaps_(marks_gaps) {}

void SlabReader::read(const Slab& slab, const Use& use) {
    // What lies below the horizon belongs to the content too.
    const bool is_last = slab.first + slab.voxels == voxels_.size() || slab.runs.empty();
    const VoxelRange file = {file_position_,
                             is_last ? database_.grid().voxels()
                                     : slab.runs.back().file_index + slab.runs.back().length};
    file_position_ = file.last;
    tbb::parallel_for(std::size_t{0}, counts_.size(), [&](std::size_t material) {
        auto& [blocks, gaps] = read_.local();
        blocks.resize(slab.blocks());
        counts_[material] +=
            read_blocks(database_, material, file, slab.runs, blocks, hash_.sink(material),
                        &checks_[material], marks_gaps_ ? &gaps : nullptr);
        use(material, blocks, gaps);
    });
}

void SlabReader::expect_all_read() const {
    if (file_position_ != database_.grid().voxels()) {
        throw std::logic_error("the hashes were asked for before the whole database was read");
    }
}

std::vector<std::string> SlabReader::material_hashes() const {
    expect_all_read();
    std::vector<std::string> hashes;
    for (std::size_t m = 0; m < checks_.size(); ++m) {
        hashes.push_back(hash_.material_digest(m, database_.grid().text()));
    }
    return hashes;
}

std::vector<std::string> SlabReader::plane_hashes() const {
    expect_all_read();
    std::vector<std::string> hashes;
    for (std::size_t m = 0; m < checks_.size(); ++m) {
        hashes.push_back(hash_.planes(m));
    }
    return hashes;
}

std::vector<std::string> SlabReader::warnings() const {
    expect_all_read();
    std::vector<std::string> warnings;
    for (std::size_t m = 0; m < checks_.size(); ++m) {
        const auto fault = checks_[m].fault(counts_[m].negative_above_horizon, hash_, m);
        if (!fault.empty()) {
            warnings.push_back(
                fmt::format("{} of {}: {}", database_.materials()[m], database_.name(), fault));
        }
    }
    return warnings;
}

}  // namespace merl::engine
