#include "scan/select/pair_tree.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace merl::scan {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t no_pair = std::numeric_limits<std::uint32_t>::max();

/// The smallest nodes whose boxes are stored have this many leaves or up to twice as many: fewer
/// take more memory, more take longer to look at.
constexpr std::uint32_t least_leaves = 8;

/// Nodes of fewer leaves are not worth a thread of their own.
constexpr std::uint32_t least_shared = 1U << 14U;

/// Agreement is a matter of ratios, so closeness is measured on logarithms. They only shape the
/// tree, so float will do, and for 0 anything below the logarithm of every positive double.
float log_distance(double least, double greatest) {
    const double middle = least + (greatest - least) / 2;
    return middle > 0 ? static_cast<float>(std::log(middle)) : -800.0F;
}

std::uint32_t depth_of(std::uint32_t node) {
    return static_cast<std::uint32_t>(std::bit_width(node)) - 1;
}

void enclose(PairTree::Box& box, const PairTree::Box& other) {
    auto& [place, earliest] = box;
    place.least_first = std::min(place.least_first, other.place.least_first);
    place.greatest_first = std::max(place.greatest_first, other.place.greatest_first);
    place.least_second = std::min(place.least_second, other.place.least_second);
    place.greatest_second = std::max(place.greatest_second, other.place.greatest_second);
    earliest = std::min(earliest, other.earliest);
}

}  // namespace

struct PairTree::Item {
    float first;
    float second;
    std::uint32_t pair;
};

PairTree::PairTree(std::uint32_t pairs, PlaceOf place_of, const Progress& progress)
    : pairs_(pairs), place_of_(std::move(place_of)) {
    const double levels = std::log2(static_cast<double>(pairs)) + 1;
    Work work(4 * levels * pairs, progress);
    std::vector<Item> items(pairs);
    in_parallel(pairs, work, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t pair = begin; pair < end; ++pair) {
            const PairPlace place = place_of_(pair);
            items[pair] = {log_distance(place.least_first, place.greatest_first),
                           log_distance(place.least_second, place.greatest_second), pair};
        }
    });
    arrange(root, items, work);
    pair_at_leaf_.resize(pairs);
    std::ranges::transform(items, pair_at_leaf_.begin(), &Item::pair);
    std::vector<Item>().swap(items);
    leaf_of_pair_.resize(pairs);
    in_parallel(pairs, work, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t leaf = begin; leaf < end; ++leaf) {
            leaf_of_pair_[pair_at_leaf_[leaf]] = leaf;
        }
    });
    fill_boxes(work);
}

PairTree::Range PairTree::range(std::uint32_t node) const {
    const std::uint32_t depth = depth_of(node);
    const std::uint64_t place = node - (std::uint64_t{1} << depth);
    return {static_cast<std::uint32_t>(place * pairs_ >> depth),
            static_cast<std::uint32_t>((place + 1) * pairs_ >> depth)};
}

std::uint32_t PairTree::leaves(std::uint32_t node) const {
    const auto [begin, end] = range(node);
    return end - begin;
}

/// Puts the items below a node in their places: halves along the longer side.
void PairTree::arrange(std::uint32_t node, std::vector<Item>& items, Work& work) const {
    const auto [begin, end] = range(node);
    if (end - begin == 1) {
        return;
    }
    auto [least_first, greatest_first] = std::pair(infinity, -infinity);
    auto [least_second, greatest_second] = std::pair(infinity, -infinity);
    for (std::uint32_t i = begin; i < end; ++i) {
        least_first = std::min<double>(least_first, items[i].first);
        greatest_first = std::max<double>(greatest_first, items[i].first);
        least_second = std::min<double>(least_second, items[i].second);
        greatest_second = std::max<double>(greatest_second, items[i].second);
    }
    const auto at = [&](std::uint32_t i) { return items.begin() + i; };
    const auto split = [&, first = at(begin), last = at(end)](float Item::*axis) {
        std::nth_element(first, at(range(right(node)).begin), last,
                         [&](const Item& x, const Item& y) {
                             work.add_one();
                             return x.*axis < y.*axis;
                         });
    };
    if (greatest_first - least_first >= greatest_second - least_second) {
        split(&Item::first);
    } else {
        split(&Item::second);
    }
    if (end - begin < least_shared) {
        arrange(left(node), items, work);
        arrange(right(node), items, work);
        return;
    }
    tbb::parallel_invoke([&] { arrange(left(node), items, work); },
                         [&] { arrange(right(node), items, work); });
}

void PairTree::fill_boxes(Work& work) {
    if (pairs_ < least_leaves) {
        return;
    }
    const std::uint32_t first = std::bit_floor(pairs_ / least_leaves);  // of the last stored level
    boxes_.resize(2 * std::size_t{first});
    in_parallel(first, work, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t node = first + begin; node < first + end; ++node) {
            boxes_[node] = enclose_leaves(range(node));
        }
    });
    for (std::uint32_t node = first; node-- > root;) {
        enclose_children(node);
    }
}

PairTree::Box PairTree::enclose_leaves(Range range) const {
    Box box = {{infinity, -infinity, infinity, -infinity}, no_pair};
    for (std::uint32_t leaf = range.begin; leaf < range.end; ++leaf) {
        if (const auto pair = pair_at_leaf_[leaf]; pair != no_pair) {
            enclose(box, {place_of_(pair), pair});
        }
    }
    return box;
}

PairTree::Box PairTree::box(std::uint32_t node) const {
    return node < boxes_.size() ? boxes_[node] : enclose_leaves(range(node));
}

void PairTree::enclose_children(std::uint32_t node) {
    boxes_[node] = boxes_[left(node)];
    enclose(boxes_[node], boxes_[right(node)]);
}

void PairTree::drop(std::uint32_t pair) {
    const std::uint64_t leaf = leaf_of_pair_[pair];
    pair_at_leaf_[leaf] = no_pair;
    if (boxes_.empty()) {
        return;
    }
    // The last node of its depth that begins no later.
    const auto first = static_cast<std::uint32_t>(boxes_.size() / 2);
    auto node = first + static_cast<std::uint32_t>(((leaf + 1) * first - 1) / pairs_);
    boxes_[node] = enclose_leaves(range(node));
    while ((node /= 2) >= root) {
        enclose_children(node);
    }
}

}  // namespace merl::scan
