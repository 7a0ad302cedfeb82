#include "engine/distance/distances.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "engine/database/content_hash.h"
#include "engine/database/damage.h"
#include "engine/distance/parts/slab_plan.h"
#include "engine/distance/parts/slab_reader.h"
#include "engine/distance/parts/squares.h"
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

PairList pairs_of(const Database& database, const DistanceOptions& options) {
    const auto materials = static_cast<std::uint32_t>(database.materials().size());
    return options.rows > 0 ? PairList::between(options.rows, materials - options.rows)
                            : PairList(materials, options.pairs);
}

/// The slabs of a database of which `voxels` are visited.
SlabPlan plan_for(std::span<const EngineNeeds> needs, std::uint64_t memory_bytes,
                  const Database& database, std::uint64_t materials, std::uint64_t voxels) {
    return plan_slabs(
        needs, memory_bytes,
        {.materials = materials,
         .voxels = voxels,
         .threads = static_cast<std::uint64_t>(tbb::this_task_arena::max_concurrency()),
         .list_bytes = list_bytes(database.grid())});
}

/// In one pass, each material read once. Without hashes but those of planes, and without a warning
/// of copies.
DistanceResult compute_pass(Engines& engines, const Database& database,
                            std::span<const Metric* const> metrics,
                            const DistanceOptions& options) {
    Stopwatch total;
    const auto materials = database.materials().size();
    const PairList pairs = pairs_of(database, options);
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
    // Throws before the list is made.
    plan_for(needs, options.memory_bytes, database, materials, database.grid().voxels());
    const Domain domain(database.grid());
    const VoxelList voxels(domain, options.voxels);
    const SlabPlan plan = plan_for(needs, options.memory_bytes, database, materials, voxels.size());
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
    result.plane_hashes = reader.plane_hashes();
    const auto of_materials = reader.warnings();
    result.warnings.insert(result.warnings.end(), of_materials.begin(), of_materials.end());
    seconds.total = total.lap();
    return result;
}

/// Whether a computation of so many pairs fits into the memory and onto the engines.
bool fits(Engines& engines, const Database& database, std::span<const Metric* const> metrics,
          const PairList& pairs, std::uint64_t memory_bytes) {
    std::vector<std::string> ignored;
    std::vector<EngineNeeds> needs;
    for (const auto& share : engines.share(metrics, ignored)) {
        std::vector<const Metric*> shared;
        for (const auto m : share.metrics) {
            shared.push_back(metrics[m]);
        }
        try {
            needs.push_back(share.engine->needs(shared, pairs));
        } catch (const Error& error) {
            if (error.fault() != Fault::device) {
                throw;
            }
            return false;
        }
    }
    try {
        plan_for(needs, memory_bytes, database, pairs.materials(), database.grid().voxels());
    } catch (const MemoryError&) {
        return false;
    }
    return true;
}

/// The largest squares of the matrix of all pairs, of each of which the sums take half of the
/// memory at most, and so do the distances that come of them; none where nothing is to be cut, or
/// would help.
std::optional<Squares> squares_for(Engines& engines, const Database& database,
                                   std::span<const Metric* const> metrics,
                                   std::uint64_t memory_bytes) {
    const auto materials = static_cast<std::uint32_t>(database.materials().size());
    if (fits(engines, database, metrics, PairList(materials), memory_bytes)) {
        return std::nullopt;
    }
    for (std::uint32_t across = 2; across < materials; ++across) {
        const Squares squares = {.materials = materials, .side = (materials + across - 1) / across};
        const std::uint64_t results =
            2 * sizeof(double) * metrics.size() * squares.side * std::uint64_t{squares.side};
        if (squares.side >= 2 && results < memory_bytes / 2 &&
            fits(engines, database, metrics, PairList::between(squares.side, squares.side),
                 memory_bytes / 2)) {
            return squares;
        }
    }
    return std::nullopt;
}

void add_seconds(DistanceSeconds& sum, const DistanceSeconds& more) {
    sum.opening += more.opening;
    sum.kernels += more.kernels;
    sum.reading += more.reading;
    sum.transform += more.transform;
    sum.difference += more.difference;
    sum.waiting += more.waiting;
    sum.adding += more.adding;
}

/// Puts the distances of a rectangle to their places among those of all pairs.
void place(MetricDistances&& part, const Rectangle& rectangle, const PairList& all,
           std::size_t windows, MetricDistances& to) {
    to.values.resize(all.size());
    to.bounds.resize(all.size());
    std::size_t at = 0;
    for (std::uint32_t r = 0; r < rectangle.rows; ++r) {
        const std::uint32_t first = rectangle.row + r;
        const std::uint32_t skipped = rectangle.is_diagonal() ? r + 1 : 0;
        const std::size_t begin = all.begin_of(first) + (rectangle.column + skipped - first - 1);
        const std::size_t count = rectangle.columns - skipped;
        std::copy_n(part.values.begin() + static_cast<std::ptrdiff_t>(at), count,
                    to.values.begin() + static_cast<std::ptrdiff_t>(begin));
        std::copy_n(part.bounds.begin() + static_cast<std::ptrdiff_t>(at), count,
                    to.bounds.begin() + static_cast<std::ptrdiff_t>(begin));
        at += count;
    }
    if (rectangle.is_diagonal() && windows > 0) {
        to.means.resize(windows * all.materials());
        std::ranges::copy(part.means,
                          to.means.begin() + static_cast<std::ptrdiff_t>(windows * rectangle.row));
    }
}

