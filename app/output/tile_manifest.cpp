#include "app/output/tile_manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/output/json.h"
#include "app/output/npy_file.h"
#include "app/output/provenance.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/text.h"
#include "engine/database/content_hash.h"
#include "engine/database/domain.h"
#include "scan/io/input.h"
#include "scan/io/json_format.h"
#include "scan/pairs/pairs.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// What a database is called and where it is.
ordered_json place_json(const std::string& name, const std::string& kind, const std::string& path) {
    return {{"name", as_utf8(name)}, {"kind", kind}, {"path", as_utf8(path)}};
}

ordered_json database_json(const pipeline::DatabaseProvenance& database) {
    auto json = place_json(database.name, database.kind, database.path);
    const auto& grid = database.grid;
    json["grid"] = {{"theta_h", grid.theta_h},
                    {"theta_d", grid.theta_d},
                    {"phi_d", grid.phi_d},
                    {"phi_d_range", engine::range_name(grid.phi_d_range)}};
    json["databases"] = ordered_json::array();
    for (const auto& part : database.parts) {
        auto of_part = place_json(part.name, part.kind, part.path);
        of_part["label"] = part.label;
        of_part["materials"] = part.materials;
        json["databases"].push_back(std::move(of_part));
    }
    json["skipped"] = ordered_json::array();
    for (const auto& [material, reason] : database.skipped) {
        json["skipped"].push_back({{"material", as_utf8(material)}, {"reason", as_utf8(reason)}});
    }
    json["materials"] = ordered_json::array();
    for (const auto& material : database.materials) {
        json["materials"].push_back(as_utf8(material.name));
    }
    return json;
}

ordered_json engine_json(const pipeline::EngineProvenance& use) {
    return {{"engine", use.engine.engine},       {"grids", use.engine.grids},
            {"name", use.engine.name},           {"kind", use.engine.kind},
            {"driver", use.engine.driver},       {"vulkan", use.engine.vulkan},
            {"metrics", texts_json(use.metrics)}};
}

std::string text_at(const ordered_json& json, const char* key) {
    return from_utf8(json.at(key).get<std::string>());
}

std::vector<std::string> texts_at(const ordered_json& json, const char* key) {
    std::vector<std::string> texts;
    for (const auto& text : json.at(key)) {
        texts.push_back(from_utf8(text.get<std::string>()));
    }
    return texts;
}

/// What is wrong, for people; the file is named by whoever catches it.
[[noreturn]] void refuse(const std::string& what) {
    throw std::domain_error(what);
}

/// A whole number in a range. What JSON calls a number may have a point, a sign or any size.
std::uint64_t whole_at(const ordered_json& json, const char* key, std::uint64_t least,
                       std::uint64_t greatest) {
    const auto& number = json.at(key);
    if (!number.is_number_unsigned() || number.get<std::uint64_t>() < least ||
        number.get<std::uint64_t>() > greatest) {
        refuse(fmt::format("\"{}\": found {}; expected {}", key,
                           number.dump(-1, ' ', false, ordered_json::error_handler_t::replace),
                           least == greatest
                               ? std::to_string(least)
                               : fmt::format("a whole number from {} to {}", least, greatest)));
    }
    return number.get<std::uint64_t>();
}

/// A number of materials, or of one among them.
std::uint32_t material_at(const ordered_json& json, const char* key) {
    return static_cast<std::uint32_t>(whole_at(json, key, 0, scan::max_materials));
}

/// A number of samples.
std::uint64_t samples_at(const ordered_json& json, const char* key) {
    return whole_at(json, key, 0, std::numeric_limits<std::uint64_t>::max());
}

engine::Grid grid_at(const ordered_json& json) {
    engine::Grid grid;
    const auto& found = json.at("grid");
    for (const auto& [key, side] : {std::pair("theta_h", &grid.theta_h),
                                    {"theta_d", &grid.theta_d},
                                    {"phi_d", &grid.phi_d}}) {
        *side = static_cast<std::uint32_t>(whole_at(found, key, 1, engine::kMaxSide));
    }
    grid.phi_d_range =
        found.at("phi_d_range").get<std::string>() == engine::range_name(engine::PhiDRange::two_pi)
            ? engine::PhiDRange::two_pi
            : engine::PhiDRange::pi;
    return grid;
}

