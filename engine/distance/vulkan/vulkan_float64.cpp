#include "engine/distance/vulkan/vulkan_float64.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <set>
#include <string>

#include "engine/base/error.h"
#include "engine/device/buffer.h"
#include "engine/device/kernel.h"
#include "engine/device/paced_work.h"
#include "engine/device/submission.h"
#include "engine/distance/parts/block_reader.h"
#include "engine/distance/parts/slab.h"
#include "engine/metric/metric_kernels.h"

namespace merl::engine {
namespace {

using device::Binding;
using device::BoundKernel;
using device::Buffer;
using device::Context;
using device::Kernel;
using device::PacedWork;
using device::Texels;
using device::Traffic;

constexpr std::uint32_t kLanes = 64;  // of a workgroup where nothing depends on it
constexpr std::uint64_t kTexelBytes = 16;

/// Of the Vulkan limit: what every device can dispatch along one side.
constexpr std::uint64_t kMostPairs = 65535;

/// A sum of this or more has all its digits, whatever its terms lost below 2^-1022; what samples
/// are multiplied with where it is smaller.
constexpr double kSmallestSum = 0x1p-900;
constexpr double kScale = 0x1p600;

/// Push constants of the kernels.
struct WeighPush {
    std::uint32_t voxel_count;
};
struct GridPush {
    double scale;
    std::uint32_t slab_blocks, voxel_count;
};
struct SumsPush {
    std::uint32_t slab_blocks, pairs;
};

/// As the shaders read a pair: places of materials.
struct Place {
    std::uint32_t first, second;
};

template <typename T>
std::span<const std::byte> bytes_of(const T& push) {
    return std::as_bytes(std::span(&push, 1));
}

Kernel make_kernel(Context& context, const Metric& metric, const char* stage,
                   std::span<const std::uint32_t> spirv, std::vector<Binding> bindings,
                   std::uint32_t push_bytes, std::uint32_t lanes = kLanes) {
    return {context, fmt::format("{} {} in float64", metric.name, stage), spirv,
            Kernel::Options{.bindings = std::move(bindings),
                            .constants = {lanes},
                            .push_bytes = push_bytes,
                            .one_subgroup = false}};
}

/// One metric on the device, and its budgets, in blocks of a material and of a pair: some 64
/// operations a number in float64, of which some cards do one in the time of 32.
struct Kernels {
    Kernels(Context& context, const Metric& metric)
        : Kernels(context, metric, compile_float64_kernels(metric, context.limits().floats)) {}

    Kernels(Context& context, const Metric& metric, const Float64Kernels& spirv)
        : weigh(make_kernel(context, metric, "weigh", spirv.weigh,
                            {Binding::texels, Binding::storage}, sizeof(WeighPush))),
          grid(make_kernel(context, metric, "grid", spirv.grid,
                           {Binding::texels, Binding::texels, Binding::storage}, sizeof(GridPush))),
          sums(make_kernel(context, metric, "sums", spirv.sums,
                           {Binding::texels, Binding::texels, Binding::storage, Binding::storage},
                           sizeof(SumsPush), kWindowLanes)),
          grid_budget(context.info(), 3.0 * kBlockVoxels * 64 * 32 * 10),
          pair_budget(context.info(), 3.0 * kBlockVoxels * 64 * 32) {}

    Kernel weigh, grid, sums;
    device::WorkBudget grid_budget, pair_budget;
};

/// Some of the pairs of a request, in one pass.
struct Part {
    std::size_t request;
    std::vector<Place> pairs;         // as places in the materials of the pass
    std::vector<std::size_t> places;  // of each in the request
    std::vector<double> totals;
};

/// Bytes for each block of a slab.
struct BlockBytes {
    std::uint64_t up;       // samples and geometry
    std::uint64_t stays;    // transformed samples and weights
    std::uint64_t down;     // sums
    std::uint64_t largest;  // of a buffer

