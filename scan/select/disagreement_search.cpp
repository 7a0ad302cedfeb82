#include "scan/select/disagreement_search.h"

#include <algorithm>
#include <tuple>

namespace merl::scan {
namespace {

PairTree build_tree(const Distances& distances) {
    distances.validate();
    return PairTree(distances);
}

}  // namespace

bool DisagreementSearch::Candidate::operator>(const Candidate& other) const {
    return std::tie(agreement, earlier, later) >
           std::tie(other.agreement, other.earlier, other.later);
}

DisagreementSearch::DisagreementSearch(const Distances& distances) : tree_(build_tree(distances)) {
    push(PairTree::root, PairTree::root);
}

std::optional<DisagreementSearch::Candidate> DisagreementSearch::candidate(
    std::uint32_t left, std::uint32_t right) const {
    const PairTree::Box& l = tree_.box(left);
    const PairTree::Box& r = tree_.box(right);
    // A left pair has no larger first and no smaller second distance, and differs in one of them.
    // An empty box fails here as well.
    if (l.least_first > r.greatest_first || l.greatest_second < r.least_second) {
        return std::nullopt;
    }
    if (l.least_first == r.greatest_first && l.greatest_second == r.least_second) {
        return std::nullopt;
    }
    return Candidate{agreement(l.least_first, r.greatest_first, l.greatest_second, r.least_second),
                     std::min(l.earliest, r.earliest), std::max(l.earliest, r.earliest), left,
                     right};
}

void DisagreementSearch::push(std::uint32_t left, std::uint32_t right) {
    if (const auto found = candidate(left, right)) {
        candidates_.push(*found);
    }
}

std::optional<Configuration> DisagreementSearch::next() {
    while (!candidates_.empty()) {
        const Candidate best = candidates_.top();
        candidates_.pop();

        // Boxes may have shrunk since it was pushed.
        const auto now = candidate(best.left, best.right);
        if (!now) {
            continue;
        }
        if (*now > best) {
            candidates_.push(*now);
            continue;
        }

        const PairTree::Box& left = tree_.box(best.left);
        const PairTree::Box& right = tree_.box(best.right);
        if (left.leaves == 1 && right.leaves == 1) {
            return Configuration{left.earliest, right.earliest, best.agreement};
        }
        if (left.leaves >= right.leaves) {
            push(PairTree::left(best.left), best.right);
            push(tree_.right(best.left), best.right);
        } else {
            push(best.left, PairTree::left(best.right));
            push(best.left, tree_.right(best.right));
        }
    }
    return std::nullopt;
}

void DisagreementSearch::drop(std::uint32_t pair) {
    tree_.drop(pair);
}

}  // namespace merl::scan
