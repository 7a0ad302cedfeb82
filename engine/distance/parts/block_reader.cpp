#include "engine/distance/parts/block_reader.h"

#include <algorithm>
#include <array>

#include "engine/base/widest_vectors.h"

namespace merl::engine {
namespace {

/// Voxels that are read at a time: three planes of them stay in the second-level cache.
constexpr std::uint64_t kReadVoxels = 16384;

MERL_SCAN_WIDEST_VECTORS std::uint64_t count_negative(const double* red, const double* green,
                                                      const double* blue, std::uint64_t size) {
    std::uint64_t count = 0;
    for (std::uint64_t i = 0; i < size; ++i) {
        count += std::min({red[i], green[i], blue[i]}) < 0 ? 1U : 0U;
    }
    return count;
}

MERL_SCAN_WIDEST_VECTORS void copy_without_negative(const double* from, double* to,
                                                    std::uint64_t size) {
    for (std::uint64_t i = 0; i < size; ++i) {
        to[i] = from[i] > 0 ? from[i] : 0.0;
    }
}

/// Copies `length` numbers of each plane to a position in the blocks. How many voxels have a
/// negative one.
std::uint64_t copy_to_blocks(const std::array<const double*, 3>& planes, std::uint64_t length,
                             std::uint64_t position, std::span<BlockSamples> blocks) {
    std::uint64_t negative = 0;
    for (std::uint64_t done = 0; done < length;) {
        const std::uint64_t at = (position + done) % kBlockVoxels;
        const std::uint64_t size = std::min(length - done, kBlockVoxels - at);
        auto& block = blocks[(position + done) / kBlockVoxels];
        negative += count_negative(planes[0] + done, planes[1] + done, planes[2] + done, size);
        for (std::size_t plane = 0; plane < planes.size(); ++plane) {
            copy_without_negative(planes[plane] + done, block[plane].data() + at, size);
        }
        done += size;
    }
    return negative;
}

/// Marks what is negative among `length` numbers of each plane.
void mark_negative(std::span<const double* const, 3> planes, std::uint64_t length,
                   std::uint64_t position, std::span<BlockGaps> gaps) {
    for (std::size_t plane = 0; plane < planes.size(); ++plane) {
        for (std::uint64_t i = 0; i < length; ++i) {
            if (planes[plane][i] < 0) {
                const std::uint64_t at = position + i;
                gaps[at / kBlockVoxels][plane].set(at % kBlockVoxels);
            }
        }
    }
}

void fill_up(std::uint64_t voxels, std::span<BlockSamples> blocks) {
    if (const std::uint64_t filled = voxels % kBlockVoxels; filled != 0) {
        for (auto& plane : blocks[voxels / kBlockVoxels]) {
            std::fill(plane.begin() + static_cast<std::ptrdiff_t>(filled), plane.end(), 0.0);
        }
    }
}

}  // namespace

MaterialCounts read_blocks(const Database& database, std::size_t material, VoxelRange file,
                           std::span<const VoxelRun> runs, std::span<BlockSamples> blocks,
                           const SampleSink& sink, DamageCheck* check,
                           std::vector<BlockGaps>* gaps) {
    if (gaps != nullptr) {
        gaps->clear();
    }
    thread_local std::vector<double> scratch;
    scratch.resize(3 * kReadVoxels);
    MaterialCounts counts;
    auto run = runs.begin();
    std::uint64_t done_of_run = 0;
    for (std::uint64_t first = file.first; first < file.last; first += kReadVoxels) {
        const VoxelRange part = {first, std::min(first + kReadVoxels, file.last)};
        const std::span<double> samples(scratch.data(), 3 * part.size());
        database.read(material, part, samples, sink);
        const double* const red = samples.data();
        const double* const green = red + part.size();
        const double* const blue = green + part.size();
        std::uint64_t seen = 0;  // of the part
        const auto skip_to = [&](std::uint64_t to) {
            counts.negative += count_negative(red + seen, green + seen, blue + seen, to - seen);
            seen = to;
        };
        if (check != nullptr) {
            check->add_range(part, samples);
        }
        while (run != runs.end() && run->file_index + done_of_run < part.last) {
            const std::uint64_t from = run->file_index + done_of_run - part.first;
            const std::uint64_t length = std::min(run->length - done_of_run, part.size() - from);
            const std::uint64_t position = run->position - runs.front().position + done_of_run;
            skip_to(from);
            const std::array planes = {red + from, green + from, blue + from};
            const std::uint64_t negative = copy_to_blocks(planes, length, position, blocks);
            seen += length;
            counts.negative += negative;
            counts.negative_above_horizon += negative;
            if (gaps != nullptr && negative > 0) {
                gaps->resize(blocks.size());
                mark_negative(planes, length, position, *gaps);
            }
            if (check != nullptr) {
                check->add_above_horizon(planes, length);
            }
            done_of_run += length;
            if (done_of_run == run->length) {
                ++run;
                done_of_run = 0;
            }
        }
        skip_to(part.size());
    }
    if (!runs.empty()) {
        fill_up(runs.back().position + runs.back().length - runs.front().position, blocks);
    }
    return counts;
}

std::vector<Voxel> voxels_of(const Domain& domain, std::span<const VoxelRun> runs) {
    if (runs.empty()) {
        return {};
    }
    const std::uint64_t first = runs.front().position;
    const std::uint64_t last = runs.back().position + runs.back().length;
    std::vector<Voxel> voxels(block_count(last - first) * kBlockVoxels);
    for (const auto& run : runs) {
        for (std::uint64_t i = 0; i < run.length; ++i) {
            voxels[run.position - first + i] = domain.voxel(run.file_index + i);
        }
    }
    return voxels;
}

}  // namespace merl::engine