    BlockBytes(std::uint64_t materials, std::uint64_t pairs)
        : up(materials * sizeof(BlockSamples) + kBlockVoxels * sizeof(Voxel)),
          stays(materials * sizeof(BlockSamples) + sizeof(BlockWeights)),
          down(pairs * sizeof(double)),
          largest(std::max({materials * sizeof(BlockSamples),
                            std::uint64_t{kBlockVoxels * sizeof(Voxel)}, down})) {}

    std::uint64_t all(const device::Limits& limits) const {
        return (limits.stages_uploads ? 2 : 1) * up + stays +
               (limits.stages_downloads ? 2 : 1) * down;
    }
};

/// How many blocks a slab may have, of so many materials, with sums of so many pairs at a time.
std::uint64_t blocks_of(const device::Limits& limits, std::uint64_t memory_bytes,
                        std::uint64_t materials, std::uint64_t pairs) {
    const BlockBytes bytes(materials, pairs);
    const std::uint64_t most = std::min({limits.storage_buffer_bytes, limits.allocation_bytes,
                                         limits.texel_buffer_texels * kTexelBytes});
    const std::uint64_t memory = std::min(memory_bytes, limits.free_bytes);
    return materials > limits.groups_y
               ? 0
               : std::min({memory / bytes.all(limits), most / bytes.largest,
                           std::uint64_t{limits.groups_y},
                           std::uint64_t{limits.groups_x} / (kBlockVoxels / kLanes)});
}

/// Pairs that are computed at a time: no more memory goes to their sums than to samples.
std::uint64_t pairs_at_a_time(const device::Limits& limits, std::uint64_t materials) {
    const std::uint64_t as_samples = materials * sizeof(BlockSamples) / sizeof(double);
    return std::min({kMostPairs, std::uint64_t{limits.groups_x}, as_samples});
}

class Work {
  public:
    Work(Context& context, const Database& database, std::span<const Float64Pairs> requests,
         double scale, VoxelSet set, const std::function<void(double)>& progress,
         std::uint64_t memory_bytes)
        : context_(context),
          database_(database),
          requests_(requests),
          scale_(scale),
          domain_(database.grid()),
          voxels_(domain_, set),
          progress_(progress),
          memory_bytes_(memory_bytes) {
        for (const auto& request : requests) {
            totals_.emplace_back(request.pairs.size());
            all_pairs_ += request.pairs.size();
            if (request.pairs.empty()) {
                kernels_.emplace_back();
            } else {
                kernels_.emplace_back(std::in_place, context, *request.metric);
            }
        }
    }

    /// The sum over all voxels of each request's pairs.
    std::vector<std::vector<double>> sums() {
        std::set<std::uint32_t> all;
        for (const auto& request : requests_) {
            for (const auto& [a, b] : request.pairs) {
                all.insert({a, b});
            }
        }
        const std::vector<std::uint32_t> materials(all.begin(), all.end());
        const std::size_t size = group_size(materials.size());
        const auto group = [&](std::size_t first) {
            return std::span(materials).subspan(first, std::min(size, materials.size() - first));
        };
        for (std::size_t i = 0; i < materials.size(); i += size) {
            for (std::size_t j = i; j < materials.size(); j += size) {
                pass(group(i), group(j));
            }
        }
        return std::move(totals_);
    }

  private:
    bool has_room(std::uint64_t materials) const {
        const auto& limits = context_.limits();
        return blocks_of(limits, memory_bytes_, materials,
                         std::min<std::uint64_t>(pairs_at_a_time(limits, materials), all_pairs_)) >
               0;
    }

    /// The size of groups of materials of which any two have room.
    std::size_t group_size(std::size_t materials) const {
        if (has_room(materials)) {
            return materials;
        }
        std::size_t size = (materials + 1) / 2;
        while (size > 1 && !has_room(2 * size)) {
            size = (size + 1) / 2;
        }
        return size;
    }

