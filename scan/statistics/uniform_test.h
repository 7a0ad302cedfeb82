#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace merl::scan {

/// The test of Ryman 2018 (docs/experiment.md) for one configuration: under the null hypothesis
/// each of n votes is uniform over {1, 2, 3}, independently. The exact distribution of their sum,
/// by convolution. O(n^2).
class UniformVotes {
  public:
    explicit UniformVotes(std::uint32_t votes);

    std::uint32_t votes() const { return votes_; }

    /// The probability that the sum is at least `sum`, which is from n to 3n. The votes' mean times
    /// n is their sum, so this is the thesis' p-value for the second metric.
    double at_least(std::uint64_t sum) const;

    /// The probability that the sum is at most `sum`: the p-value for the first metric.
    double at_most(std::uint64_t sum) const { return at_least(4 * std::uint64_t{votes_} - sum); }

  private:
    std::uint32_t votes_;
    std::vector<double> tail_;  // by sum - n
};

/// The fewest judges with whom a configuration can be significant at `alpha` among `configurations`
/// tests with Holm's correction, when `equal` of the votes are "equal" and all others the same. The
/// smallest of the p-values has to be alpha / configurations or less. None below `max_judges`.
std::optional<std::uint32_t> fewest_judges(double alpha, std::uint64_t configurations,
                                           std::uint32_t equal);

/// More judges than any experiment has.
inline constexpr std::uint32_t max_judges = 1000;

}  // namespace merl::scan
