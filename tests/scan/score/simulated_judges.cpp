#include "tests/scan/score/simulated_judges.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <boost/random/uniform_01.hpp>
#include <boost/random/uniform_int_distribution.hpp>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "scan/pairs/pairs.h"
#include "scan/statistics/choice_model.h"
#include "scan/statistics/clustered_figure.h"

namespace merl::scan::testing {
namespace {

/// The standard library's distributions differ from one library to the next.
using Random = boost::random::mt19937_64;

constexpr std::uint32_t kVotes = 4;
constexpr std::size_t kPooled = 8'000'000;  // choices, for expectations that have no formula

std::vector<double> normal(Random& random, std::size_t count, double deviation) {
    boost::random::normal_distribution<double> distribution;
    std::vector<double> values(count);
    for (auto& value : values) {
        value = deviation * distribution(random);
    }
    return values;
}

/// What people see and what two metrics measure: logarithms of distances of one population of
/// materials, to which each metric adds errors of pairs and of materials.
struct World {
    World(const SimulatedStudy& study, const SimulatedEffects& effects, Random& random)
        : materials(study.materials) {
        const auto seen = normal(random, pair_count(materials), 0.7);
        for (auto& metric : distances) {
            metric = normal(random, pair_count(materials), 0.5);
            const auto errors = normal(random, materials, effects.alternatives);
            for (std::uint32_t p = 0; p < metric.size(); ++p) {
                const auto [a, b] = pair_at(p, materials);
                metric[p] += seen[p] + errors[a] + errors[b];
            }
        }
        follows = normal(random, materials, effects.references);
        surely = normal(random, materials, effects.references);
        taste = normal(random, materials, effects.alternatives);
        difficulty = normal(random, materials, effects.difficulty);
    }

    /// Probability of the left pair. A vote follows a mixture of both metrics.
    double left(const NamedVotes& row) const {
        const auto log_ratio = [&](const std::vector<double>& metric) {
            return metric[pair_of(row.right_1, row.right_2)] -
                   metric[pair_of(row.left_1, row.left_2)];
        };
        const double first = 0.5 + (follows[row.left_1] + follows[row.right_1]) / 2;
        double utility = (1 + (surely[row.left_1] + surely[row.right_1]) / 2) *
                         (first * log_ratio(distances[0]) + (1 - first) * log_ratio(distances[1]));
        utility += taste[row.right_2] - taste[row.left_2];
        double factor =
            1 + difficulty[row.left_1] + difficulty[row.left_2] + difficulty[row.right_2];
        if (row.left_1 != row.right_1) {
            utility += taste[row.right_1] - taste[row.left_1];
            factor += difficulty[row.right_1];
        }
        return 1 / (1 + std::exp(-1.2 * factor * utility));
    }

    std::uint32_t pair_of(std::uint32_t a, std::uint32_t b) const {
        const auto [first, second] = std::minmax(a, b);
        return pair_index({first, second}, materials);
    }

