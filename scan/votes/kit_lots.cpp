#include "scan/votes/kit_lots.h"

#include <algorithm>
#include <numeric>

namespace merl::scan {

std::vector<std::uint32_t> places_in_order(const std::vector<double>& values) {
    std::vector<std::uint32_t> order(values.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return values[i]; });
    std::vector<std::uint32_t> ranks(values.size());
    for (std::uint32_t rank = 0; rank < order.size(); ++rank) {
        ranks[order[rank]] = rank;
    }
    return ranks;
}

std::vector<std::uint32_t> smallest(const std::vector<std::uint32_t>& keys, std::size_t count) {
    std::vector<std::uint32_t> indices(keys.size());
    std::iota(indices.begin(), indices.end(), 0U);
    std::ranges::stable_sort(indices, {}, [&](std::uint32_t i) { return keys[i]; });
    indices.resize(count);
    return indices;
}

std::vector<std::uint32_t> farness(const std::vector<std::uint32_t>& first,
                                   const std::vector<std::uint32_t>& second) {
    std::vector<std::uint32_t> keys(first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
        keys[i] = static_cast<std::uint32_t>(first.size()) - std::min(first[i], second[i]);
    }
    return keys;
}

}  // namespace merl::scan
