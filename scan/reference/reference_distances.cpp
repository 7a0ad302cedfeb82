#include "scan/reference/reference_distances.h"

#include <algorithm>
#include <stdexcept>

namespace merl::scan {
ReferenceDistances reference_distances(ListedDistances table, Approximations approximations) {
    if (table.pairs != pairs_of(approximations)) {
        throw std::invalid_argument("distances of other pairs than those of the approximations");
    }
    ReferenceDistances result;
    const auto& list = approximations.list;
    result.by_pair.resize(list.size());
    for (std::size_t i = 0; i < list.size(); ++i) {
        if (i == 0 || list[i].original != list[i - 1].original) {
            result.ranges.push_back({list[i].original, i, i});
        }
        ++result.ranges.back().end;
        const auto pair = static_cast<std::uint32_t>(table.place_of(list[i].pair()).value());
        result.pairs.push_back(pair);
        result.by_pair[pair] = static_cast<std::uint32_t>(i);
    }
    result.approximations = std::move(approximations);
    result.table = std::move(table);
    return result;
}

const Approximation& ReferenceDistances::of_pair(std::uint32_t pair) const {
    return approximations.list[by_pair[pair]];
}

std::vector<double> ReferenceDistances::values_of(const OriginalRange& range,
                                                  std::size_t metric) const {
    std::vector<double> values;
    for (std::size_t i = range.begin; i < range.end; ++i) {
        values.push_back(table.metrics[metric].values[pairs[i]]);
    }
    return values;
}

PairColumns ReferenceDistances::columns() const {
    return {.first_metric = table.metrics[0].metric,
            .second_metric = table.metrics[1].metric,
            .first = table.metrics[0].values,
            .second = table.metrics[1].values,
            .names = [this](std::uint32_t pair) -> std::array<std::string_view, 2> {
                const auto& one = of_pair(pair);
                return {table.names[one.original], table.names[one.approximation]};
            }};
}

}  // namespace merl::scan