    std::uint32_t materials;
    std::array<std::vector<double>, 2> distances;  // logarithms
    std::vector<double> follows;
    std::vector<double> surely;
    std::vector<double> taste;
    std::vector<double> difficulty;
};

NamedVotes configuration(const SimulatedStudy& study, std::uint32_t number, Random& random) {
    boost::random::uniform_int_distribution<std::uint32_t> any(0, study.materials - 1);
    std::array<std::uint32_t, 4> list{};
    const bool shared = study.references > 0;
    std::set<std::uint32_t> taken;
    if (shared) {
        taken.insert(list[0] = number % study.references);
    }
    for (std::size_t i = shared ? 1 : 0; i < (shared ? 3 : 4); ++i) {
        do {
            list[i] = any(random);
        } while (!taken.insert(list[i]).second);
    }
    return shared ? NamedVotes{list[0], list[1], list[0], list[2], 0, 0, 0}
                  : NamedVotes{list[0], list[1], list[2], list[3], 0, 0, 0};
}

JudgementFile judge(const SimulatedStudy& study, const World& world, Random& random) {
    JudgementFile file{"simulated", "configuration CSV", {}, {}};
    for (std::uint32_t m = 0; m < study.materials; ++m) {
        file.names.push_back(fmt::format("m{:05}", m));
    }
    boost::random::uniform_01<double> uniform;
    std::set<std::pair<std::uint32_t, std::uint32_t>> judged;
    while (file.rows.size() < study.configurations) {
        auto row = configuration(study, static_cast<std::uint32_t>(file.rows.size()), random);
        if (!judged
                 .insert(std::minmax(world.pair_of(row.left_1, row.left_2),
                                     world.pair_of(row.right_1, row.right_2)))
                 .second) {
            continue;
        }
        const double left = world.left(row);
        for (std::uint32_t vote = 0; vote < kVotes; ++vote) {
            ++(uniform(random) < left ? row.votes_left : row.votes_right);
        }
        file.rows.push_back(row);
    }
    return file;
}

/// Influences on the share of majorities that the first metric predicts, by judgement.
std::vector<double> influences_of(const Judgements& judgements, double share,
                                  const std::vector<double>& distances) {
    const auto untied = std::ranges::count_if(judgements.list, &Judgement::untied);
    std::vector<double> influences;
    for (const auto& judgement : judgements.list) {
        const bool left = distances[judgement.left] < distances[judgement.right];
        const bool right = left == (judgement.votes_left > judgement.votes_right);
        influences.push_back(
            judgement.untied() ? ((right ? 1 : 0) - share) / static_cast<double>(untied) : 0);
    }
    return influences;
}

/// With references as the only clusters.
Interval by_reference(const Judgements& judgements, double share,
                      const std::vector<double>& influences) {
    ClusteredFigure figure{share, std::vector<double>(judgements.materials)};
    std::set<std::uint32_t> references;
    for (std::size_t k = 0; k < influences.size(); ++k) {
        const auto reference = materials_of(judgements.list[k], judgements.materials).list[0];
        references.insert(reference);
        figure.influences[reference] += influences[k];
    }
    return estimated(figure, static_cast<double>(references.size())).interval;
}

/// With the variance that counts each pair of judgements that share a material once: sums by one
/// material, less those by two, plus those by three, less those by four (Cameron, Gelbach and
/// Miller 2011). Not a number where that is negative.
Interval pairs_once(const Judgements& judgements, double share,
                    const std::vector<double>& influences) {
    struct Sum {
        double sum = 0;
        double sign = 1;
    };
    std::map<std::uint64_t, Sum> sums;  // by set of materials
    for (std::size_t k = 0; k < influences.size(); ++k) {
        const auto materials = materials_of(judgements.list[k], judgements.materials);
        const auto all = materials.all();
        std::vector<std::uint64_t> sorted(all.begin(), all.end());
        std::ranges::sort(sorted);
        for (unsigned subset = 1; subset < 1U << sorted.size(); ++subset) {
            std::uint64_t key = 0;
            double sign = -1;
            for (std::size_t i = 0; i < sorted.size(); ++i) {
                if ((subset >> i & 1U) != 0) {
                    key = key << 16U | (sorted[i] + 1);
                    sign = -sign;
                }
            }
            sums[key].sum += influences[k];
            sums[key].sign = sign;
        }
    }
    double variance = 0;
    for (const auto& [key, sum] : sums) {
        variance += sum.sign * sum.sum * sum.sum;
    }
    const double count = judgements.materials;
    const boost::math::students_t_distribution<double> t(count - 1);
    const double half = boost::math::quantile(t, 0.975) * std::sqrt(count / (count - 1) * variance);
    return {share - half, share + half};
}

bool covers(const Interval& interval, double value) {
    return interval.low <= value && value <= interval.high;
}

}  // namespace

SimulatedCoverage simulated_coverage(const SimulatedStudy& study, const SimulatedEffects& effects,
                                     std::uint32_t studies) {
    std::array<std::vector<Estimate>, kSimulatedFigures.size()> estimates;
    std::vector<Interval> of_references;
    std::vector<Interval> of_pairs;
    double surprising = 0;
    std::vector<Choice> pooled;
    for (std::uint32_t i = 0; i < studies; ++i) {
        Random random(i);
        const World world(study, effects, random);
        const auto file = judge(study, world, random);
        const auto judgements = resolve_judgements(file, file.names);
        auto distances = world.distances;
        std::vector<ScoredMetric> metrics;
        for (auto& metric : distances) {
            for (auto& distance : metric) {
                distance = std::exp(distance);
            }
            metrics.push_back({"metric", metric});
        }
        const auto scored = score(judgements, metrics);
        const auto& metric = scored.metrics[0];
        const std::array figures = {metric.majorities, metric.votes,
                                    metric.slope,      metric.log_likelihood,
                                    scored.ceiling,    scored.pairs[0].difference};
        for (std::size_t f = 0; f < figures.size(); ++f) {
            estimates[f].push_back(figures[f]);
        }
        const double share = metric.majorities.value;
        const auto influences = influences_of(judgements, share, world.distances[0]);
        of_references.push_back(by_reference(judgements, share, influences));
        of_pairs.push_back(pairs_once(judgements, share, influences));
        surprising += scored.pairs[0].p_holm < 0.001 ? 1.0 / studies : 0;
        for (const auto& judgement : judgements.list) {
            if (pooled.size() < kPooled) {
                const double x =
                    world.distances[0][judgement.right] - world.distances[0][judgement.left];
                auto with = static_cast<double>(judgement.votes_left);
                auto against = static_cast<double>(judgement.votes_right);
                pooled.push_back({std::abs(x), x > 0 ? with : against, x > 0 ? against : with});
            }
        }
    }
    // The expectation is the mean of the studies; for what is fitted, the fit to all of them.
    std::array<double, kSimulatedFigures.size()> means{};
    for (std::size_t f = 0; f < means.size(); ++f) {
        for (const auto& estimate : estimates[f]) {
            means[f] += estimate.value / studies;
        }
    }
    auto expected = means;
    const auto model = fit_choice_model(pooled);
    expected[2] = model.slope;
    expected[3] = model.log_likelihood / (kVotes * static_cast<double>(pooled.size()));
    expected[5] = 0;
    SimulatedCoverage result{};
    for (std::size_t f = 0; f < estimates.size(); ++f) {
        double covered = 0;
        double width = 0;
        double variance = 0;
        for (const auto& [value, interval, reason] : estimates[f]) {
            covered += covers(interval, expected[f]) ? 1 : 0;
            width += (interval.high - interval.low) / studies;
            variance += (value - means[f]) * (value - means[f]) / (studies - 1);
        }
        result.figures[f] = {covered / studies, width / (2 * 1.959964 * std::sqrt(variance))};
    }
    for (std::uint32_t i = 0; i < studies; ++i) {
        result.by_reference += covers(of_references[i], expected[0]) ? 1.0 / studies : 0;
        result.pairs_once += covers(of_pairs[i], expected[0]) ? 1.0 / studies : 0;
    }
    result.surprising = surprising;
    return result;
}

}  // namespace merl::scan::testing
