#pragma once

#include <cstdint>
#include <vector>

#include "scan/pairs/pairs.h"

namespace merl::scan {

/// Binary tree over the points (D1, D2) of all pairs, one pair a leaf, each node with the bounding
/// box of the pairs below it. Neighbours lie close to each other, so boxes are small; how small
/// affects only the speed of a search.
class PairTree {
  public:
    struct Box {
        double least_first;
        double greatest_first;
        double least_second;
        double greatest_second;
        std::uint32_t earliest;  ///< smallest pair index in the box
        std::uint32_t leaves;    ///< leaves below, dropped ones included
    };

    static constexpr std::uint32_t root = 0;

    /// Requires valid distances. O(P log P) time, 2P-1 nodes of 40 bytes.
    explicit PairTree(const Distances& distances);

    const Box& box(std::uint32_t node) const { return boxes_[node]; }
    bool is_leaf(std::uint32_t node) const { return boxes_[node].leaves == 1; }

    /// Children of a node that is no leaf. Nodes are in preorder, and m leaves make 2m-1 nodes.
    static std::uint32_t left(std::uint32_t node) { return node + 1; }
    std::uint32_t right(std::uint32_t node) const { return node + 2 * (boxes_[node].leaves / 2); }

    /// Takes a pair out: its leaf's box becomes empty (least above greatest) and the boxes over it
    /// shrink. Dropping twice is harmless. O(log P).
    void drop(std::uint32_t pair);

  private:
    struct Item;

    void build(std::uint32_t node, std::uint32_t begin, std::vector<Item>& items,
               const Distances& distances);
    void enclose_children(std::uint32_t node);

    std::vector<Box> boxes_;
    std::vector<std::uint32_t> leaf_of_pair_;  ///< number of the pair's leaf, from left to right
};

}  // namespace merl::scan
