#include "engine/distance/float64_distances.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <tuple>
#include <utility>

#include "engine/distance/float64_summary.h"
#include "engine/distance/host/float64_difference.h"
#include "engine/distance/parts/compensated_sum.h"
#include "engine/distance/parts/slab.h"

namespace merl::engine {
namespace {

/// Materials a side of a tile of pairs: one channel of a block of all of them stays in the
/// second-level cache.
constexpr std::uint32_t kTileSide = 16;

/// Bytes of samples that are read at a time: ranges of files that are long enough to be read
/// quickly.
constexpr std::uint64_t kSlabBytes = 64ULL << 20U;

/// Pairs of a block between two calls of `progress`: some tenths of a second.
constexpr std::uint64_t kPairsAtATime = 1ULL << 18U;

/// A sum of this or more has all its digits, whatever its terms lost below 2^-1022.
constexpr double kSmallestSum = 0x1p-900;

/// What samples are multiplied with where their sum is smaller: then the square of the smallest
/// difference that there is, 2^-1074, is in range, and so are those of a sum below kSmallestSum.
constexpr int kScaleExponent = 600;

/// The materials of some pairs, ascending.
std::vector<std::uint32_t> materials_of(const auto& pairs, const auto& pair_of) {
    std::vector<bool> there;
    for (const auto& pair : pairs) {
        const auto [a, b] = pair_of(pair);
        there.resize(std::max<std::size_t>(there.size(), std::max(a, b) + std::size_t{1}));
        there[a] = true;
        there[b] = true;
    }
    std::vector<std::uint32_t> materials;
    for (std::uint32_t material = 0; material < there.size(); ++material) {
        if (there[material]) {
            materials.push_back(material);
        }
    }
    return materials;
}

/// The sum of one pair over all blocks so far.
struct PairSum {
    std::uint32_t row;     // places in Part::materials
    std::uint32_t column;  // not less
    std::size_t place;     // of the pair among all that are asked for
    CompensatedSum sum = {};
};

/// Some of the pairs that are asked for, under one metric.
struct Part {
    const Metric* metric;
    double scale;                               // as Float64Request::scale
    std::vector<std::uint32_t> materials = {};  // of these pairs, in the database, ascending
    std::vector<PairSum> sums = {};             // tile after tile
    std::vector<std::size_t> tiles = {};        // where in it each begins, and the end

    // Of the block that is summed.
    BlockWeights weights = {};
    std::vector<BlockSamples> grid = {};  // [material], transformed
};

/// What is computed in one reading of some materials.
struct Pass {
    std::vector<std::uint32_t> materials;  // of the database
    std::vector<Part> parts;
    std::size_t pairs = 0;          // of all parts
    std::uint64_t slab_blocks = 1;  // that are read at a time
};

/// What bounds a pass.
struct Budget {
    std::uint64_t memory_bytes;
    std::uint64_t metrics;

    /// What a block takes that is read of so many materials.
    static std::uint64_t read_bytes(std::uint64_t materials) {
        return materials * sizeof(BlockSamples) + kBlockVoxels * (sizeof(Voxel) + sizeof(VoxelRun));
    }

    /// What the one block takes that is transformed.
    std::uint64_t transformed_bytes(std::uint64_t materials) const {
        return metrics * (materials * sizeof(BlockSamples) + sizeof(BlockWeights));
    }

    bool has_room(std::uint64_t materials) const {
        return read_bytes(materials) + transformed_bytes(materials) <= memory_bytes;
    }

