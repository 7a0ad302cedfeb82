#include "app/output/provenance.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/cli/terminal.h"
#include "app/output/json.h"
#include "app/pipeline/quotable_line.h"
#include "engine/base/text.h"
#include "engine/distance/engines.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

ordered_json path_json(const std::string& path) {
    return path.empty() ? ordered_json() : ordered_json(as_utf8(path));
}

ordered_json database_json(const pipeline::DatabaseProvenance& database) {
    ordered_json hashes = ordered_json::object();
    ordered_json skipped = ordered_json::object();
    ordered_json negative = ordered_json::object();
    ordered_json negative_above = ordered_json::object();
    for (const auto& material : database.materials) {
        const std::string name = as_utf8(material.name);
        negative[name] = material.negative;
        negative_above[name] = material.negative_above_horizon;
        hashes[name] = material.content_hash;
    }
    for (const auto& material : database.skipped) {
        skipped[as_utf8(material.material)] = as_utf8(material.reason);
    }
    const auto& grid = database.grid;
    ordered_json json = {{"database",
                          {{"name", as_utf8(database.name)},
                           {"kind", database.kind},
                           {"path", path_json(database.path)},
                           {"content_hash", database.content_hash},
                           {"grid",
                            {{"theta_h", grid.theta_h},
                             {"theta_d", grid.theta_d},
                             {"phi_d", grid.phi_d},
                             {"phi_d_range", engine::range_name(grid.phi_d_range)}}},
                           {"skipped", skipped},
                           {"material_hashes", hashes}}},
                         {"samples_per_material", grid.voxels()},
                         {"samples_above_horizon", database.voxels},
                         {"negative_samples", negative},
                         {"negative_samples_above_horizon", negative_above}};
    for (const auto& part : database.parts) {
        json["database"]["databases"].push_back({{"label", part.label},
                                                 {"name", as_utf8(part.name)},
                                                 {"kind", part.kind},
                                                 {"path", path_json(part.path)},
                                                 {"content_hash", part.content_hash},
                                                 {"materials", part.materials}});
    }
    return json;
}

ordered_json metric_json(const pipeline::MetricProvenance& metric) {
    if (!metric.is_computed) {
        return {{"name", as_utf8(metric.name)}};
    }
    ordered_json parameters = ordered_json::object();
    for (const auto& [name, value] : metric.parameters) {
        parameters[name] = value;
    }
    ordered_json fitted = ordered_json::array();
    for (const auto& data : metric.fitted) {
        fitted.push_back({{"sha256", data.sha256}, {"citation", as_utf8(data.citation)}});
    }
    return {{"name", as_utf8(metric.name)},
            {"title", as_utf8(metric.title)},
            {"formula", as_utf8(metric.formula)},
            {"source", as_utf8(metric.source)},
            {"note", as_utf8(metric.note)},
            {"parameters", parameters},
            {"fitted", fitted}};
}

ordered_json engine_json(const pipeline::EngineProvenance& use) {
    const auto text = [](const std::string& value) {
        return value.empty() ? ordered_json() : ordered_json(value);
    };
    return {{"engine", use.engine.engine},
            {"grids", use.engine.grids},
            {"name", use.engine.name},
            {"kind", use.engine.kind},
            {"driver", text(use.engine.driver)},
            {"vulkan", text(use.engine.vulkan)},
            {"metrics", texts_json(use.metrics)},
            {"peak_bytes", use.peak_bytes}};
}

std::string device_text(const std::string& name, const std::string& kind,
                        const std::string& driver) {
    return fmt::format("{} ({}), {}", name, kind, driver);
}

}  // namespace

ordered_json metrics_json(const pipeline::Provenance& provenance) {
    ordered_json metrics = ordered_json::array();
    for (const auto& metric : provenance.metrics) {
        metrics.push_back(metric_json(metric));
    }
    return metrics;
}

ordered_json refined_by_json(const pipeline::Provenance& provenance) {
    ordered_json engines = ordered_json::object();
    for (const auto& metric : provenance.metrics) {
        engines[as_utf8(metric.name)] =
            metric.refined_by.empty() ? ordered_json() : ordered_json(metric.refined_by);
    }
    return engines;
}

