#include "scan/select/disagreement_search.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace merl::scan {
namespace {

/// The share of the work that making the tree is; how many boxes are opened is not known.
constexpr double of_tree = 0.9;

PairTree::PlaceOf places_of(const DistancesView& distances) {
    distances.validate();
    return [first = distances.first, second = distances.second](std::uint32_t pair) {
        return PairPlace{first[pair], first[pair], second[pair], second[pair]};
    };
}

}  // namespace

bool DisagreementSearch::Candidate::operator>(const Candidate& other) const {
    return std::tie(agreement, earlier, later) >
           std::tie(other.agreement, other.earlier, other.later);
}

DisagreementSearch::DisagreementSearch(const DistancesView& distances, Progress progress)
    : DisagreementSearch(distances.pairs(), places_of(distances), std::move(progress)) {}

DisagreementSearch::DisagreementSearch(std::uint32_t pairs, PairTree::PlaceOf place_of,
                                       Progress progress)
    : progress_(part_of(std::move(progress), 0, of_tree)),
      tree_(pairs, std::move(place_of), progress_),
      opening_(1, progress_) {
    push(PairTree::root, PairTree::root);
}

std::optional<DisagreementSearch::Candidate> DisagreementSearch::candidate(
    std::uint32_t left, std::uint32_t right) const {
    if (left == right && tree_.is_leaf(left)) {
        return std::nullopt;  // a pair with itself, wherever in its place it is
    }
    const auto [l, l_earliest] = tree_.box(left);
    const auto [r, r_earliest] = tree_.box(right);
    // A left pair has no larger first and no smaller second distance, and differs in one of them.
    // An empty box fails here as well.
    if (l.least_first > r.greatest_first || l.greatest_second < r.least_second) {
        return std::nullopt;
    }
    if (l.least_first == r.greatest_first && l.greatest_second == r.least_second) {
        return std::nullopt;
    }
    return Candidate{agreement(l.least_first, r.greatest_first, l.greatest_second, r.least_second),
                     std::min(l_earliest, r_earliest), std::max(l_earliest, r_earliest), left,
                     right};
}

void DisagreementSearch::push(std::uint32_t left, std::uint32_t right) {
    if (const auto found = candidate(left, right)) {
        candidates_.push(*found);
    }
}

std::optional<Configuration> DisagreementSearch::next() {
    while (!candidates_.empty()) {
        opening_.add_one();
        const Candidate best = candidates_.top();
        candidates_.pop();

        if (any_dropped_) {  // boxes may have shrunk since it was pushed
            const auto now = candidate(best.left, best.right);
            if (!now) {
                continue;
            }
            if (*now > best) {
                candidates_.push(*now);
                continue;
            }
        }

        const std::uint32_t left_leaves = tree_.leaves(best.left);
        const std::uint32_t right_leaves = tree_.leaves(best.right);
        if (left_leaves == 1 && right_leaves == 1) {
            return Configuration{tree_.box(best.left).earliest, tree_.box(best.right).earliest,
                                 best.agreement};
        }
        if (left_leaves >= right_leaves) {
            push(PairTree::left(best.left), best.right);
            push(PairTree::right(best.left), best.right);
        } else {
            push(best.left, PairTree::left(best.right));
            push(best.left, PairTree::right(best.right));
        }
    }
    return std::nullopt;
}

void DisagreementSearch::drop(std::uint32_t pair) {
    any_dropped_ = true;
    tree_.drop(pair);
}

}  // namespace merl::scan
