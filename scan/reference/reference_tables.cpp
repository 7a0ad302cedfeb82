#include "scan/reference/reference_tables.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "scan/io/csv.h"
#include "scan/reference/reference_summary.h"

namespace merl::scan {

void write_approximations(int file, const ReferenceDistances& distances) {
    const auto& approximations = distances.approximations;
    const auto& pairs = distances.pairs;
    const auto& table = distances.table;
    const auto& metrics = table.metrics;
    const bool bounded =
        std::ranges::none_of(metrics, [](const auto& column) { return column.bounds.empty(); });
    std::string text = "original,approximation,label";
    for (const auto& [suffix, is_written] :
         {std::pair("", true), {"_rank", true}, {"_bound", bounded}, {"_precision", bounded}}) {
        for (const auto& column : metrics) {
            text += is_written ? ',' + csv_field(column.metric + suffix) : "";
        }
    }
    text += '\n';
    std::vector<std::vector<double>> ranks;
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        ranks.push_back(ranks_of(distances, m));
    }
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const auto& one = approximations.list[i];
        text += csv_field(table.names[one.original]) + ',' +
                csv_field(table.names[one.approximation]) + ',' +
                csv_field(approximations.labels[one.label]);
        const auto add = [&](double number) {
            text += ',';
            append_number(text, number);
        };
        for (const auto& column : metrics) {
            add(column.values[pairs[i]]);
        }
        for (const auto& of_metric : ranks) {
            add(of_metric[i]);
        }
        for (const auto& column : metrics) {
            if (bounded) {
                add(column.bounds[pairs[i]]);
            }
        }
        for (const auto& column : metrics) {
            if (bounded) {
                text += column.is_final || column.bounds[pairs[i]] == 0 ? ",float64" : ",float32";
            }
        }
        text += '\n';
    }
    write_all(file, text);
}

}  // namespace merl::scan