    std::uint64_t slab_blocks(std::uint64_t materials) const {
        const auto transformed = std::min(memory_bytes, transformed_bytes(materials));
        return std::max<std::uint64_t>(
            1, std::min(memory_bytes - transformed, kSlabBytes) / read_bytes(materials));
    }
};

/// Sorts the pairs of a part into tiles, the pairs of a row within one after the other.
void make_tiles(Part& part) {
    const auto tile_of = [](const PairSum& pair) {
        return std::pair(pair.row / kTileSide, pair.column / kTileSide);
    };
    std::ranges::sort(part.sums, {}, [&](const PairSum& pair) {
        return std::tuple(tile_of(pair), pair.row, pair.column, pair.place);
    });
    for (std::size_t p = 0; p < part.sums.size(); ++p) {
        if (p == 0 || tile_of(part.sums[p]) != tile_of(part.sums[p - 1])) {
            part.tiles.push_back(p);
        }
    }
    part.tiles.push_back(part.sums.size());
}

/// All that is asked for between two groups of materials, or within one.
Pass make_pass(std::span<const Float64Request> requests, std::span<const std::uint32_t> one,
               std::span<const std::uint32_t> other, const Budget& budget) {
    const auto is_in = [](std::span<const std::uint32_t> group, std::uint32_t material) {
        return !group.empty() && group.front() <= material && material <= group.back();
    };
    Pass pass;
    std::size_t place = 0;
    for (const auto& request : requests) {
        Part part = {request.metric, request.scale};
        for (const auto& [a, b] : request.pairs) {
            if ((is_in(one, a) && is_in(other, b)) || (is_in(one, b) && is_in(other, a))) {
                part.sums.push_back({std::min(a, b), std::max(a, b), place});
            }
            ++place;
        }
        if (part.sums.empty()) {  // of a metric without a twin nothing is asked for
            continue;
        }
        part.materials = materials_of(
            part.sums, [](const PairSum& pair) { return MaterialPair(pair.row, pair.column); });
        const auto in_part = [&](std::uint32_t material) {
            return static_cast<std::uint32_t>(std::ranges::lower_bound(part.materials, material) -
                                              part.materials.begin());
        };
        for (auto& pair : part.sums) {
            pair.row = in_part(pair.row);
            pair.column = in_part(pair.column);
        }
        make_tiles(part);
        pass.pairs += part.sums.size();
        pass.parts.push_back(std::move(part));
    }
    for (const auto& part : pass.parts) {
        std::vector<std::uint32_t> all;
        std::ranges::set_union(pass.materials, part.materials, std::back_inserter(all));
        pass.materials = std::move(all);
    }
    pass.slab_blocks = budget.slab_blocks(pass.materials.size());
    return pass;
}

/// The size of groups of which any two have room: that of all materials if they have, otherwise
/// halved until it is small enough.
std::size_t group_size(std::size_t materials, const Budget& budget) {
    if (budget.has_room(materials)) {
        return materials;
    }
    std::size_t size = (materials + 1) / 2;
    while (size > 1 && !budget.has_room(2 * size)) {
        size = (size + 1) / 2;
    }
    return size;
}

/// Multiplies samples where they have a weight; elsewhere a large difference would become infinite,
/// and times 0 no number.
void scale_weighted(BlockSamples& samples, const BlockWeights& weights, double scale) {
    for (auto& channel : samples) {
        std::ranges::transform(
            channel, weights, channel.begin(),
            [=](double sample, double weight) { return weight == 0 ? 0.0 : sample * scale; });
    }
}

/// Reads the materials of a pass, each once for all parts: [material][block].
void read_slab(const Database& database, const Slab& slab, const Pass& pass,
               std::vector<BlockSamples>& samples) {
    const std::size_t materials = pass.materials.size();
    samples.resize(slab.blocks() * materials);
    const VoxelRange file = {slab.runs.front().file_index,
                             slab.runs.back().file_index + slab.runs.back().length};
    tbb::parallel_for(std::size_t{0}, materials, [&](std::size_t m) {
        read_blocks(database, pass.materials[m], file, slab.runs,
                    std::span(samples).subspan(m * slab.blocks(), slab.blocks()));
    });
}

/// Weighs and transforms one block for all parts: a block of all materials stays in a cache until
/// its pairs are summed.
void transform_block(const Slab& slab, std::uint64_t block, std::span<const BlockSamples> samples,
                     Pass& pass) {
    for (auto& part : pass.parts) {
        weigh_block(*part.metric, slab, block, part.weights);
        part.grid.resize(part.materials.size());
    }
    tbb::parallel_for(std::size_t{0}, pass.materials.size(), [&](std::size_t m) {
        for (auto& part : pass.parts) {
            const auto found = std::ranges::lower_bound(part.materials, pass.materials[m]);
            if (found == part.materials.end() || *found != pass.materials[m]) {
                continue;
            }
            auto& transformed = part.grid[static_cast<std::size_t>(found - part.materials.begin())];
            part.metric->twin.transform(part.metric->parameters, slab.voxels_of_block(block),
                                        samples[m * slab.blocks() + block], transformed);
            if (part.scale != 1) {
                scale_weighted(transformed, part.weights, part.scale);
            }
        }
    });
}

/// Adds one channel of a block to the sums of a tile: of each row the columns that are asked for,
/// some at a time.
void add_channel(const Part& part, std::size_t channel, std::span<PairSum> tile) {
    std::array<const ChannelSamples*, kFloat64Columns> columns = {};
    std::array<double, kFloat64Columns> sums = {};
    for (std::size_t first = 0; first < tile.size();) {
        const auto row = tile[first].row;
        std::size_t count = 0;
        for (; count < columns.size() && first + count < tile.size() &&
               tile[first + count].row == row;
             ++count) {
            columns[count] = &part.grid[tile[first + count].column][channel];
        }
        sum_float64_differences(part.metric->header.degree, part.grid[row][channel],
                                std::span(columns).first(count), part.weights, sums);
        for (std::size_t i = 0; i < count; ++i) {
            tile[first + i].sum.add(sums[i]);
        }
        first += count;
    }
}

/// Adds the block to the sums of a tile.
void add_tile(Part& part, std::size_t tile) {
    const auto sums =
        std::span(part.sums).subspan(part.tiles[tile], part.tiles[tile + 1] - part.tiles[tile]);
    if (part.metric->header.degree > 0) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
            add_channel(part, channel, sums);
        }
        return;
    }
    for (auto& pair : sums) {
        pair.sum.add(part.metric->twin.sum(part.metric->parameters, part.grid[pair.row],
                                           part.grid[pair.column], part.weights));
    }
}

