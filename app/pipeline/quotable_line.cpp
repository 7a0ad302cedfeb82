#include "app/pipeline/quotable_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

namespace merl::pipeline {
namespace {

std::string metric_text(const MetricProvenance& metric) {
    if (!metric.is_computed) {
        return metric.name;
    }
    // The name has those that were given; the others count as much.
    std::string text = metric.name.substr(0, metric.name.find(':'));
    for (const auto& [name, value] : metric.parameters) {
        text += fmt::format(":{}={}", name, value);
    }
    return metric.accuracy.empty() ? text : fmt::format("{} ({})", text, metric.accuracy);
}

std::string grid_text(const engine::Grid& grid) {
    return fmt::format("grid {}x{}x{}, phi_d to {}", grid.theta_h, grid.theta_d, grid.phi_d,
                       engine::range_name(grid.phi_d_range));
}

}  // namespace

std::string quotable_line(const Provenance& provenance) {
    std::string line = fmt::format("merl-scan v{}", provenance.version);
    for (const auto& metric : provenance.metrics) {
        line += ", " + metric_text(metric);
    }
    if (const auto& database = provenance.database) {
        if (database->parts.empty()) {
            line += fmt::format(", database {} ({})", database->name, database->content_hash);
        }
        for (const auto& part : database->parts) {
            line += fmt::format(", database {}={} ({})", part.label, part.name, part.content_hash);
        }
        line += fmt::format(", {} materials, {}", database->materials.size(),
                            grid_text(database->grid));
    } else if (provenance.table) {
        line += fmt::format(", distances {} ({}), taken as exact",
                            std::filesystem::path(provenance.table->file).filename().string(),
                            provenance.table->content_hash);
    }
    std::vector<std::string> engines;
    for (const auto& use : provenance.engines) {
        const std::string text = use.engine.driver.empty()
                                     ? use.engine.engine
                                     : fmt::format("{} on {}, {}", use.engine.engine,
                                                   use.engine.name, use.engine.driver);
        if (std::ranges::find(engines, text) == engines.end()) {
            engines.push_back(text);
            line += ", engine " + text;
        }
    }
    return line;
}

}  // namespace merl::pipeline
