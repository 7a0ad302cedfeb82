#include "engine/distance/float64_distances.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "engine/distance/float64_summary.h"
#include "engine/distance/parts/slab.h"

namespace merl::engine {
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

/// The materials of the pairs of all requests or parts, ascending.
std::vector<std::uint32_t> materials_of(const auto& requests) {
    std::vector<bool> there;
    for (const auto& request : requests) {
        for (const auto& [a, b] : request.pairs) {
            there.resize(std::max<std::size_t>(there.size(), std::max(a, b) + std::size_t{1}));
            there[a] = true;
            there[b] = true;
        }
    }
    std::vector<std::uint32_t> materials;
    for (std::uint32_t material = 0; material < there.size(); ++material) {
        if (there[material]) {
            materials.push_back(material);
        }
    }
    return materials;
}

/// Some of the pairs that are asked for, under one metric.
struct Part {
    const Metric* metric;
    double scale;                          // as Float64Request::scale
    std::vector<MaterialPair> pairs;       // as places in Pass::materials
    std::vector<std::uint32_t> materials;  // of these pairs, likewise
    std::vector<std::size_t> places;       // of each pair among all that are asked for
};

/// What is computed in one reading of some materials.
struct Pass {
    std::vector<std::uint32_t> materials;  // of the database
    std::vector<Part> parts;
    std::size_t pairs = 0;  // of all parts

    /// How it is cut so that it stays within its memory.
    std::uint64_t slab_blocks = 1;                    // that a thread reads at a time
    std::uint64_t blocks_at_a_time = kBlocksAtATime;  // whose sums are held
};

/// Half of the memory is for what the threads read, half for the sums of blocks.
struct Budget {
    std::uint64_t memory_bytes;
    std::uint64_t threads;

    /// Blocks of so many materials that each thread can read at a time.
    std::uint64_t blocks(std::uint64_t materials) const {
        const std::uint64_t bytes = memory_bytes / 2 / threads;
        const std::uint64_t grid = materials * sizeof(BlockSamples);  // one block, transformed
        return bytes <= grid
                   ? 0
                   : (bytes - grid) / (grid + kBlockVoxels * (sizeof(Voxel) + sizeof(VoxelRun)));
    }

    /// Blocks whose sums of so many pairs can be held.
    std::uint64_t sums(std::uint64_t pairs) const {
        return memory_bytes / 2 / sizeof(double) / std::max<std::uint64_t>(1, pairs);
    }

