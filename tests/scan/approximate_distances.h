#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/scan/support.h"

namespace merl::scan::testing {

using Random = std::mt19937_64;

/// Clusters of distances that differ by nothing, a unit in the last place, 1e-12 or 1e-7.
inline Distances near_ties(std::uint32_t materials, std::uint64_t seed) {
    Random random(seed);
    std::uniform_real_distribution<double> value(1, 2);
    const auto draw = [&](std::vector<double>& values) {
        for (std::uint64_t i = 0; i < pair_count(materials); ++i) {
            const bool near = !values.empty() && random() % 3 > 0;
            const double base = near ? values[random() % values.size()] : value(random);
            constexpr std::array steps{0.0, 2.3e-16, 1e-12, 1e-7};
            values.push_back(base * (1 + steps[near ? random() % steps.size() : 0]));
        }
    };
    std::vector<double> first;
    std::vector<double> second;
    draw(first);
    draw(second);
    return make_distances(std::move(first), std::move(second));
}

inline std::vector<RandomCase> cases_with_near_ties() {
    auto all = random_cases();
    all.push_back({"near ties", near_ties});
    return all;
}

/// How an approximation errs: the bound of a value.
struct Errors {
    std::string name;
    std::function<double(double value, Random&)> bound;
};

inline double mixed_bound(double value, Random& random) {
    switch (random() % 6) {
        case 0:
            return 0;
        case 1:
            return value;
        case 2:
            return random() % 8 == 0 ? std::numeric_limits<double>::infinity() : value / 100;
        default:
            return std::ldexp(value, -static_cast<int>(random() % 60));
    }
}

inline const std::vector<Errors>& errors() {
    static const std::vector<Errors> all{
        {"none", [](double, Random&) { return 0.0; }},
        {"relative", [](double value, Random&) { return 3e-7 * value; }},
        {"tiny", [](double value, Random&) { return 1e-15 * value; }},
        {"wide", [](double value, Random&) { return 0.02 * value; }},
        {"absolute", [](double, Random&) { return 1e-5; }},
        {"anything", mixed_bound}};
    return all;
}

/// Distances within the bounds from exact ones, often at their ends.
inline Distances approximate(const Distances& exact, const Errors& errors, Random& random) {
    std::uniform_real_distribution<double> share(-1.5, 1.5);
    const auto perturb = [&](std::vector<double>& values, std::vector<double>& bounds) {
        for (double& value : values) {
            const double true_value = value;
            double bound = errors.bound(value, random);
            if (bound > 0) {
                const double shift = std::clamp(share(random), -1.0, 1.0) * std::min(bound, 1e300);
                value = std::clamp(value + shift, 0.0, std::numeric_limits<double>::max());
                if (value != true_value) {
                    const double moved = std::abs(value - true_value);
                    bound = std::max(
                        bound, std::nextafter(moved, std::numeric_limits<double>::infinity()));
                }
            }
            bounds.push_back(bound);
        }
    };
    Distances result = exact;
    perturb(result.first, result.first_bounds);
    perturb(result.second, result.second_bounds);
    return result;
}

}  // namespace merl::scan::testing
