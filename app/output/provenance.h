#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/pipeline/pair_distances.h"
#include "engine/device/context.h"

namespace merl::app {

// What results say of where distances are from: for machines, and for people.

/// Per metric: its name, and of a computed one title, formula, source, note,
/// parameters and what it was fitted to.
nlohmann::ordered_json metrics_json(const pipeline::Provenance& provenance);

/// What refines the distances under each metric (MetricProvenance), null where nothing does.
nlohmann::ordered_json refined_by_json(const pipeline::Provenance& provenance);

/// What is known of the database or the table, and the line to quote
/// (app/pipeline/quotable_line.h).
nlohmann::ordered_json source_json(const pipeline::Provenance& provenance);

/// Which engine computed what, and how long the parts took; nothing for a table.
nlohmann::ordered_json engines_json(const pipeline::Provenance& provenance);

/// The title and the text of a line each.
using Lines = std::vector<std::pair<std::string, std::string>>;
Lines source_lines(const pipeline::Provenance& provenance, std::size_t materials);
Lines source_lines(const pipeline::PairDistances& distances);
Lines engine_lines(const pipeline::Provenance& provenance);

/// "db, MERL directory"; with a label before each where databases were joined.
std::string database_text(const engine::Database& database);

/// The same of that database which a material, by its index, is of.
std::string source_text(const engine::Database& database, std::size_t material);

/// "2 bad files: gold-paint, teflon": of many the first 20, and how many more there are.
std::string skipped_text(const std::vector<engine::BadMaterial>& skipped);

/// Writes them as lines of a summary.
void print_results(const Lines& lines);

/// "llvmpipe (LLVM 15.0.6, 256 bits) (CPU), llvmpipe (Mesa 22.3.6)", as a line says it.
std::string engine_text(const engine::EngineDescription& engine);

/// The same of the device that rendered spheres.
std::string device_text(const device::DeviceInfo& device);

}  // namespace merl::app
