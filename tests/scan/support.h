#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "scan/pairs/agreement.h"
#include "scan/pairs/pairs.h"

namespace merl::scan {

/// Shows a configuration in full where a test fails.
void PrintTo(const Configuration& configuration, std::ostream* out);

namespace testing {

/// Distances of as many materials as `first` has pairs for, named m00000, m00001 ...
Distances make_distances(std::vector<double> first, std::vector<double> second);

/// Random data by name of what is difficult about it.
struct RandomCase {
    std::string name;
    std::function<Distances(std::uint32_t materials, std::uint64_t seed)> make;
};

/// No ties; few values and many zeros; exact copies of materials; metrics that nearly agree;
/// magnitudes from the smallest to the largest double.
const std::vector<RandomCase>& random_cases();

/// All disagreements in order, the slow and plain way: docs/numerics.md word by word.
std::vector<Configuration> plain_disagreements(const Distances& distances);

/// The selection (docs/file-formats.md) from a list in order, word by word.
std::vector<Configuration> plain_selection(const Distances& distances,
                                           const std::vector<Configuration>& disagreements,
                                           std::uint32_t select, std::uint32_t per_material);

/// Calls `body` with `threads` threads at its disposal.
void with_threads(int threads, const std::function<void()>& body);

}  // namespace testing
}  // namespace merl::scan
