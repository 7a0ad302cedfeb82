#include "engine/reflectance/reference.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "engine/reflectance/slab_reader.h"

namespace merl::reflectance {
namespace {

/// Blocks whose sums are held at a time, before they are added to the totals in order.
constexpr std::uint64_t kBlocksAtATime = 256;

/// Bytes of samples that one thread holds at a time: fewer files are opened, and they stay in
/// cache.
constexpr std::uint64_t kThreadBytes = 16ULL << 20U;

/// A sum of this or more has all its digits, whatever its terms lost below 2^-1022.
constexpr double kSmallestSum = 0x1p-900;

/// What samples are multiplied with where their sum is smaller: then the square of the smallest
/// difference that there is, 2^-1074, is in range, and so are those of a sum below kSmallestSum.
constexpr int kScaleExponent = 600;

/// The materials of all pairs, ascending.
std::vector<std::uint32_t> materials_of(std::span<const ReferenceRequest> requests) {
    std::vector<std::uint32_t> materials;
    for (const auto& request : requests) {
        for (const auto& [a, b] : request.pairs) {
            materials.push_back(a);
            materials.push_back(b);
        }
    }
    std::ranges::sort(materials);
    materials.erase(std::unique(materials.begin(), materials.end()), materials.end());
    return materials;
}

/// What a thread works with, kept from part to part: allocating it anew costs as much as the work.
struct Workspace {
    std::vector<std::vector<BlockSamples>> samples;   // per material, block by block
    std::vector<std::unique_ptr<BlockSamples>> grid;  // per material: one block, transformed
};

/// One block's sums of all requests, one request after the other.
using Sums = std::vector<double>;

/// Sums of every request and pair over each block of a slab.
void sum_slab(const Database& database, std::span<const ReferenceRequest> requests,
              std::span<const std::uint32_t> materials, const Slab& slab, Workspace& work,
              std::span<Sums> sums) {
    const VoxelRange file = {slab.runs.front().file_index,
                             slab.runs.back().file_index + slab.runs.back().length};
    work.samples.resize(database.materials().size());
    work.grid.resize(database.materials().size());
    for (const auto material : materials) {
        work.samples[material].resize(slab.blocks());
        read_blocks(database, material, file, slab.runs, work.samples[material]);
    }
    std::size_t at = 0;  // of the request in the sums of a block
    auto& grid = work.grid;
    for (const auto& request : requests) {
        const auto used = materials_of({&request, 1});
        for (std::uint64_t block = 0; block < slab.blocks(); ++block) {
            const auto of_block = slab.voxels_of_block(block);
            BlockWeights weights = {};
            request.metric->twin.weigh(request.metric->parameters, of_block, weights);
            std::fill(weights.begin() + static_cast<std::ptrdiff_t>(slab.filled(block)),
                      weights.end(), 0.0);
            for (const auto material : used) {
                if (!grid[material]) {
                    grid[material] = std::make_unique<BlockSamples>();
                }
                request.metric->twin.transform(request.metric->parameters, of_block,
                                               work.samples[material][block], *grid[material]);
                if (request.scale != 1) {
                    for (auto& channel : *grid[material]) {
                        std::ranges::transform(channel, channel.begin(), [&](double sample) {
                            return sample * request.scale;
                        });
                    }
                }
            }
            for (std::size_t p = 0; p < request.pairs.size(); ++p) {
                const auto [a, b] = request.pairs[p];
                sums[block][at + p] = request.metric->twin.sum(request.metric->parameters, *grid[a],
                                                               *grid[b], weights);
            }
        }
        at += request.pairs.size();
    }
}

/// Computes again, scaled, the distances whose sums are too small. They are those of copies, too,
/// where all differences are 0. Powers below one are in range whatever they are of.
void recompute_smallest(const Database& database, std::span<const ReferenceRequest> requests,
                        VoxelSet set, const std::function<void(double)>& progress,
                        std::vector<std::vector<double>>& distances) {
    const double least = std::sqrt(kSmallestSum / static_cast<double>(database.grid().voxels()));
    const auto is_small = [=](const ReferenceRequest& request, double distance) {
        return request.scale == 1 && request.metric->header.degree >= 1 && distance < least;
    };
    std::vector<ReferenceRequest> again;
    bool any = false;
    for (std::size_t r = 0; r < requests.size(); ++r) {
        auto& scaled = again.emplace_back(
            ReferenceRequest{requests[r].metric, {}, std::ldexp(1.0, kScaleExponent)});
        for (std::size_t p = 0; p < requests[r].pairs.size(); ++p) {
            if (is_small(requests[r], distances[r][p])) {
                scaled.pairs.push_back(requests[r].pairs[p]);
                any = true;
            }
        }
    }
    if (!any) {
        return;
    }
    const auto recomputed = reference_distances(database, again, set, progress);
    for (std::size_t r = 0; r < requests.size(); ++r) {
        auto next = recomputed[r].begin();
        for (double& distance : distances[r]) {
            if (is_small(requests[r], distance)) {
                distance = *next++;
            }
        }
    }
}

}  // namespace

std::vector<std::vector<double>> reference_distances(const Database& database,
                                                     std::span<const ReferenceRequest> requests,
                                                     VoxelSet set,
                                                     const std::function<void(double)>& progress) {
    const Domain domain(database.grid());
    const VoxelList list(domain, set);
    const std::uint64_t blocks = block_count(list.size());
    const auto materials = materials_of(requests);
    std::size_t pair_count = 0;
    for (const auto& request : requests) {
        pair_count += request.pairs.size();
    }
    const std::uint64_t slab_blocks = std::clamp<std::uint64_t>(
        kThreadBytes / (sizeof(BlockSamples) * std::max<std::size_t>(1, materials.size())), 1, 64);

    Sums totals(pair_count);
    std::vector<Sums> sums(kBlocksAtATime, Sums(pair_count));
    tbb::enumerable_thread_specific<Workspace> workspaces;
    for (std::uint64_t first = 0; first < blocks && pair_count > 0; first += kBlocksAtATime) {
        const std::uint64_t count = std::min(kBlocksAtATime, blocks - first);
        const std::uint64_t slabs = (count + slab_blocks - 1) / slab_blocks;
        tbb::parallel_for(std::uint64_t{0}, slabs, [&](std::uint64_t i) {
            const std::uint64_t first_block = i * slab_blocks;
            const std::uint64_t size = std::min(slab_blocks, count - first_block);
            const std::uint64_t position = (first + first_block) * kBlockVoxels;
            const Slab slab(domain, list, position,
                            std::min(position + size * kBlockVoxels, list.size()));
            sum_slab(database, requests, materials, slab, workspaces.local(),
                     std::span(sums).subspan(first_block, size));
        });
        for (std::uint64_t i = 0; i < count; ++i) {
            std::transform(totals.begin(), totals.end(), sums[i].begin(), totals.begin(),
                           std::plus<>());
        }
        if (progress) {
            progress(static_cast<double>(first + count) / static_cast<double>(blocks));
        }
    }
    std::vector<std::vector<double>> result;
    auto total = totals.begin();
    for (const auto& request : requests) {
        auto& distances = result.emplace_back();
        const double scale = std::pow(request.scale, request.metric->header.degree / 2);
        for (std::size_t p = 0; p < request.pairs.size(); ++p) {
            distances.push_back(
                std::sqrt(*total++ / static_cast<double>(database.grid().voxels())) / scale);
        }
    }
    recompute_smallest(database, requests, set, progress, result);
    return result;
}

std::vector<double> reference_distances(const Database& database, const Metric& metric,
                                        std::span<const MaterialPair> pairs, VoxelSet set) {
    const ReferenceRequest request = {&metric, {pairs.begin(), pairs.end()}};
    return reference_distances(database, {&request, 1}, set).front();
}

}  // namespace merl::reflectance