    /// What is asked for between two groups of materials, or within one.
    void pass(std::span<const std::uint32_t> one, std::span<const std::uint32_t> other) {
        const auto is_in = [](std::span<const std::uint32_t> group, std::uint32_t material) {
            return std::ranges::binary_search(group, material);
        };
        const auto is_wanted = [&](const MaterialPair& pair) {
            return (is_in(one, pair.first) && is_in(other, pair.second)) ||
                   (is_in(one, pair.second) && is_in(other, pair.first));
        };
        std::set<std::uint32_t> there;
        for (const auto& request : requests_) {
            for (const auto& pair : request.pairs) {
                if (is_wanted(pair)) {
                    there.insert({pair.first, pair.second});
                }
            }
        }
        materials_.assign(there.begin(), there.end());
        if (materials_.empty()) {
            return;
        }
        const auto place = [&](std::uint32_t material) {
            return static_cast<std::uint32_t>(std::ranges::lower_bound(materials_, material) -
                                              materials_.begin());
        };
        std::vector<Part> parts;
        std::size_t most = 0;  // pairs of a part
        std::size_t count = 0;
        for (std::size_t r = 0; r < requests_.size(); ++r) {
            Part part = {.request = r, .pairs = {}, .places = {}, .totals = {}};
            for (std::size_t p = 0; p < requests_[r].pairs.size(); ++p) {
                if (const auto& pair = requests_[r].pairs[p]; is_wanted(pair)) {
                    part.pairs.push_back({place(pair.first), place(pair.second)});
                    part.places.push_back(p);
                }
            }
            part.totals.resize(part.pairs.size());
            most = std::max(most, part.pairs.size());
            count += part.pairs.size();
            if (!part.pairs.empty()) {
                parts.push_back(std::move(part));
            }
        }
        compute(parts, most, count);
        for (const auto& part : parts) {
            for (std::size_t p = 0; p < part.pairs.size(); ++p) {
                totals_[part.request][part.places[p]] = part.totals[p];
            }
        }
        done_ += count;
    }

    /// The totals of the parts, slab by slab, each pair's in the order of the blocks.
    void compute(std::vector<Part>& parts, std::size_t most, std::size_t count) {
        const auto& limits = context_.limits();
        const std::uint64_t at_a_time =
            std::min<std::uint64_t>(pairs_at_a_time(limits, materials_.size()), most);
        const std::uint64_t blocks = block_count(voxels_.size());
        const auto slab_blocks = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(
            blocks_of(limits, memory_bytes_, materials_.size(), at_a_time), 1, blocks));
        Buffers buffers(context_, materials_.size(), slab_blocks, at_a_time);
        for (std::uint64_t first = 0; first < blocks; first += slab_blocks) {
            const std::uint64_t from = first * kBlockVoxels;
            const Slab slab(
                domain_, voxels_, from,
                std::min(from + slab_blocks * std::uint64_t{kBlockVoxels}, voxels_.size()));
            read(slab, slab_blocks, buffers);
            bool is_there = false;  // the slab, on the device
            std::size_t parts_done = 0;
            for (auto& part : parts) {
                for (std::size_t p = 0; p < part.pairs.size(); p += at_a_time) {
                    const auto size = std::min<std::size_t>(at_a_time, part.pairs.size() - p);
                    const auto report_slab = [&] {
                        const double of_slab =
                            static_cast<double>(parts_done) / static_cast<double>(count);
                        report((static_cast<double>(first) +
                                of_slab * static_cast<double>(slab.blocks())) /
                               static_cast<double>(blocks) * static_cast<double>(count));
                    };
                    sum(part, p, size, slab, slab_blocks, buffers, !is_there, report_slab);
                    is_there = true;
                    parts_done += size;
                    report_slab();
                }
            }
        }
        context_.check_validation();
    }

