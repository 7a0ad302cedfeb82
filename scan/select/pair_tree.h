#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "scan/pairs/pairs.h"
#include "scan/pairs/work.h"

namespace merl::scan {

/// Where the two distances of a pair are, or may be.
struct PairPlace {
    double least_first;
    double greatest_first;
    double least_second;
    double greatest_second;
};

/// Binary tree over the places of all pairs in the plane of (D1, D2), one pair a leaf, each node
/// with the bounding box of the pairs below it. Neighbours lie close to each other, so boxes are
/// small; how small affects only the speed of a search.
///
/// A node at depth d is its number from 2^d on, and has the leaves from floor(p P / 2^d) to before
/// floor((p+1) P / 2^d), p being its place at that depth: so no node needs to be stored. The boxes
/// of large ones are, and those of a few pairs are made when they are asked for.
class PairTree {
  public:
    struct Box {
        PairPlace place;
        std::uint32_t earliest;  ///< smallest pair index in the box
    };

    using PlaceOf = std::function<PairPlace(std::uint32_t pair)>;

    static constexpr std::uint32_t root = 1;

    /// Requires at least one pair. `place_of` is kept, and may be called on several threads at
    /// once. O(P log P) time on the threads of the caller's arena, up to 18 bytes a pair and,
    /// while it is made, 12 more.
    PairTree(std::uint32_t pairs, PlaceOf place_of, const Progress& progress = {});

    /// Of the pairs that were not dropped; without any, least is above greatest. O(1).
    Box box(std::uint32_t node) const;

    std::uint32_t leaves(std::uint32_t node) const;  ///< below, dropped ones included
    bool is_leaf(std::uint32_t node) const { return leaves(node) == 1; }

    /// Children of a node that is no leaf.
    static std::uint32_t left(std::uint32_t node) { return 2 * node; }
    static std::uint32_t right(std::uint32_t node) { return 2 * node + 1; }

    /// Takes a pair out: the boxes over it shrink. Dropping twice is harmless. O(log P).
    void drop(std::uint32_t pair);

  private:
    struct Item;

    /// Leaves, from left to right.
    struct Range {
        std::uint32_t begin;
        std::uint32_t end;
    };

    Range range(std::uint32_t node) const;
    void arrange(std::uint32_t node, std::vector<Item>& items, Work& work) const;
    void fill_boxes(Work& work);
    Box enclose_leaves(Range range) const;
    void enclose_children(std::uint32_t node);

    std::uint32_t pairs_;
    PlaceOf place_of_;
    std::vector<std::uint32_t> pair_at_leaf_;  ///< from left to right; `no_pair` for dropped ones
    std::vector<std::uint32_t> leaf_of_pair_;
    std::vector<Box> boxes_;  ///< of the nodes of as many levels as are stored; none for 0
};

}  // namespace merl::scan
