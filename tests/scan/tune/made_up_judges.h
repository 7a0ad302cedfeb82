#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "scan/pairs/pairs.h"
#include "scan/score/judgements.h"
#include "scan/tune/fit.h"

namespace merl::scan::testing {

/// Materials with two features, of which people see the second `weight` times as well as the first:
/// the distance is the root of dx^2 + (weight dy)^2.
struct MadeUpMaterials {
    explicit MadeUpMaterials(std::uint32_t count, std::uint64_t seed = 1) : materials(count) {
        std::mt19937_64 random(seed);
        for (std::uint32_t m = 0; m < count; ++m) {
            for (auto* feature : {&x, &y}) {
                feature->push_back(static_cast<double>(random() >> 11U) * 0x1p-53);
            }
        }
    }

    double distance(std::uint32_t a, std::uint32_t b, double weight) const {
        return std::hypot(x[a] - x[b], weight * (y[a] - y[b]));
    }

    std::vector<double> distances(double weight) const {
        std::vector<double> result;
        for (std::uint32_t a = 0; a < materials; ++a) {
            for (std::uint32_t b = a + 1; b < materials; ++b) {
                result.push_back(distance(a, b, weight));
            }
        }
        return result;
    }

    /// Every third pair of alternatives of each reference, each with the votes of `votes` judges,
    /// as many for a side as the choice model expects; so the likelihood is greatest at this weight
    /// and slope, but for rounding.
    Judgements judged(double weight, double slope, std::uint64_t votes) const {
        JudgementFile file{"votes", "reference CSV", {}, {}};
        for (std::uint32_t m = 0; m < materials; ++m) {
            file.names.push_back(std::to_string(1000 + m));
        }
        std::uint32_t k = 0;
        for (std::uint32_t r = 0; r < materials; ++r) {
            for (std::uint32_t a = 0; a < materials; ++a) {
                for (std::uint32_t b = a + 1; b < materials; ++b) {
                    if (a != r && b != r && k++ % 3 == 0) {
                        const double ratio = distance(r, a, weight) / distance(r, b, weight);
                        const double p = 1 / (1 + std::pow(ratio, slope));
                        const auto left = static_cast<std::uint64_t>(
                            std::llround(p * static_cast<double>(votes)));
                        file.rows.push_back({r, a, r, b, left, 0, votes - left});
                    }
                }
            }
        }
        return resolve_judgements(file, file.names);
    }

    DistancesAt distances_at() const {
        return [this](std::span<const double> values) { return distances(values[0]); };
    }

    std::uint32_t materials;
    std::vector<double> x = {};
    std::vector<double> y = {};
};

}  // namespace merl::scan::testing