ordered_json source_json(const pipeline::Provenance& provenance) {
    if (provenance.database) {
        auto json = database_json(*provenance.database);
        json["metrics_left_out"] = texts_json(provenance.left_out);
        if (const auto& tiles = provenance.tiles) {
            json["tiles"] = {{"folder", as_utf8(tiles->folder)},
                             {"manifest_hash", tiles->content_hash},
                             {"count", tiles->tiles}};
        }
        json["quote"] = as_utf8(pipeline::quotable_line(provenance));
        return json;
    }
    return {{"distances",
             {{"file", as_utf8(provenance.table->file)},
              {"content_hash", provenance.table->content_hash}}},
            {"quote", as_utf8(pipeline::quotable_line(provenance))}};
}

ordered_json engines_json(const pipeline::Provenance& provenance) {
    if (provenance.engines.empty()) {
        return ordered_json::object();
    }
    ordered_json engines = ordered_json::array();
    for (const auto& use : provenance.engines) {
        engines.push_back(engine_json(use));
    }
    const auto& s = provenance.seconds;
    return {{"engines", engines},
            {"slabs", provenance.slabs},
            {"distance_seconds",
             {{"kernels", s.kernels},
              {"reading", s.reading},
              {"device_transform", s.transform},
              {"difference", s.difference},
              {"waiting", s.waiting},
              {"adding", s.adding}}}};
}

Lines source_lines(const pipeline::Provenance& provenance, std::size_t materials) {
    const auto number = fmt::format("{}", fmt::group_digits(materials));
    if (const auto& database = provenance.database) {
        Lines lines;
        if (database->parts.empty()) {
            lines.emplace_back("database", fmt::format("{}, {}", database->name, database->kind));
        }
        for (const auto& part : database->parts) {
            lines.emplace_back(
                lines.empty() ? "databases" : "",
                fmt::format("{}: {} of {}, {}", part.label, counted(part.materials, "material"),
                            part.name, part.kind));
        }
        if (const auto& tiles = provenance.tiles) {
            lines.emplace_back("distances",
                               fmt::format("{}, {}", tiles->folder, counted(tiles->tiles, "tile")));
        }
        lines.emplace_back("materials", fmt::format("{}, of {} samples each", number,
                                                    fmt::group_digits(database->grid.voxels())));
        if (!database->skipped.empty()) {
            lines.emplace_back("skipped", skipped_text(database->skipped));
        }
        for (const auto& metric : provenance.left_out) {
            lines.emplace_back("left out", metric);
        }
        return lines;
    }
    return {{"distances", provenance.table->file + ", taken as exact"}, {"materials", number}};
}

Lines source_lines(const pipeline::PairDistances& distances) {
    return source_lines(distances.provenance, distances.table.materials());
}

std::string skipped_text(const std::vector<engine::BadMaterial>& skipped) {
    constexpr std::size_t kMost = 20;
    std::string text = counted(skipped.size(), "bad file");
    for (std::size_t i = 0; i < std::min(kMost, skipped.size()); ++i) {
        text += (i == 0 ? ": " : ", ") + skipped[i].material;
    }
    return skipped.size() > kMost ? fmt::format("{} and {} more", text, skipped.size() - kMost)
                                  : text;
}

Lines engine_lines(const pipeline::Provenance& provenance) {
    Lines lines;
    for (const auto& use : provenance.engines) {
        lines.emplace_back("engine", fmt::format("{}: {}", engine_text(use.engine),
                                                 counted(use.metrics.size(), "metric")));
    }
    return lines;
}

std::string database_text(const engine::Database& database) {
    if (database.parts().empty()) {
        return fmt::format("{}, {}", database.name(), database.kind());
    }
    std::string text;
    for (const auto& part : database.parts()) {
        text +=
            fmt::format("{}{}: {}, {}", text.empty() ? "" : "; ", part.label, part.name, part.kind);
    }
    return text;
}

std::string source_text(const engine::Database& database, std::size_t material) {
    for (const auto& part : database.parts()) {
        if (material - part.first < part.materials) {
            return fmt::format("{}, {}", part.name, part.kind);
        }
    }
    return database_text(database);
}

void print_results(const Lines& lines) {
    for (const auto& [name, text] : lines) {
        print_result(name, text);
    }
}

std::string engine_text(const engine::EngineDescription& engine) {
    return engine.engine == engine::kHost
               ? "host, this processor without Vulkan"
               : "vulkan, " + device_text(engine.name, engine.kind, engine.driver);
}

std::string device_text(const device::DeviceInfo& device) {
    return device_text(device.name, device.kind, device.driver);
}

}  // namespace merl::app