pipeline::DatabaseProvenance database_of(const ordered_json& json) {
    pipeline::DatabaseProvenance database;
    database.name = text_at(json, "name");
    database.kind = text_at(json, "kind");
    database.path = text_at(json, "path");
    database.grid = grid_at(json);
    for (const auto& name : texts_at(json, "materials")) {
        if (!database.materials.empty() && name <= database.materials.back().name) {
            refuse(fmt::format(R"("materials" has "{}" after "{}"; expected names in order)", name,
                               database.materials.back().name));
        }
        database.materials.push_back({.name = name, .content_hash = {}});
    }
    const auto materials = database.materials.size();
    if (materials < 2 || materials > scan::max_materials) {
        refuse(fmt::format("found {} materials; expected 2 to {}", materials, scan::max_materials));
    }
    std::size_t first = 0;
    for (const auto& part : json.at("databases")) {
        const auto& added =
            database.parts.emplace_back(pipeline::PartProvenance{text_at(part, "label"),
                                                                 text_at(part, "name"),
                                                                 text_at(part, "kind"),
                                                                 text_at(part, "path"),
                                                                 {},
                                                                 material_at(part, "materials")});
        for (std::size_t m = 0; m < added.materials; ++m, ++first) {
            if (first >= materials ||
                !database.materials[first].name.starts_with(added.label + "/")) {
                refuse(fmt::format(R"("databases" does not go with "materials" at "{}")",
                                   added.label));
            }
        }
    }
    if (!database.parts.empty() && first != materials) {
        refuse(R"("databases" has not all of "materials")");
    }
    for (const auto& skipped : json.at("skipped")) {
        database.skipped.push_back({text_at(skipped, "material"), text_at(skipped, "reason")});
    }
    return database;
}

pipeline::MetricProvenance metric_of(const ordered_json& json) {
    pipeline::MetricProvenance metric;
    metric.name = text_at(json, "name");
    metric.title = text_at(json, "title");
    metric.formula = text_at(json, "formula");
    metric.source = text_at(json, "source");
    metric.note = text_at(json, "note");
    metric.is_pseudometric = json.at("is_pseudometric").get<bool>();
    metric.accuracy = text_at(json, "accuracy");
    metric.refined_by = text_at(json, "refined_by");
    for (const auto& [name, value] : json.at("parameters").items()) {
        metric.parameters.emplace_back(name, value.get<double>());
    }
    for (const auto& data : json.at("fitted")) {
        metric.fitted.push_back(
            {.sha256 = text_at(data, "sha256"), .citation = text_at(data, "citation")});
    }
    return metric;
}

/// A JSON object. Throws InputError for what is none, and for what `use` throws.
void with_json(const std::string& text, const std::string& file, const char* what,
               const std::function<void(const ordered_json&)>& use) {
    ordered_json json;
    try {
        json = ordered_json::parse(text, scan::JsonCheck<ordered_json>(file));
    } catch (const ordered_json::exception& error) {
        throw InputError(fmt::format("{}: is no JSON: {}", file, scan::json_fault(error)));
    }
    if (json.is_object()) {
        scan::expect_known_format(json, file);
    }
    try {
        use(json);
    } catch (const ordered_json::exception& error) {
        throw InputError(fmt::format("{}: is no {}: {}", file, what, scan::json_fault(error)));
    } catch (const std::domain_error& error) {
        throw InputError(fmt::format("{}: is no {}: {}", file, what, error.what()));
    }
}

std::string hash_of(const TileManifest& manifest, std::uint32_t first,
                    std::span<const std::string> planes) {
    std::vector<std::string> names;
    for (std::size_t m = 0; m < planes.size(); ++m) {
        names.push_back(manifest.provenance.database->materials.at(first + m).name);
    }
    return engine::content_digest(names, manifest.provenance.database->grid.text(), planes);
}

/// The first place at which they differ.
std::optional<std::string> difference(const ordered_json& there, const ordered_json& here,
                                      const std::string& place) {
    if (there == here) {
        return std::nullopt;
    }
    if (there.is_object() && here.is_object()) {
        for (const auto& [key, value] : here.items()) {
            const auto found = there.find(key);
            const auto inside = place.empty() ? key : fmt::format("{}/{}", place, key);
            if (auto one =
                    difference(found == there.end() ? ordered_json() : *found, value, inside)) {
                return one;
            }
        }
    }
    if (there.is_array() && here.is_array()) {
        if (there.size() != here.size()) {
            return fmt::format("{} has {} there and {} here", place, there.size(), here.size());
        }
        for (std::size_t i = 0; i < here.size(); ++i) {
            if (auto one = difference(there[i], here[i], fmt::format("{}[{}]", place, i))) {
                return one;
            }
        }
    }
    const auto text = [](const ordered_json& json) {
        constexpr std::size_t kMost = 200;
        auto whole = json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
        if (whole.size() > kMost) {
            whole = whole.substr(0, kMost) + " ...";
        }
        return whole;
    };
    return fmt::format("{} is {} there and {} here", place, text(there), text(here));
}

}  // namespace