/// Puts the sums of a pass over all voxels into their places in `totals`. `progress` is called with
/// the share of the pass that is done.
void sum_pass(const Database& database, const Domain& domain, const VoxelList& list, Pass& pass,
              std::vector<double>& totals, const std::function<void(double)>& progress) {
    const std::uint64_t slab_voxels = pass.slab_blocks * kBlockVoxels;
    const double all =
        static_cast<double>(pass.pairs) * static_cast<double>(block_count(list.size()));
    double done = 0;
    std::vector<BlockSamples> samples;
    for (std::uint64_t first = 0; first < list.size(); first += slab_voxels) {
        const Slab slab(domain, list, first, std::min(first + slab_voxels, list.size()));
        read_slab(database, slab, pass, samples);
        for (std::uint64_t block = 0; block < slab.blocks(); ++block) {
            transform_block(slab, block, samples, pass);
            for (auto& part : pass.parts) {
                for (std::size_t tile = 0; tile + 1 < part.tiles.size();) {
                    const std::size_t begin = tile;
                    std::size_t pairs = 0;
                    for (; tile + 1 < part.tiles.size() && pairs < kPairsAtATime; ++tile) {
                        pairs += part.tiles[tile + 1] - part.tiles[tile];
                    }
                    tbb::parallel_for(begin, tile, [&](std::size_t t) { add_tile(part, t); });
                    done += static_cast<double>(pairs);
                    progress(done / all);
                }
            }
        }
    }
    for (const auto& part : pass.parts) {
        for (const auto& pair : part.sums) {
            totals[pair.place] = pair.sum.total();
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
                // Infinite where it is weights that are tiny: then what there is stays.
                const double scaled = *next++;
                distance = std::isfinite(scaled) ? scaled : distance;
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
    std::vector<MaterialPair> pairs;
    std::uint64_t metrics = 0;
    for (const auto& request : requests) {
        pairs.insert(pairs.end(), request.pairs.begin(), request.pairs.end());
        metrics += request.pairs.empty() ? 0 : 1;
    }
    const std::size_t pair_count = pairs.size();
    const auto materials = materials_of(pairs, std::identity());
    const Budget budget = {.memory_bytes = memory_bytes - database.keep(memory_bytes / 2),
                           .metrics = metrics};
    const std::size_t size = group_size(materials.size(), budget);
    const auto group = [&](std::size_t first) {
        return std::span(materials).subspan(first, std::min(size, materials.size() - first));
    };

    std::vector<double> totals(pair_count);
    std::size_t done = 0;  // pairs
    for (std::size_t i = 0; i < materials.size(); i += size) {
        for (std::size_t j = i; j < materials.size(); j += size) {
            Pass pass = make_pass(requests, group(i), group(j), budget);
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
