#include "engine/distance/distances.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <memory>

#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "engine/distance/parts/slab_plan.h"
#include "engine/distance/parts/slab_reader.h"
#include "engine/distance/parts/window_check.h"

namespace merl::engine {
namespace {

/// The most that the list of visited voxels takes while it grows: a run for each theta_h and
/// theta_d, which is nothing unless the grid is of another shape than any that was measured.
std::uint64_t list_bytes(const Grid& grid) {
    return 2 * sizeof(VoxelRun) * grid.theta_h * std::uint64_t{grid.theta_d};
}

/// An engine with its metrics, and its work once that has begun.
struct Part {
    Engines::Share share;
    std::vector<const Metric*> metrics = {};
    EngineNeeds needs = {};
    std::unique_ptr<EngineWork> work = nullptr;
};

std::vector<Part> make_parts(Engines& engines, std::span<const Metric* const> metrics,
                             const PairList& pairs, std::vector<std::string>& warnings) {
    std::vector<Part> parts;
    for (auto& share : engines.share(metrics, warnings)) {
        auto& part = parts.emplace_back(Part{std::move(share)});
        for (const auto m : part.share.metrics) {
            part.metrics.push_back(metrics[m]);
        }
        part.needs = part.share.engine->needs(part.metrics, pairs);
    }
    return parts;
}

}  // namespace

DistanceResult compute_distances(Engines& engines, const Database& database,
                                 std::span<const Metric* const> metrics,
                                 const DistanceOptions& options) {
    Stopwatch total;
    const auto materials = database.materials().size();
    if (materials > kMaxMaterials) {
        throw InputError(fmt::format("{} materials are more than {}, the most there may be",
                                     materials, kMaxMaterials));
    }
    const PairList pairs(static_cast<std::uint32_t>(materials), options.pairs);
    DistanceResult result;
    auto& seconds = result.seconds;
    for (const auto* metric : metrics) {
        refuse_empty_windows(*metric, empty_windows(*metric, database.grid()), database.grid());
    }
    Stopwatch opening;
    auto parts = make_parts(engines, metrics, pairs, result.warnings);
    seconds.opening = opening.lap();
    std::vector<EngineNeeds> needs(parts.size());
    std::ranges::transform(parts, needs.begin(), &Part::needs);
    Workload workload = {
        .materials = materials,
        .voxels = database.grid().voxels(),
        .threads = static_cast<std::uint64_t>(tbb::this_task_arena::max_concurrency()),
        .list_bytes = list_bytes(database.grid())};
    plan_slabs(needs, options.memory_bytes, workload);  // throws before the list is made
    const Domain domain(database.grid());
    const VoxelList voxels(domain, options.voxels);
    workload.voxels = voxels.size();
    const SlabPlan plan = plan_slabs(needs, options.memory_bytes, workload);
    database.keep(std::min(options.memory_bytes - plan.bytes, options.memory_bytes / 2));
    double done = 0;
    const std::function<void()> report = [&] {
        if (options.progress) {
            options.progress(done);
        }
    };
    for (auto& part : parts) {
        part.work = part.share.engine->start(part.metrics,
                                             {.pairs = &pairs,
                                              .slab_blocks = plan.slab_blocks,
                                              .grid_voxels = database.grid().voxels(),
                                              .is_trial = options.is_trial},
                                             {database, voxels, seconds, result.warnings, report});
    }
    const bool marks_gaps = std::ranges::any_of(metrics, &Metric::is_summary);
    SlabReader reader(database, voxels, marks_gaps);
    for (std::uint64_t i = 0; i < plan.slabs; ++i) {
        const std::uint64_t first = i * plan.slab_voxels();
        const Slab slab(domain, voxels, first, std::min(first + plan.slab_voxels(), voxels.size()));
        for (auto& part : parts) {
            part.work->begin(slab);
        }
        Stopwatch reading;
        reader.read(slab, [&](std::size_t material, std::span<const BlockSamples> blocks,
                              std::span<const BlockGaps> gaps) {
            for (auto& part : parts) {
                part.work->take(material, blocks, gaps);
            }
        });
        seconds.reading += reading.lap();
        for (auto& part : parts) {
            part.work->compute();
        }
        done = static_cast<double>(i + 1) / static_cast<double>(plan.slabs);
        report();
    }
    result.distances.resize(metrics.size());
    for (auto& part : parts) {
        auto distances = part.work->distances();
        for (std::size_t m = 0; m < distances.size(); ++m) {
            result.distances[part.share.metrics[m]] = std::move(distances[m]);
        }
        result.engines.push_back(
            {part.share.engine->description(), part.share.metrics, part.work->peak_bytes()});
    }
    result.voxels = voxels.size();
    result.slabs = plan.slabs;
    result.counts = reader.counts();
    result.content_hash = reader.content_hash();
    result.material_hashes = reader.material_hashes();
    result.part_hashes = reader.part_hashes();
    const auto of_materials = reader.warnings();
    result.warnings.insert(result.warnings.end(), of_materials.begin(), of_materials.end());
    seconds.total = total.lap();
    return result;
}

}  // namespace merl::engine