    struct Buffers {
        Buffers(Context& context, std::uint64_t materials, std::uint64_t blocks,
                std::uint64_t at_a_time)
            : samples(context, blocks * materials * sizeof(BlockSamples), Traffic::upload,
                      Texels::words),
              geometry(context, blocks * kBlockVoxels * sizeof(Voxel), Traffic::upload,
                       Texels::words),
              grid(context, blocks * materials * sizeof(BlockSamples), Traffic::none,
                   Texels::words),
              weights(context, blocks * sizeof(BlockWeights), Traffic::none, Texels::words),
              pairs(context, at_a_time * sizeof(Place), Traffic::upload),
              sums(context, blocks * at_a_time * sizeof(double), Traffic::download) {
            // Nothing on the device may meet a number that was never written.
            std::ranges::fill(samples.host(), std::byte{0});
            std::ranges::fill(geometry.host(), std::byte{0});
        }

        Buffer samples;   // float64 [material][block][channel][voxel]
        Buffer geometry;  // Voxel [voxel]
        Buffer grid;      // as samples
        Buffer weights;   // float64 [voxel]
        Buffer pairs;     // Place
        Buffer sums;      // float64 [block][pair]
    };

    void read(const Slab& slab, std::uint32_t slab_blocks, Buffers& buffers) const {
        const VoxelRange file = {slab.runs.front().file_index,
                                 slab.runs.back().file_index + slab.runs.back().length};
        const auto samples = buffers.samples.host_as<BlockSamples>();
        tbb::parallel_for(std::size_t{0}, materials_.size(), [&](std::size_t m) {
            read_blocks(database_, materials_[m], file, slab.runs,
                        samples.subspan(m * slab_blocks, slab.blocks()));
        });
        std::ranges::copy(std::as_bytes(std::span(slab.geometry)), buffers.geometry.host().begin());
    }

    /// Adds the sums of a slab to the totals of `size` pairs of a part, from the one at `first` on.
    void sum(Part& part, std::size_t first, std::size_t size, const Slab& slab,
             std::uint32_t slab_blocks, Buffers& buffers, bool uploads,
             const std::function<void()>& meanwhile) {
        auto& kernels = *kernels_[part.request];
        const auto bind = [&](const Kernel& kernel, std::initializer_list<Buffer*> with) {
            return BoundKernel(context_, kernel, std::span(with.begin(), with.size()));
        };
        const auto weigh = bind(kernels.weigh, {&buffers.geometry, &buffers.weights});
        const auto grid = bind(kernels.grid, {&buffers.geometry, &buffers.samples, &buffers.grid});
        const auto sums =
            bind(kernels.sums, {&buffers.grid, &buffers.weights, &buffers.pairs, &buffers.sums});
        const auto blocks = static_cast<std::uint32_t>(slab.blocks());
        const auto voxels = static_cast<std::uint32_t>(slab.voxels);
        const auto pairs = static_cast<std::uint32_t>(size);
        std::ranges::copy(std::span(part.pairs).subspan(first, size),
                          buffers.pairs.host_as<Place>().begin());
        device::Submission submission(context_, 3);
        submission.begin();
        if (uploads) {
            submission.upload(buffers.samples, buffers.samples.bytes());
            submission.upload(buffers.geometry, buffers.geometry.bytes());
        }
        submission.upload(buffers.pairs, size * sizeof(Place));
        submission.mark();
        PacedWork work(submission);
        double grid_units = 0;
        double pair_units = 0;
        if (first == 0) {  // of this metric
            constexpr std::uint32_t kGroupsOfBlock = kBlockVoxels / kLanes;
            work.dispatch(weigh, bytes_of(WeighPush{voxels}), blocks * kGroupsOfBlock, 1,
                          {1.0 / kGroupsOfBlock, kernels.grid_budget, grid_units});
            work.dispatch(grid, bytes_of(GridPush{scale_, slab_blocks, voxels}),
                          blocks * kGroupsOfBlock / 2,
                          static_cast<std::uint32_t>(materials_.size()),
                          {2.0 / kGroupsOfBlock, kernels.grid_budget, grid_units});
        }
        submission.mark();
        work.dispatch(sums, bytes_of(SumsPush{slab_blocks, pairs}), pairs, blocks,
                      {1, kernels.pair_budget, pair_units});
        submission.download(buffers.sums, std::uint64_t{blocks} * pairs * sizeof(double));
        submission.mark();
        submission.submit();
        submission.wait(meanwhile);
        const auto seconds = submission.seconds();
        kernels.grid_budget.measured(grid_units, seconds[0]);
        kernels.pair_budget.measured(pair_units, seconds[1]);
        const auto found = buffers.sums.host_as<const double>();
        for (std::size_t block = 0; block < blocks; ++block) {
            for (std::size_t p = 0; p < size; ++p) {
                part.totals[first + p] += found[block * size + p];
            }
        }
    }

