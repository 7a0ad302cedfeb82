#include "tests/scan/support.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <ostream>
#include <random>
#include <set>
#include <tuple>

namespace merl::scan {

void PrintTo(const Configuration& configuration, std::ostream* out) {
    *out << fmt::format("({}, {}, {})", configuration.left, configuration.right,
                        configuration.agreement);
}

namespace testing {
namespace {

using Random = std::mt19937_64;

/// Distances whose values come from two functions of nothing.
template <typename First, typename Second>
Distances fill(std::uint32_t materials, First first, Second second) {
    std::vector<double> d1(pair_count(materials));
    std::vector<double> d2(d1.size());
    for (std::size_t i = 0; i < d1.size(); ++i) {
        d1[i] = first();
        d2[i] = second();
    }
    return make_distances(std::move(d1), std::move(d2));
}

Distances without_ties(std::uint32_t materials, std::uint64_t seed) {
    Random random(seed);
    std::lognormal_distribution<double> value;
    const auto draw = [&] { return value(random); };
    return fill(materials, draw, draw);
}

Distances few_values(std::uint32_t materials, std::uint64_t seed) {
    Random random(seed);
    const auto draw = [&] { return static_cast<double>(random() % 4) / 2; };
    return fill(materials, draw, draw);
}

Distances copied_materials(std::uint32_t materials, std::uint64_t seed) {
    // Material m is a copy of m % kinds, so distances repeat in both metrics or are both zero.
    const std::uint32_t kinds = materials / 3 + 2;
    const Distances originals = without_ties(kinds, seed);
    std::vector<double> first;
    std::vector<double> second;
    for (std::uint32_t i = 0; i < materials; ++i) {
        for (std::uint32_t j = i + 1; j < materials; ++j) {
            const auto [low, high] = std::minmax({i % kinds, j % kinds});
            const std::uint32_t pair = low == high ? 0 : pair_index({low, high}, kinds);
            first.push_back(low == high ? 0 : originals.first[pair]);
            second.push_back(low == high ? 0 : originals.second[pair]);
        }
    }
    return make_distances(std::move(first), std::move(second));
}

Distances nearly_agreeing(std::uint32_t materials, std::uint64_t seed) {
    Random random(seed);
    std::uniform_real_distribution<double> value(1, 100);
    std::uniform_real_distribution<double> noise(0.999, 1.001);
    double last = 0;
    return fill(
        materials, [&] { return last = value(random); },
        [&] { return last * last * noise(random); });
}

Distances extreme_magnitudes(std::uint32_t materials, std::uint64_t seed) {
    Random random(seed);
    std::uniform_real_distribution<double> mantissa(0.5, 1);
    const auto draw = [&]() -> double {
        const auto exponent = static_cast<int>(random() % 2100) - 1076;
        return random() % 8 == 0 ? 0 : std::ldexp(mantissa(random), exponent);
    };
    return fill(materials, draw, draw);
}

int sign(double difference) {
    return (difference > 0) - (difference < 0);
}

double plain_agreement(double d1a, double d1b, double d2a, double d2b) {
    const double p = d1a * d2b;
    const double q = d1b * d2a;
    const bool ordinary = std::min(p, q) > 1e-150 && std::max(p, q) < 1e150;
    return ordinary ? std::min(p, q) / std::max(p, q) : agreement(d1a, d1b, d2a, d2b);
}

}  // namespace

Distances make_distances(std::vector<double> first, std::vector<double> second) {
    Distances distances;
    distances.first_metric = "one";
    distances.second_metric = "two";
    for (std::size_t i = 0; pair_count(i) < first.size() || i < 2; ++i) {
        distances.names.push_back(fmt::format("m{:05}", i));
    }
    distances.first = std::move(first);
    distances.second = std::move(second);
    return distances;
}

const std::vector<RandomCase>& random_cases() {
    static const std::vector<RandomCase> cases{{"without ties", without_ties},
                                               {"few values", few_values},
                                               {"copied materials", copied_materials},
                                               {"nearly agreeing", nearly_agreeing},
                                               {"extreme magnitudes", extreme_magnitudes}};
    return cases;
}

std::vector<Configuration> plain_disagreements(const Distances& distances) {
    using Key = std::tuple<double, std::uint32_t, std::uint32_t>;
    std::map<Key, Configuration> found;
    for (std::uint32_t a = 0; a < distances.pairs(); ++a) {
        for (std::uint32_t b = a + 1; b < distances.pairs(); ++b) {
            const double d1a = distances.first[a];
            const double d1b = distances.first[b];
            const double d2a = distances.second[a];
            const double d2b = distances.second[b];
            if (sign(d1a - d1b) == sign(d2a - d2b)) {
                continue;
            }
            const bool swap = d1a > d1b || d2a < d2b;
            const double value = plain_agreement(d1a, d1b, d2a, d2b);
            found[{value, a, b}] = {swap ? b : a, swap ? a : b, value};
        }
    }
    std::vector<Configuration> list;
    list.reserve(found.size());
    for (const auto& [key, configuration] : found) {
        list.push_back(configuration);
    }
    return list;
}

std::vector<Configuration> plain_selection(const Distances& distances,
                                           const std::vector<Configuration>& disagreements,
                                           std::uint32_t select, std::uint32_t per_material) {
    std::vector<Configuration> chosen;
    std::map<std::uint32_t, std::uint32_t> parts;
    for (const Configuration& configuration : disagreements) {
        std::set<std::uint32_t> involved;
        for (const std::uint32_t index : {configuration.left, configuration.right}) {
            const Pair pair = pair_at(index, distances.materials());
            involved.insert({pair.first, pair.second});
        }
        const bool free = std::ranges::all_of(
            involved, [&](std::uint32_t material) { return parts[material] < per_material; });
        if (free && chosen.size() < select) {
            chosen.push_back(configuration);
            for (const std::uint32_t material : involved) {
                ++parts[material];
            }
        }
    }
    return chosen;
}

void with_threads(int threads, const std::function<void()>& body) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
    tbb::task_arena(threads).execute(body);
}

}  // namespace testing
}  // namespace merl::scan
