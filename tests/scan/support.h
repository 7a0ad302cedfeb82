#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <string_view>
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

/// A kit.json of two configurations, a repeat and a sentinel, without what may be missing.
inline constexpr std::string_view small_kit = R"({"kit_hash": "k", "seed": 1, "selection_hash": "h",
    "metrics": ["x", "y"], "more": [1], "trials": [
    {"configuration": 1, "kind": "selection", "left": ["b", "a"], "right": ["c", "d"]},
    {"configuration": 2, "kind": "selection", "left": ["a", "c"], "right": ["b", "d"]},
    {"configuration": 2, "kind": "repeat", "left": ["a", "c"], "right": ["b", "d"]},
    {"configuration": 3, "kind": "sentinel", "left": ["a", "d"], "right": ["b", "c"],
     "expected": 3, "agreement": 0.5}]})";

}  // namespace testing
}  // namespace merl::scan
