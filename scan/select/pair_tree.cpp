#include "scan/select/pair_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace merl::scan {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Agreement is a matter of ratios, so closeness is measured on logarithms. They only shape the
/// tree, so float will do, and for 0 anything below the logarithm of every positive double.
float log_distance(double distance) {
    return distance > 0 ? static_cast<float>(std::log(distance)) : -800.0F;
}

}  // namespace

struct PairTree::Item {
    float first;
    float second;
    std::uint32_t pair;
};

PairTree::PairTree(const Distances& distances)
    : boxes_(2 * std::size_t{distances.pairs()} - 1), leaf_of_pair_(distances.pairs()) {
    std::vector<Item> items(distances.pairs());
    for (std::uint32_t pair = 0; pair < distances.pairs(); ++pair) {
        items[pair] = {log_distance(distances.first[pair]), log_distance(distances.second[pair]),
                       pair};
    }
    boxes_[root].leaves = distances.pairs();
    build(root, 0, items, distances);
}

void PairTree::build(std::uint32_t node, std::uint32_t begin, std::vector<Item>& items,
                     const Distances& distances) {
    const std::uint32_t leaves = boxes_[node].leaves;
    if (leaves == 1) {
        const std::uint32_t pair = items[begin].pair;
        const double first = distances.first[pair];
        const double second = distances.second[pair];
        boxes_[node] = {first, first, second, second, pair, 1};
        leaf_of_pair_[pair] = begin;
        return;
    }

    const auto range_begin = items.begin() + begin;
    const auto range_end = range_begin + leaves;
    const auto along = [](float Item::*axis) {
        return [axis](const Item& x, const Item& y) { return x.*axis < y.*axis; };
    };
    const auto spread = [&](float Item::*axis) {
        const auto [low, high] = std::minmax_element(range_begin, range_end, along(axis));
        return (*high).*axis - (*low).*axis;
    };
    const auto axis = spread(&Item::first) >= spread(&Item::second) ? &Item::first : &Item::second;
    const std::uint32_t left_leaves = leaves / 2;
    std::nth_element(range_begin, range_begin + left_leaves, range_end, along(axis));

    boxes_[left(node)].leaves = left_leaves;
    boxes_[right(node)].leaves = leaves - left_leaves;
    build(left(node), begin, items, distances);
    build(right(node), begin + left_leaves, items, distances);
    enclose_children(node);
}

void PairTree::enclose_children(std::uint32_t node) {
    const Box& l = boxes_[left(node)];
    const Box& r = boxes_[right(node)];
    boxes_[node] = {
        std::min(l.least_first, r.least_first),   std::max(l.greatest_first, r.greatest_first),
        std::min(l.least_second, r.least_second), std::max(l.greatest_second, r.greatest_second),
        std::min(l.earliest, r.earliest),         boxes_[node].leaves};
}

void PairTree::drop(std::uint32_t pair) {
    std::vector<std::uint32_t> path;
    std::uint32_t node = root;
    std::uint32_t leaf = leaf_of_pair_[pair];
    while (!is_leaf(node)) {
        path.push_back(node);
        const std::uint32_t left_leaves = boxes_[node].leaves / 2;
        if (leaf < left_leaves) {
            node = left(node);
        } else {
            leaf -= left_leaves;
            node = right(node);
        }
    }
    constexpr std::uint32_t no_pair = std::numeric_limits<std::uint32_t>::max();
    boxes_[node] = {infinity, -infinity, infinity, -infinity, no_pair, 1};
    for (; !path.empty(); path.pop_back()) {
        enclose_children(path.back());
    }
}

}  // namespace merl::scan
