#include "engine/distance/parts/window_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "engine/base/error.h"

namespace merl::engine {

std::vector<std::string> empty_windows(const Metric& metric, const Grid& grid) {
    // Voxels from all over the domain first: on a grid like MERL's the first block shows all
    // windows.
    constexpr std::uint64_t kStride = 100'003;  // a prime, so that every voxel has its turn
    if (metric.twin.window == nullptr) {
        return {};
    }
    const Domain domain(grid);
    const std::uint64_t count = grid.voxels();
    const std::uint64_t stride = count % kStride == 0 ? 1 : kStride;
    std::vector<bool> is_empty(metric.header.windows.size(), true);
    std::vector<Voxel> voxels(kBlockVoxels);
    BlockWeights weights;
    std::uint64_t at = 0;
    for (std::uint64_t first = 0;
         first < count && std::ranges::find(is_empty, true) != is_empty.end();
         first += kBlockVoxels) {
        const std::uint64_t size = std::min<std::uint64_t>(kBlockVoxels, count - first);
        for (std::uint64_t k = 0; k < size; ++k) {
            voxels[k] = domain.voxel(at);
            at = (at + stride) % count;
        }
        for (std::uint32_t w = 0; w < is_empty.size(); ++w) {
            if (!is_empty[w]) {
                continue;
            }
            metric.twin.window(metric.parameters, std::span<const Voxel, kBlockVoxels>(voxels), w,
                               weights);
            for (std::uint64_t k = 0; k < size; ++k) {
                if (voxels[k].above_horizon() && weights[k] > 0) {
                    is_empty[w] = false;
                }
            }
        }
    }
    std::vector<std::string> empty;
    for (std::size_t w = 0; w < is_empty.size(); ++w) {
        if (is_empty[w]) {
            empty.push_back(metric.header.windows[w].name);
        }
    }
    return empty;
}

std::string empty_windows_text(const Metric& metric, std::span<const std::string> windows,
                               const Grid& grid) {
    std::string names;
    for (const auto& window : windows) {
        names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", window);
    }
    const bool is_one = windows.size() == 1;
    return fmt::format("{}: its {} {} {} no voxel above the horizon on the grid {}", metric.name,
                       is_one ? "window" : "windows", names, is_one ? "has" : "have", grid.text());
}

void refuse_empty_windows(const Metric& metric, std::span<const std::string> windows,
                          const Grid& grid) {
    if (!windows.empty()) {
        throw InputError(empty_windows_text(metric, windows, grid));
    }
}

}  // namespace merl::engine