/// What a pass found out about its materials, where that is not known yet; otherwise it must be
/// the same.
void note_materials(const DistanceResult& pass, const Rectangle& rectangle,
                    const Database& database, DistanceResult& result) {
    for (std::size_t m = 0; m < pass.plane_hashes.size(); ++m) {
        const std::size_t at =
            m < rectangle.rows ? rectangle.row + m : rectangle.column + (m - rectangle.rows);
        auto& known = result.plane_hashes[at];
        if (!known.empty() && known != pass.plane_hashes[m]) {
            throw InputError(
                fmt::format("{}: found other samples than when it was read before; "
                            "expected files that nobody changes",
                            database.place_of(at)));
        }
        known = pass.plane_hashes[m];
        result.counts[at] = pass.counts[m];
    }
}

void add_once(std::vector<std::string>& lines, const std::vector<std::string>& more) {
    for (const auto& line : more) {
        if (std::ranges::find(lines, line) == lines.end()) {
            lines.push_back(line);
        }
    }
}

/// Square after square, as if in one pass.
DistanceResult compute_squares(Engines& engines, const Database& database,
                               std::span<const Metric* const> metrics, const Squares& squares,
                               const DistanceOptions& options) {
    Stopwatch total;
    const PairList all(squares.materials);
    DistanceResult result;
    result.distances.resize(metrics.size());
    result.counts.resize(squares.materials);
    result.plane_hashes.resize(squares.materials);
    result.passes = squares.count();
    std::uint64_t done = 0;
    for (std::uint64_t number = 0; number < squares.count(); ++number) {
        const auto rectangle = squares.at(number);
        auto of_pass = options;
        of_pass.rows = rows_of(rectangle);
        if (options.progress) {
            of_pass.progress = [&](double share) {
                options.progress(
                    (static_cast<double>(done) + share * static_cast<double>(rectangle.pairs())) /
                    static_cast<double>(all.size()));
            };
        }
        auto pass = compute_pass(engines, *materials_of(database, rectangle), metrics, of_pass);
        note_materials(pass, rectangle, database, result);
        for (std::size_t m = 0; m < metrics.size(); ++m) {
            place(std::exchange(pass.distances[m], {}), rectangle, all,
                  metrics[m]->header.windows.size(), result.distances[m]);
        }
        result.engines.resize(pass.engines.size());
        for (std::size_t e = 0; e < pass.engines.size(); ++e) {
            const auto peak = std::max(result.engines[e].peak_bytes, pass.engines[e].peak_bytes);
            result.engines[e] = pass.engines[e];
            result.engines[e].peak_bytes = peak;
        }
        add_once(result.warnings, pass.warnings);
        add_seconds(result.seconds, pass.seconds);
        result.voxels = pass.voxels;
        result.slabs += pass.slabs;
        done += rectangle.pairs();
    }
    result.seconds.total = total.lap();
    return result;
}

/// From the hashes of planes.
void add_hashes(const Database& database, DistanceResult& result) {
    const auto grid = database.grid().text();
    const std::span planes(result.plane_hashes);
    result.content_hash = content_digest(database.materials(), grid, planes);
    for (const auto& of_material : planes) {
        result.material_hashes.push_back(material_digest(grid, of_material));
    }
    for (const auto& part : database.parts()) {
        result.part_hashes.push_back(content_digest(own_names(database, part), grid,
                                                    planes.subspan(part.first, part.materials)));
    }
}

}  // namespace

DistanceResult compute_distances(Engines& engines, const Database& database,
                                 std::span<const Metric* const> metrics,
                                 const DistanceOptions& options) {
    const auto materials = database.materials().size();
    if (materials > kMaxMaterials) {
        throw InputError(fmt::format("{} materials are more than {}, the most there may be",
                                     materials, kMaxMaterials));
    }
    if (options.rows > 0 && (!options.pairs.empty() || options.rows >= materials)) {
        throw std::invalid_argument(
            fmt::format("{} rows of {} materials and a list of {} pairs; expected one of the two",
                        options.rows, materials, options.pairs.size()));
    }
    const bool is_all = options.rows == 0 && options.pairs.empty();
    const auto squares =
        is_all ? squares_for(engines, database, metrics, options.memory_bytes) : std::nullopt;
    auto result = squares ? compute_squares(engines, database, metrics, *squares, options)
                          : compute_pass(engines, database, metrics, options);
    add_hashes(database, result);
    for (const auto& same : copies_among(database.materials(), result.material_hashes)) {
        result.warnings.push_back(
            fmt::format("{} of {} have the same content", fmt::join(same, ", "), database.name()));
    }
    return result;
}

}  // namespace merl::engine
