#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "scan/pairs/agreement.h"
#include "scan/pairs/count.h"
#include "scan/pairs/distance_table.h"
#include "scan/select/triangle.h"
#include "scan/statistics/estimate.h"

namespace merl::app {

// How pairs and configurations appear in summaries, for people and for machines.

/// "1 sphere", "2 spheres", "1,000 spheres".
std::string counted(std::uint64_t number, std::string_view noun);

/// A pair as one reads it: "chrome | steel".
std::string pair_text(const std::vector<std::string>& names, std::uint32_t index);

/// The materials of a pair.
nlohmann::ordered_json pair_json(const std::vector<std::string>& names, std::uint32_t index);

/// The materials of a configuration and its agreement.
nlohmann::ordered_json configuration_json(const std::vector<std::string>& names,
                                          const scan::Configuration& configuration);

/// How many configurations were selected, and the range of their agreement.
nlohmann::ordered_json selection_json(std::span<const scan::Configuration> selection);

/// The same as one reads it; not of none.
std::string selection_text(std::span<const scan::Configuration> selection);

/// The five classes of configurations.
nlohmann::ordered_json counts_json(const scan::Counts& counts);

/// What a check of the triangle inequality found.
nlohmann::ordered_json triangle_json(const scan::DistanceTable& table,
                                     const scan::TriangleCheck& check);

/// The same as one reads it, without the metric: "fails in 7 of 1,716 triples, most by a factor of
/// 1.3: alum | chrome 2.6 > 1 + 1 through steel".
std::string triangle_text(const scan::DistanceTable& table, const scan::TriangleCheck& check);

/// How much PNG cuts off of so many spheres, which is of `most` of the pixels of one.
std::string clipped_text(std::uint64_t clipped, std::uint64_t spheres, double most,
                         const std::string& name);

/// How they were counted.
std::string counted_by(bool streamed);

/// A number; null where it is not one, which says that there is no such figure; "inf" and "-inf",
/// which JSON has no number for.
nlohmann::ordered_json figure_json(double value);

/// A figure with its interval: `value`, `low`, `high`.
nlohmann::ordered_json estimate_json(const scan::Estimate& estimate);

/// The same as one reads it: "0.698 [0.681, 0.715]", without the interval where there is none, "-"
/// where there is no figure.
std::string estimate_text(const scan::Estimate& estimate);

/// What every summary begins with: its format, and the program that wrote it.
nlohmann::ordered_json program_json();

/// Texts by name as an object, in their order.
nlohmann::ordered_json texts_json(const std::vector<std::pair<std::string, std::string>>& texts);

/// Texts as an array, those that are no UTF-8 as as_utf8 writes them.
nlohmann::ordered_json texts_json(const std::vector<std::string>& texts);

/// The text of a JSON file. Replaces what is no UTF-8, so that a strict reader reads it.
std::string json_text(const nlohmann::ordered_json& json);

}  // namespace merl::app
