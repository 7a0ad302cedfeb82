#include "scan/statistics/uniform_test.h"

#include <algorithm>
#include <cstddef>

namespace merl::scan {

UniformVotes::UniformVotes(std::uint32_t votes) : votes_(votes), tail_(1, 1.0) {
    // First the probability of every sum; all terms are positive, so rounding stays relative.
    for (std::uint32_t n = 0; n < votes; ++n) {
        std::vector<double> next(tail_.size() + 2);
        for (std::size_t s = 0; s < tail_.size(); ++s) {
            for (std::size_t vote = 0; vote < 3; ++vote) {
                next[s + vote] += tail_[s] / 3;
            }
        }
        tail_ = std::move(next);
    }
    // From the smallest on.
    for (std::size_t s = tail_.size() - 1; s-- > 0;) {
        tail_[s] += tail_[s + 1];
    }
    tail_[0] = 1;
}

double UniformVotes::at_least(std::uint64_t sum) const {
    return std::min(1.0, tail_.at(sum - votes_));
}

std::optional<std::uint32_t> fewest_judges(double alpha, std::uint64_t configurations,
                                           std::uint32_t equal) {
    for (std::uint32_t n = equal + 1; n <= max_judges; ++n) {
        const double p = UniformVotes(n).at_least(3 * std::uint64_t{n} - equal);
        if (p * static_cast<double>(configurations) <= alpha) {
            return n;
        }
    }
    return std::nullopt;
}

}  // namespace merl::scan
