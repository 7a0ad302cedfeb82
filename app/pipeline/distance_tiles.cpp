#include "app/pipeline/distance_tiles.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "app/pipeline/version.h"
#include "engine/database/bad_files.h"
#include "engine/database/content_hash.h"
#include "engine/database/damage.h"

namespace merl::pipeline {
namespace {

/// The numbers of one metric, of the pairs of a rectangle in their order, to their places.
void place(std::span<const double> of_pairs, const engine::Rectangle& rectangle, double* to) {
    if (!rectangle.is_diagonal()) {
        std::ranges::copy(of_pairs, to);
        return;
    }
    const std::size_t side = rectangle.rows;
    std::size_t at = 0;
    for (std::size_t row = 0; row < side; ++row) {
        for (std::size_t column = row + 1; column < side; ++column, ++at) {
            to[row * side + column] = of_pairs[at];
            to[column * side + row] = of_pairs[at];
        }
    }
}

}  // namespace

std::uint32_t default_tile_side(std::size_t materials) {
    constexpr std::size_t kAcross = 8;
    constexpr std::size_t kLeast = 8;
    constexpr std::size_t kMost = 256;
    return static_cast<std::uint32_t>(
        std::clamp((materials + kAcross - 1) / kAcross, kLeast, kMost));
}

DistanceTile compute_tile(engine::Engines& engines, const engine::Database& database,
                          std::span<const engine::Metric* const> metrics,
                          const engine::Rectangle& rectangle, std::uint64_t memory_bytes,
                          const Control& control) {
    const auto materials = engine::materials_of(database, rectangle);
    auto computed = engine::compute_distances(engines, *materials, metrics,
                                              {.memory_bytes = memory_bytes,
                                               .rows = engine::rows_of(rectangle),
                                               .progress = control.stage("distances")});
    DistanceTile tile;
    const std::size_t plane = std::size_t{rectangle.rows} * rectangle.columns;
    tile.rectangle = rectangle;
    tile.numbers.resize(metrics.size() * 2 * plane);
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        const auto of_metric = std::exchange(computed.distances[m], {});
        place(of_metric.values, rectangle, &tile.numbers[2 * m * plane]);
        place(of_metric.bounds, rectangle, &tile.numbers[(2 * m + 1) * plane]);
    }
    // Copies come last. They are to be looked for among all materials, by add_materials().
    const auto copies = engine::copies_among(materials->materials(), computed.material_hashes);
    computed.warnings.resize(computed.warnings.size() - copies.size());
    tile.plane_hashes = std::move(computed.plane_hashes);
    tile.counts = std::move(computed.counts);
    tile.voxels = computed.voxels;
    tile.warnings = std::move(computed.warnings);
    tile.seconds = computed.seconds.total;
    for (const auto& use : computed.engines) {
        tile.peak_bytes += use.peak_bytes;
    }
    return tile;
}

Provenance provenance_before(engine::Engines& engines, const engine::Database& database,
                             std::span<const engine::Metric* const> metrics) {
    Provenance result;
    result.version = kVersion;
    auto& of_database = result.database.emplace(DatabaseProvenance{.name = database.name(),
                                                                   .kind = database.kind(),
                                                                   .path = database.path(),
                                                                   .content_hash = {},
                                                                   .grid = database.grid(),
                                                                   .voxels = 0,
                                                                   .materials = {},
                                                                   .parts = {},
                                                                   .skipped = database.skipped()});
    for (const auto& material : database.materials()) {
        of_database.materials.push_back({.name = material, .content_hash = {}});
    }
    for (const auto& part : database.parts()) {
        of_database.parts.push_back(
            {part.label, part.name, part.kind, part.path, {}, part.materials});
    }
    for (const auto* metric : metrics) {
        result.metrics.push_back(provenance_of(*metric));
    }
    for (const auto& share : engines.share(metrics, result.warnings)) {
        auto& engine = result.engines.emplace_back(EngineProvenance{
            .engine = share.engine->description(), .metrics = {}, .peak_bytes = 0});
        for (const auto m : share.metrics) {
            engine.metrics.push_back(metrics[m]->name);
        }
    }
    return result;
}

void add_materials(Provenance& provenance, std::span<const std::string> planes,
                   std::span<const engine::MaterialCounts> counts) {
    auto& database = *provenance.database;
    const auto grid = database.grid.text();
    std::vector<std::string> names;
    std::vector<std::string> hashes;
    for (std::size_t m = 0; m < database.materials.size(); ++m) {
        auto& material = database.materials[m];
        material.content_hash = engine::material_digest(grid, planes[m]);
        material.negative = counts[m].negative;
        material.negative_above_horizon = counts[m].negative_above_horizon;
        names.push_back(material.name);
        hashes.push_back(material.content_hash);
    }
    database.content_hash = engine::content_digest(names, grid, planes);
    std::size_t first = 0;
    for (auto& part : database.parts) {
        std::vector<std::string> own;  // without the label and the slash after it
        for (std::size_t m = 0; m < part.materials; ++m) {
            own.push_back(names[first + m].substr(part.label.size() + 1));
        }
        part.content_hash =
            engine::content_digest(own, grid, planes.subspan(first, part.materials));
        first += part.materials;
    }
    for (const auto& same : engine::copies_among(names, hashes)) {
        provenance.warnings.push_back(
            fmt::format("{} of {} have the same content", fmt::join(same, ", "), database.name));
    }
}

}  // namespace merl::pipeline