std::vector<std::string> TileManifest::materials() const {
    std::vector<std::string> names;
    for (const auto& material : provenance.database->materials) {
        names.push_back(material.name);
    }
    return names;
}

TileManifest manifest_of(const pipeline::Provenance& provenance,
                         std::span<const engine::Metric* const> metrics, std::uint32_t side) {
    TileManifest manifest;
    manifest.provenance = provenance;
    const auto materials = provenance.database->materials.size();
    manifest.tiles = {.materials = static_cast<std::uint32_t>(materials),
                      .side = side > 0 ? side : pipeline::default_tile_side(materials)};
    if (manifest.tiles.count() > kMostTiles) {
        throw Error(
            Fault::usage,
            fmt::format("--tile {}: found {} tiles for {} materials; expected at most {}",
                        manifest.tiles.side, manifest.tiles.count(), materials, kMostTiles));
    }
    for (const auto* metric : metrics) {
        manifest.metrics.push_back({.text = engine::text_of(*metric),
                                    .source_hash = merl::hash_of(metric->source),
                                    .is_final = metric->is_summary()});
    }
    return manifest;
}

std::string manifest_text(const TileManifest& manifest) {
    const auto& provenance = manifest.provenance;
    auto json = program_json();
    json["tiles"] = {{"side", manifest.tiles.side}, {"count", manifest.tiles.count()}};
    auto metrics = metrics_json(provenance);
    for (std::size_t m = 0; m < manifest.metrics.size(); ++m) {
        metrics[m]["is_pseudometric"] = provenance.metrics[m].is_pseudometric;
        metrics[m]["accuracy"] = provenance.metrics[m].accuracy;
        metrics[m]["refined_by"] = provenance.metrics[m].refined_by;
        metrics[m]["is_summary"] = manifest.metrics[m].is_final;
        metrics[m]["text"] = as_utf8(manifest.metrics[m].text);
        metrics[m]["source_hash"] = manifest.metrics[m].source_hash;
    }
    json["metrics"] = std::move(metrics);
    json["metrics_left_out"] = texts_json(provenance.left_out);
    json["engines"] = ordered_json::array();
    for (const auto& use : provenance.engines) {
        json["engines"].push_back(engine_json(use));
    }
    json["database"] = database_json(*provenance.database);
    return json_text(json);
}

TileManifest parse_manifest(const std::string& text, const std::string& file) {
    TileManifest manifest;
    with_json(text, file, "manifest of tiles", [&](const ordered_json& json) {
        auto& provenance = manifest.provenance;
        provenance.version = json.at("program").at("version").get<std::string>();
        provenance.database = database_of(json.at("database"));
        provenance.left_out = texts_at(json, "metrics_left_out");
        for (const auto& metric : json.at("metrics")) {
            provenance.metrics.push_back(metric_of(metric));
            const auto& name = provenance.metrics.back().name;
            if (std::ranges::count(provenance.metrics, name, &pipeline::MetricProvenance::name) !=
                1) {
                refuse(fmt::format(R"("metrics" has "{}" twice)", name));
            }
            manifest.metrics.push_back({.text = text_at(metric, "text"),
                                        .source_hash = text_at(metric, "source_hash"),
                                        .is_final = metric.at("is_summary").get<bool>()});
        }
        if (manifest.metrics.empty()) {
            refuse("\"metrics\" is empty");
        }
        for (const auto& use : json.at("engines")) {
            provenance.engines.push_back({.engine = {.engine = text_at(use, "engine"),
                                                     .grids = text_at(use, "grids"),
                                                     .name = text_at(use, "name"),
                                                     .kind = text_at(use, "kind"),
                                                     .driver = text_at(use, "driver"),
                                                     .vulkan = text_at(use, "vulkan")},
                                          .metrics = texts_at(use, "metrics")});
        }
        const auto materials = static_cast<std::uint32_t>(provenance.database->materials.size());
        const auto side = whole_at(json.at("tiles"), "side", 1, scan::max_materials);
        manifest.tiles = {.materials = materials, .side = static_cast<std::uint32_t>(side)};
        const auto count = manifest.tiles.count();
        if (count > kMostTiles) {
            refuse(fmt::format(R"("side" {} and {} materials are {} tiles; expected at most {})",
                               side, materials, count, kMostTiles));
        }
        whole_at(json.at("tiles"), "count", count, count);
    });
    const auto& grid = manifest.provenance.database->grid;
    engine::require_usable(grid, file);
    manifest.voxels =
        engine::VoxelList(engine::Domain(grid), engine::VoxelSet::above_horizon).size();
    return manifest;
}

