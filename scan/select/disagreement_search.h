#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <queue>
#include <vector>

#include "scan/pairs/agreement.h"
#include "scan/pairs/pairs.h"
#include "scan/select/pair_tree.h"

namespace merl::scan {

/// Yields the disagreements one by one in the order of StrongerFirst, without listing them all.
///
/// Best-first branch and bound over two boxes of a PairTree at a time, one for the left pair and
/// one for the right. The agreement of their two corners farthest apart is the least that a
/// configuration between them can have (see `agreement`, which is monotone, rounding included), and
/// for two leaves it is the configuration's own: no tolerance is needed and the order is exactly
/// that of a full sort. Boxes that no disagreement joins are never opened, so metrics that nearly
/// agree, where most pairs far apart in D1/D2 are ordered alike by both, cost little.
///
/// Of distances that are known within bounds it yields what may be a disagreement, in the order of
/// the least agreements that are possible.
///
/// Memory: the tree, and 24 bytes for every two boxes opened but not done with.
class DisagreementSearch {
  public:
    /// Of distances as they are; their bounds do not matter. What holds them must outlive the
    /// search. O(P log P). `progress` follows the making of the tree, and is called while
    /// disagreements are looked for, too. Throws std::invalid_argument for bad distances.
    explicit DisagreementSearch(const DistancesView& distances, Progress progress = {});

    /// Of distances anywhere within the places of their pairs. Ends of places must be finite and
    /// not negative.
    DisagreementSearch(std::uint32_t pairs, PairTree::PlaceOf place_of, Progress progress = {});

    /// The next disagreement, or none when all have been yielded. Of one that is not decided the
    /// agreement is the least that is possible, and it may come once with either pair on the left.
    std::optional<Configuration> next();

    /// Yield no more configurations with this pair. O(log P).
    void drop(std::uint32_t pair);

  private:
    /// A left and a right node, with a lower bound of their configurations in StrongerFirst's
    /// order.
    struct Candidate {
        double agreement;
        std::uint32_t earlier;
        std::uint32_t later;
        std::uint32_t left;
        std::uint32_t right;
        bool operator>(const Candidate& other) const;
    };

    std::optional<Candidate> candidate(std::uint32_t left, std::uint32_t right) const;
    void push(std::uint32_t left, std::uint32_t right);

    Progress progress_;
    PairTree tree_;
    Work opening_;
    bool any_dropped_ = false;
    std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> candidates_;
};

}  // namespace merl::scan
