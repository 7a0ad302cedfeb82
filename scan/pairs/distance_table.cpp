#include "scan/pairs/distance_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/base/error.h"
#include "scan/io/csv.h"
#include "scan/pairs/listed_distances.h"

namespace merl::scan {
namespace {

/// Rows between two calls of progress.
constexpr std::uint64_t kRowsPerUpdate = 4096;

}  // namespace

Distances DistanceTable::distances(std::size_t first, std::size_t second) && {
    MetricColumn& a = metrics.at(first);
    MetricColumn& b = metrics.at(second);
    return {.names = std::move(names),
            .first_metric = std::move(a.metric),
            .second_metric = std::move(b.metric),
            .first = std::move(a.values),
            .second = std::move(b.values),
            .first_bounds = std::move(a.bounds),
            .second_bounds = std::move(b.bounds),
            .first_is_final = a.is_final,
            .second_is_final = b.is_final};
}

DistancesView DistanceTable::view(std::size_t first, std::size_t second) const {
    const MetricColumn& a = metrics.at(first);
    const MetricColumn& b = metrics.at(second);
    return {.names = names,
            .first_metric = a.metric,
            .second_metric = b.metric,
            .first = a.values,
            .second = b.values,
            .first_bounds = a.bounds,
            .second_bounds = b.bounds,
            .first_is_final = a.is_final,
            .second_is_final = b.is_final};
}

DistanceTable parse_distance_table(std::string_view text, const std::string& file,
                                   std::span<const std::string> columns,
                                   const std::function<void(double share)>& progress) {
    auto listed = parse_listed_distances(text, file, columns, progress);
    // Before anything as large as the pairs is made: few rows can name many materials.
    const std::uint64_t pairs = pair_count(listed.materials());
    if (listed.pairs.size() < pairs) {
        std::uint32_t missing = 0;
        while (missing < listed.pairs.size() &&
               pair_index(listed.pairs[missing], listed.materials()) == missing) {
            ++missing;
        }
        const Pair pair = pair_at(missing, listed.materials());
        throw InputError(fmt::format(
            R"({}: found {} pairs of {} materials; expected all {}: "{}" and "{}" are missing)",
            file, listed.pairs.size(), listed.materials(), pairs, listed.names[pair.first],
            listed.names[pair.second]));
    }
    return {std::move(listed.names), std::move(listed.metrics)};
}

void write_distance_table(int file, const DistanceTable& table,
                          const std::function<void(double share)>& progress) {
    std::string text = "material_1,material_2";
    for (const auto& column : table.metrics) {
        text += ',' + csv_field(column.metric);
    }
    text += '\n';
    std::vector<std::string> names;
    std::ranges::transform(table.names, std::back_inserter(names),
                           [](const std::string& name) { return csv_field(name); });
    for (std::uint32_t index = 0; index < table.pairs(); ++index) {
        const Pair pair = pair_at(index, table.materials());
        text += names[pair.first] + ',' + names[pair.second];
        for (const auto& column : table.metrics) {
            text += ',';
            append_number(text, column.values.at(index));
        }
        text += '\n';
        if (index % kRowsPerUpdate == kRowsPerUpdate - 1) {
            write_all(file, text);
            text.clear();
            if (progress) {
                progress(static_cast<double>(index + 1) / static_cast<double>(table.pairs()));
            }
        }
    }
    write_all(file, text);
}

}  // namespace merl::scan
