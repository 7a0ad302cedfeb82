#include "engine/database/database.h"

#include <algorithm>

namespace merl::engine {

void read_material(
    const Database& database, std::size_t material, const SampleSink& sink,
    const std::function<void(VoxelRange range, std::span<const double> samples)>& use) {
    constexpr std::uint64_t kVoxelsAtATime = 16384;  // whose planes stay in cache
    const std::uint64_t voxels = database.grid().voxels();
    std::vector<double> samples(3 * std::min(kVoxelsAtATime, voxels));
    for (std::uint64_t first = 0; first < voxels; first += kVoxelsAtATime) {
        const VoxelRange range = {first, std::min(first + kVoxelsAtATime, voxels)};
        const auto planes = std::span(samples).first(3 * range.size());
        database.read(material, range, planes, sink);
        use(range, planes);
    }
}

}  // namespace merl::engine