std::string manifest_difference(const std::string& there, const std::string& here) {
    const auto there_json = ordered_json::parse(there);
    const auto here_json = ordered_json::parse(here);
    if (auto of_database =
            difference(there_json.at("database"), here_json.at("database"), "database")) {
        return *of_database;
    }
    return difference(there_json, here_json, "").value_or("");
}

TileRecord record_of(const TileManifest& manifest, const pipeline::DistanceTile& tile) {
    const auto& rectangle = tile.rectangle;
    const std::span planes(tile.plane_hashes);
    TileRecord record;
    record.rectangle = rectangle;
    record.rows_hash = hash_of(manifest, rectangle.row, planes.first(rectangle.rows));
    record.columns_hash = hash_of(manifest, rectangle.column, planes.last(rectangle.columns));
    record.voxels = tile.voxels;
    record.array_hash = hash_of_numbers(tile.numbers);
    if (rectangle.is_diagonal()) {
        record.planes = tile.plane_hashes;
        record.counts = tile.counts;
        record.warnings = tile.warnings;
    }
    return record;
}

std::string record_text(const TileManifest& manifest, const TileRecord& record) {
    const auto& [row, rows, column, columns] = record.rectangle;
    auto json = program_json();
    json["rows"] = {{"first", row}, {"count", rows}, {"content_hash", record.rows_hash}};
    json["columns"] = {
        {"first", column}, {"count", columns}, {"content_hash", record.columns_hash}};
    json["array_hash"] = record.array_hash;
    json["samples_above_horizon"] = record.voxels;
    json["materials"] = ordered_json::array();
    for (std::size_t m = 0; m < record.planes.size(); ++m) {
        json["materials"].push_back(
            {{"name", as_utf8(manifest.provenance.database->materials[row + m].name)},
             {"plane_hashes", record.planes[m]},
             {"negative_samples", record.counts[m].negative},
             {"negative_samples_above_horizon", record.counts[m].negative_above_horizon}});
    }
    json["warnings"] = texts_json(record.warnings);
    return json_text(json);
}

TileRecord parse_record(const std::string& text, const std::string& file,
                        const TileManifest& manifest, const engine::Rectangle& rectangle) {
    TileRecord record;
    with_json(text, file, "record of this tile", [&](const ordered_json& json) {
        const auto& rows = json.at("rows");
        const auto& columns = json.at("columns");
        record.rectangle = {.row = material_at(rows, "first"),
                            .rows = material_at(rows, "count"),
                            .column = material_at(columns, "first"),
                            .columns = material_at(columns, "count")};
        if (record.rectangle != rectangle) {
            refuse(fmt::format("found rows from {} and columns from {}; expected {} and {}",
                               record.rectangle.row, record.rectangle.column, rectangle.row,
                               rectangle.column));
        }
        record.rows_hash = text_at(rows, "content_hash");
        record.columns_hash = text_at(columns, "content_hash");
        record.array_hash = text_at(json, "array_hash");
        record.voxels = whole_at(json, "samples_above_horizon", manifest.voxels, manifest.voxels);
        record.warnings = texts_at(json, "warnings");
        const auto& names = manifest.provenance.database->materials;
        for (const auto& material : json.at("materials")) {
            const auto m = rectangle.row + record.planes.size();
            const auto name = text_at(material, "name");
            if (m >= names.size() || name != names[m].name) {
                refuse(fmt::format(R"("materials"[{}]: found "{}"; expected {})",
                                   record.planes.size(), name,
                                   m < names.size() ? fmt::format(R"("{}")", names[m].name)
                                                    : std::string("none")));
            }
            record.planes.push_back(text_at(material, "plane_hashes"));
            record.counts.push_back(
                {.negative = samples_at(material, "negative_samples"),
                 .negative_above_horizon = samples_at(material, "negative_samples_above_horizon")});
        }
        const std::size_t expected = rectangle.is_diagonal() ? rectangle.rows : 0;
        if (record.planes.size() != expected) {
            refuse(fmt::format("found {} materials; expected {}", record.planes.size(), expected));
        }
        if (rectangle.is_diagonal() &&
            (hash_of(manifest, rectangle.row, record.planes) != record.rows_hash ||
             record.columns_hash != record.rows_hash)) {
            refuse("its hashes do not go with each other");
        }
    });
    return record;
}

}  // namespace merl::app