    void report(double pairs) const {
        if (progress_) {
            progress_((static_cast<double>(done_) + pairs) / static_cast<double>(all_pairs_));
        }
    }

    Context& context_;
    const Database& database_;
    std::span<const Float64Pairs> requests_;
    double scale_;
    Domain domain_;
    VoxelList voxels_;
    const std::function<void(double)>& progress_;
    std::uint64_t memory_bytes_;
    std::vector<std::optional<Kernels>> kernels_;  // of each request with pairs
    std::vector<std::vector<double>> totals_;      // of each request
    std::size_t all_pairs_ = 0;
    std::size_t done_ = 0;                  // pairs
    std::vector<std::uint32_t> materials_;  // of this pass
};

}  // namespace

std::vector<std::vector<double>> vulkan_float64_distances(
    Context& context, const Database& database, std::span<const Float64Pairs> requests,
    VoxelSet set, const std::function<void(double)>& progress, std::uint64_t memory_bytes) {
    const std::uint64_t memory = memory_bytes - database.keep(memory_bytes / 2);
    const auto voxels = static_cast<double>(database.grid().voxels());
    auto result = Work(context, database, requests, 1, set, progress, memory).sums();
    // Those whose sums are too small again, as those of copies are too. Powers below one are in
    // range whatever they are of.
    std::vector<Float64Pairs> again;
    bool is_any_small = false;
    for (std::size_t r = 0; r < requests.size(); ++r) {
        auto& small = again.emplace_back(Float64Pairs{requests[r].metric, {}});
        for (std::size_t p = 0; p < result[r].size(); ++p) {
            if (!std::isfinite(result[r][p])) {
                const auto [a, b] = requests[r].pairs[p];
                throw InputError(fmt::format(
                    "{}: the sum over the voxels in float64 is {} for materials {} and {}",
                    requests[r].metric->file, result[r][p], database.materials()[a],
                    database.materials()[b]));
            }
            if (requests[r].metric->header.degree >= 1 && result[r][p] < kSmallestSum) {
                small.pairs.push_back(requests[r].pairs[p]);
                is_any_small = true;
            }
        }
    }
    std::vector<std::vector<double>> scaled(requests.size());
    if (is_any_small) {
        scaled = Work(context, database, again, kScale, set, progress, memory).sums();
    }
    for (std::size_t r = 0; r < requests.size(); ++r) {
        const double scale = std::pow(kScale, requests[r].metric->header.degree / 2);
        auto next = scaled[r].begin();
        for (double& sum : result[r]) {
            const bool is_small = !again[r].pairs.empty() && sum < kSmallestSum;
            const double small = is_small ? *next++ : std::numeric_limits<double>::infinity();
            // Infinite, too, where it is weights that are tiny: then what there is stays.
            sum =
                std::isfinite(small) ? std::sqrt(small / voxels) / scale : std::sqrt(sum / voxels);
        }
    }
    return result;
}

}  // namespace merl::engine