    /// Whether every thread has something to do.
    bool has_room(std::uint64_t materials, std::uint64_t pairs) const {
        return blocks(materials) >= 1 && sums(pairs) >= threads;
    }
};

/// All that is asked for between two groups of materials, or within one.
Pass make_pass(std::span<const Float64Request> requests, std::span<const std::uint32_t> one,
               std::span<const std::uint32_t> other, const Budget& budget) {
    const auto is_in = [](std::span<const std::uint32_t> group, std::uint32_t material) {
        return std::ranges::binary_search(group, material);
    };
    Pass pass;
    std::size_t place = 0;
    for (const auto& request : requests) {
        Part part = {request.metric, request.scale, {}, {}, {}};
        for (const auto& [a, b] : request.pairs) {
            if ((is_in(one, a) && is_in(other, b)) || (is_in(one, b) && is_in(other, a))) {
                part.pairs.emplace_back(a, b);
                part.places.push_back(place);
            }
            ++place;
        }
        pass.pairs += part.pairs.size();
        if (!part.pairs.empty()) {  // of a metric without a twin nothing is asked for
            pass.parts.push_back(std::move(part));
        }
    }
    pass.materials = materials_of(pass.parts);
    const auto in_pass = [&](std::uint32_t material) {
        return static_cast<std::uint32_t>(std::ranges::lower_bound(pass.materials, material) -
                                          pass.materials.begin());
    };
    for (auto& part : pass.parts) {
        for (auto& [a, b] : part.pairs) {
            a = in_pass(a);
            b = in_pass(b);
        }
        part.materials = materials_of(std::span(&part, 1));
    }
    pass.blocks_at_a_time = std::clamp<std::uint64_t>(budget.sums(pass.pairs), 1, kBlocksAtATime);
    const std::uint64_t most =
        std::clamp<std::uint64_t>(pass.blocks_at_a_time / budget.threads, 1, 64);
    pass.slab_blocks = std::clamp<std::uint64_t>(
        std::min(
            kThreadBytes / (sizeof(BlockSamples) * std::max<std::size_t>(1, pass.materials.size())),
            budget.blocks(pass.materials.size())),
        1, most);
    return pass;
}

/// The size of groups of which any two have room: that of all materials if they have, otherwise
/// halved until it is small enough. 0 where there is no pair.
std::size_t group_size(std::span<const Float64Request> requests, std::size_t materials,
                       std::size_t pairs, const Budget& budget) {
    if (budget.has_room(materials, pairs)) {
        return materials;
    }
    const auto two_fit = [&](std::size_t size) {
        return budget.has_room(2 * size, std::min(pairs, requests.size() * 2 * size * size));
    };
    std::size_t size = (materials + 1) / 2;
    while (size > 1 && !two_fit(size)) {
        size = (size + 1) / 2;
    }
    return size;
}

/// What a thread works with, kept from part to part: allocating it anew costs as much as the work.
struct Workspace {
    std::vector<std::vector<BlockSamples>> samples;  // per material of the pass, block by block
    std::vector<BlockSamples> grid;                  // likewise: one block, transformed
};

/// One block's sums of all parts, one part after the other.
using Sums = std::vector<double>;

/// Sums of every part and pair over each block of a slab.
void sum_slab(const Database& database, const Pass& pass, const Slab& slab, Workspace& work,
              std::span<Sums> sums) {
    const VoxelRange file = {slab.runs.front().file_index,
                             slab.runs.back().file_index + slab.runs.back().length};
    work.samples.resize(pass.materials.size());
    work.grid.resize(pass.materials.size());
    for (std::size_t m = 0; m < pass.materials.size(); ++m) {
        work.samples[m].resize(slab.blocks());
        read_blocks(database, pass.materials[m], file, slab.runs, work.samples[m]);
    }
    std::size_t at = 0;  // of the part in the sums of a block
    auto& grid = work.grid;
    for (const auto& part : pass.parts) {
        const Metric& metric = *part.metric;
        for (std::uint64_t block = 0; block < slab.blocks(); ++block) {
            const auto of_block = slab.voxels_of_block(block);
            BlockWeights weights = {};
            weigh_block(metric, slab, block, weights);
            for (const auto material : part.materials) {
                metric.twin.transform(metric.parameters, of_block, work.samples[material][block],
                                      grid[material]);
                if (part.scale != 1) {
                    for (auto& channel : grid[material]) {
                        std::ranges::transform(channel, channel.begin(),
                                               [&](double sample) { return sample * part.scale; });
                    }
                }
            }
            for (std::size_t p = 0; p < part.pairs.size(); ++p) {
                const auto [a, b] = part.pairs[p];
                sums[block][at + p] = metric.twin.sum(metric.parameters, grid[a], grid[b], weights);
            }
        }
        at += part.pairs.size();
    }
}

/// Puts the sums of a pass over all voxels into their places in `totals`. `progress` is called with
/// the share of the pass that is done.
void sum_pass(const Database& database, const Domain& domain, const VoxelList& list,
              const Pass& pass, std::vector<double>& totals,
              const std::function<void(double)>& progress) {
    const std::uint64_t blocks = block_count(list.size());
    Sums of_pass(pass.pairs);
    std::vector<Sums> sums(std::min(pass.blocks_at_a_time, blocks), Sums(pass.pairs));
    tbb::enumerable_thread_specific<Workspace> workspaces;
    for (std::uint64_t first = 0; first < blocks; first += sums.size()) {
        const std::uint64_t count = std::min<std::uint64_t>(sums.size(), blocks - first);
        const std::uint64_t slabs = (count + pass.slab_blocks - 1) / pass.slab_blocks;
        tbb::parallel_for(std::uint64_t{0}, slabs, [&](std::uint64_t i) {
            const std::uint64_t first_block = i * pass.slab_blocks;
            const std::uint64_t size = std::min(pass.slab_blocks, count - first_block);
            const std::uint64_t position = (first + first_block) * kBlockVoxels;
            const Slab slab(domain, list, position,
                            std::min(position + size * kBlockVoxels, list.size()));
            sum_slab(database, pass, slab, workspaces.local(),
                     std::span(sums).subspan(first_block, size));
        });
        for (std::uint64_t i = 0; i < count; ++i) {
            std::transform(of_pass.begin(), of_pass.end(), sums[i].begin(), of_pass.begin(),
                           std::plus<>());
        }
        progress(static_cast<double>(first + count) / static_cast<double>(blocks));
    }
    auto sum = of_pass.begin();
    for (const auto& part : pass.parts) {
        for (const auto place : part.places) {
            totals[place] = *sum++;
        }
    }
}

/// Computes again, scaled, the distances whose sums are too small. They are those of copies, too,
/// where all differences are 0. Powers below one are in range whatever they are of.
void recompute_smallest(const Database& database, std::span<const Float64Request> requests,
                        VoxelSet set, const std::function<void(double)>& progress,
                        std::uint64_t memory_bytes, std::vector<std::vector<double>>& distances) {
    const double least = std::sqrt(kSmallestSum / static_cast<double>(database.grid().voxels()));
    const auto is_small = [=](const Float64Request& request, double distance) {
        return request.scale == 1 && request.metric->header.degree >= 1 && distance < least;
    };
    std::vector<Float64Request> again;
    bool any = false;
    for (std::size_t r = 0; r < requests.size(); ++r) {
        auto& scaled = again.emplace_back(
            Float64Request{requests[r].metric, {}, std::ldexp(1.0, kScaleExponent)});
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
    const auto recomputed = float64_distances(database, again, set, progress, memory_bytes);
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

std::vector<std::vector<double>> float64_distances(const Database& database,
                                                   std::span<const Float64Request> requests,
                                                   VoxelSet set,
                                                   const std::function<void(double)>& progress,
                                                   std::uint64_t memory_bytes) {
    const Domain domain(database.grid());
    const VoxelList list(domain, set);
    const auto materials = materials_of(requests);
    std::size_t pair_count = 0;
    for (const auto& request : requests) {
        pair_count += request.pairs.size();
    }
    const Budget budget = {
        .memory_bytes = memory_bytes - database.keep(memory_bytes / 2),
        .threads = static_cast<std::uint64_t>(tbb::this_task_arena::max_concurrency())};
    const std::size_t size = group_size(requests, materials.size(), pair_count, budget);
    const auto group = [&](std::size_t first) {
        return std::span(materials).subspan(first, std::min(size, materials.size() - first));
    };

    std::vector<double> totals(pair_count);
    std::size_t done = 0;  // pairs
    for (std::size_t i = 0; i < materials.size(); i += size) {
        for (std::size_t j = i; j < materials.size(); j += size) {
            const Pass pass = make_pass(requests, group(i), group(j), budget);
            if (pass.pairs == 0) {
                continue;
            }
            sum_pass(database, domain, list, pass, totals, [&](double share) {
                if (progress) {
                    progress((static_cast<double>(done) + share * static_cast<double>(pass.pairs)) /
                             static_cast<double>(pair_count));
                }
            });
            done += pass.pairs;
        }
    }
    std::vector<std::vector<double>> result;
    auto total = totals.begin();
    for (const auto& request : requests) {
        auto& distances = result.emplace_back();
        distances.reserve(request.pairs.size());
        const double scale = std::pow(request.scale, request.metric->header.degree / 2);
        for (std::size_t p = 0; p < request.pairs.size(); ++p) {
            distances.push_back(
                std::sqrt(*total++ / static_cast<double>(database.grid().voxels())) / scale);
        }
    }
    recompute_smallest(database, requests, set, progress, memory_bytes, result);
    return result;
}

std::vector<double> float64_distances(const Database& database, const Metric& metric,
                                      std::span<const MaterialPair> pairs, VoxelSet set) {
    const Float64Request request = {&metric, {pairs.begin(), pairs.end()}};
    if (metric.is_summary()) {
        return float64_summary_distances(database, request, set);
    }
    return float64_distances(database, {&request, 1}, set).front();
}

}  // namespace merl::engine
