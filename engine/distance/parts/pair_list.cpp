#include "engine/distance/parts/pair_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace merl::engine {
namespace {

void require_pairs(std::uint32_t materials, std::span<const MaterialPair> listed) {
    if (listed.empty()) {
        throw std::invalid_argument("a list of pairs has none; expected one or more");
    }
    for (const auto& [first, second] : listed) {
        if (first >= second || second >= materials) {
            throw std::invalid_argument(
                fmt::format("a list of pairs has ({}, {}); expected two of {} materials, the "
                            "earlier one first",
                            first, second, materials));
        }
    }
    const auto unordered = std::ranges::adjacent_find(listed, std::greater_equal());
    if (unordered != listed.end()) {
        throw std::invalid_argument(fmt::format(
            "a list of pairs has ({}, {}) before ({}, {}); expected them ascending, "
            "each once",
            unordered->first, unordered->second, unordered[1].first, unordered[1].second));
    }
}

}  // namespace

PairList::PairList(std::uint32_t materials) : starts_(std::size_t{materials} + 1) {
    for (std::uint32_t first = 0; first < materials; ++first) {
        starts_[first + 1] = starts_[first] + (materials - 1 - first);
    }
}

PairList::PairList(std::uint32_t materials, std::span<const MaterialPair> listed)
    : PairList(materials) {
    require_pairs(materials, listed);
    if (listed.size() == size()) {
        return;
    }
    listed_ = listed;
    std::ranges::fill(starts_, std::size_t{0});
    for (const auto& pair : listed) {
        ++starts_[pair.first + 1];
    }
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
}

}  // namespace merl::engine
