#include "engine/distance/parts/pair_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace merl::engine {
namespace {

void require_pairs(std::uint32_t materials, std::span<const MaterialPair> listed) {
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

PairList::PairList(std::uint32_t materials, std::span<const MaterialPair> listed)
    : starts_(std::size_t{materials} + 1) {
    require_pairs(materials, listed);
    const std::size_t all = materials < 2 ? 0 : std::size_t{materials} * (materials - 1) / 2;
    if (listed.size() < all) {
        listed_ = listed;
    }
    for (std::uint32_t first = 0; is_all() && first < materials; ++first) {
        starts_[first + 1] = materials - 1 - first;
    }
    for (const auto& pair : listed_) {
        ++starts_[pair.first + 1];
    }
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
}

PairList PairList::between(std::uint32_t rows, std::uint32_t columns) {
    if (rows == 0 || columns == 0) {
        throw std::invalid_argument(
            fmt::format("a rectangle of {} x {} pairs; expected one or more", rows, columns));
    }
    PairList result(rows + columns);
    result.rows_ = rows;
    for (std::uint32_t first = 0; first < result.materials(); ++first) {
        result.starts_[first + 1] = std::size_t{std::min(first + 1, rows)} * columns;
    }
    return result;
}

std::vector<std::uint32_t> PairList::paired() const {
    std::vector<bool> is_paired(materials());
    for (std::uint32_t first = 0; first < materials(); ++first) {
        is_paired[first] = is_all() || rows_ > 0 || begin_of(first) < end_of(first);
    }
    for (const auto& pair : listed_) {
        is_paired[pair.second] = true;
    }
    std::vector<std::uint32_t> result;
    for (std::uint32_t material = 0; material < materials(); ++material) {
        if (is_paired[material]) {
            result.push_back(material);
        }
    }
    return result;
}

std::vector<MaterialPair> PairList::covering() const {
    std::vector<bool> is_covered(materials());
    std::vector<MaterialPair> result;
    const auto take = [&](std::uint32_t first, std::uint32_t second) {
        result.emplace_back(first, second);
        is_covered[first] = true;
        is_covered[second] = true;
    };
    for (std::uint32_t first = 0; first < materials(); ++first) {  // two at a time, where it can be
        for (auto place = begin_of(first); !is_covered[first] && place < end_of(first); ++place) {
            if (const auto other = second(first, place); !is_covered[other]) {
                take(first, other);
            }
        }
    }
    each([&](std::size_t, std::uint32_t first, std::uint32_t second) {
        if (!is_covered[first] || !is_covered[second]) {
            take(first, second);
        }
    });
    return result;
}

}  // namespace merl::engine
