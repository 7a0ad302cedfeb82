#include "scan/score/score.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "scan/statistics/clustered_figure.h"
#include "scan/statistics/sign_test.h"

namespace merl::scan {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Sums over judgements; votes count equal ones half for each side.
struct Sums {
    double untied = 0;
    double majorities = 0;  // predicted
    double votes = 0;
    double predicted = 0;  // votes
};

/// The figures of a metric, or of the best possible prediction.
struct Figures {
    ClusteredFigure majorities;
    ClusteredFigure votes;
    ClusteredFigure slope;
    ClusteredFigure log_likelihood;  // per vote
    double total_log_likelihood;
};

struct Halves {
    double left;
    double right;
};

/// An equal vote is half a vote for each side.
Halves halves(const Judgement& judgement) {
    const double half = static_cast<double>(judgement.votes_equal) / 2;
    return {static_cast<double>(judgement.votes_left) + half,
            static_cast<double>(judgement.votes_right) + half};
}

/// 1 where the metric takes the left pair for the more alike, 0 where the right one, 1/2 for a tie.
double prefers_left(const Judgement& judgement, std::span<const double> distances) {
    const double left = distances[judgement.left];
    const double right = distances[judgement.right];
    return left < right ? 1 : left > right ? 0 : 0.5;
}

/// 1 where the prediction is the majority, 1/2 where it is a tie. Requires an untied majority.
double is_right(const Judgement& judgement, double prefers_left) {
    return judgement.votes_left > judgement.votes_right ? prefers_left : 1 - prefers_left;
}

void add(Sums& sums, const Judgement& judgement, double prefers_left) {
    const auto [left, right] = halves(judgement);
    sums.votes += left + right;
    sums.predicted += prefers_left * left + (1 - prefers_left) * right;
    if (judgement.untied()) {
        sums.untied += 1;
        sums.majorities += is_right(judgement, prefers_left);
    }
}

/// Stands in for a distance of 0, whose logarithm is none: the smallest other distance.
double smallest_positive(std::span<const double> distances) {
    double smallest = infinity;
    for (const double distance : distances) {
        smallest = distance > 0 ? std::min(smallest, distance) : smallest;
    }
    return smallest;
}

double bound_of(const ScoredMetric& metric, const Judgement& judgement) {
    return metric.bounds.empty() ? 0
                                 : metric.bounds[judgement.left] + metric.bounds[judgement.right];
}

/// Whether the exact distances may be in another order than those that there are.
bool is_undecided(const ScoredMetric& metric, const Judgement& judgement) {
    const double bound = bound_of(metric, judgement);
    const double apart =
        std::abs(metric.distances[judgement.left] - metric.distances[judgement.right]);
    return bound > 0 && apart <= bound && !(metric.is_final && apart == 0);
}

Choice choice_of(const Judgement& judgement, std::span<const double> distances, double floor) {
    auto [with, against] = halves(judgement);
    const double left = std::max(distances[judgement.left], floor);
    const double right = std::max(distances[judgement.right], floor);
    if (left > right) {
        std::swap(with, against);
    }
    // Not the logarithm of the quotient, which can overflow; and exactly 0 for equal distances.
    const double ratio = left == right ? 0 : std::abs(std::log(left) - std::log(right));
    return {ratio, with, against};
}

/// x ln(x / n), with its limit at 0.
double log_term(double x, double n) {
    return x == 0 ? 0 : x * std::log(x / n);
}

/// In all figures but shares of majorities.
std::uint64_t votes_of(const Judgement& judgement) {
    return judgement.votes();
}

/// In shares of majorities, each of which counts the same.
std::uint64_t majorities_of(const Judgement& judgement) {
    return judgement.untied() ? 1 : 0;
}

/// Why there is no interval where a few clusters have nearly all the weight: what a figure that is
/// theirs alone leaves of them says nothing of how far off it is.
std::string too_few_effective(double clusters, const char* things) {
    return clusters < fewest_effective_clusters
               ? fmt::format("effective number of {}: {:.2f}; expected {} or more", things,
                             clusters, fewest_effective_clusters)
               : "";
}

/// What materials take part in, and how much.
struct Participants {
    explicit Participants(std::uint32_t materials) : sizes(materials) {}

    std::uint32_t count() const {
        return static_cast<std::uint32_t>(
            std::ranges::count_if(sizes, [](auto size) { return size > 0; }));
    }

    std::vector<std::uint64_t> sizes;  // the weights of each material's judgements
};

/// The clusters of a figure in which judgements have these weights; those without one take no part.
template <typename Weight>
ScoreClusters clusters_of(const Judgements& judgements, const Weight& weight_of) {
    Participants all(judgements.materials);
    Participants references(judgements.materials);
    Participants alternatives(judgements.materials);
    std::vector<std::uint64_t> without_reference;
    ScoreClusters result{};
    for (const auto& judgement : judgements.list) {
        const std::uint64_t weight = weight_of(judgement);
        if (weight == 0) {
            continue;
        }
        const auto materials = materials_of(judgement, judgements.materials);
        for (const auto material : materials.all()) {
            all.sizes[material] += weight;
        }
        for (const auto material : materials.all().subspan(materials.has_reference ? 1 : 0)) {
            alternatives.sizes[material] += weight;
        }
        if (materials.has_reference) {
            references.sizes[materials.list[0]] += weight;
        } else {
            without_reference.push_back(weight);
        }
    }
    result.without_reference = without_reference.size();
    result.materials = all.count();
    result.references = references.count();
    result.alternatives = alternatives.count();
    references.sizes.insert(references.sizes.end(), without_reference.begin(),
                            without_reference.end());
    const double effective_references = effective_clusters(references.sizes);
    const double effective_alternatives = effective_clusters(alternatives.sizes);
    result.effective = std::min(effective_references, effective_alternatives);
    for (const auto& reason :
         {too_few(result.materials, "materials", fewest_score_materials),
          too_few(result.references + result.without_reference,
                  "references and configurations without one"),
          too_few(result.alternatives, "materials compared with references"),
          too_few_effective(effective_references, "references"),
          too_few_effective(effective_alternatives, "materials compared with references")}) {
        if (result.too_few.empty()) {
            result.too_few = reason;
        }
    }
    return result;
}

/// Adds the influences of judgements on the four figures up by material. `prefers_left` says for
/// each which pair is predicted, `log_likelihood` what its votes are worth and `slope` its
/// influence on the slope.
template <typename Prefers, typename LogLikelihood, typename Slope>
Figures figures_of(const Judgements& judgements, double slope, const Prefers& prefers_left,
                   const LogLikelihood& log_likelihood, const Slope& slope_influence) {
    Sums sums;
    double total = 0;
    for (std::size_t k = 0; k < judgements.list.size(); ++k) {
        add(sums, judgements.list[k], prefers_left(k));
        total += log_likelihood(k);
    }
    const auto none = std::vector<double>(judgements.materials);
    // 0 / 0 is not a number, and says so: no vote or no untied majority.
    Figures figures{{sums.majorities / sums.untied, none},
                    {sums.predicted / sums.votes, none},
                    {slope, none},
                    {total / sums.votes, none},
                    total};
    for (std::size_t k = 0; k < judgements.list.size(); ++k) {
        const auto& judgement = judgements.list[k];
        Sums own;
        add(own, judgement, prefers_left(k));
        const double majorities =
            own.untied == 0 ? 0 : (own.majorities - figures.majorities.value) / sums.untied;
        const double votes = (own.predicted - figures.votes.value * own.votes) / sums.votes;
        const double likelihood =
            (log_likelihood(k) - figures.log_likelihood.value * own.votes) / sums.votes;
        const double of_slope = slope_influence(k);
        const auto materials = materials_of(judgement, judgements.materials);
        for (const auto material : materials.all()) {
            figures.majorities.influences[material] += majorities;
            figures.votes.influences[material] += votes;
            figures.slope.influences[material] += of_slope;
            figures.log_likelihood.influences[material] += likelihood;
        }
    }
    return figures;
}

/// The slope moves by a judgement's gradient over the curvature of all; the likelihood at its
/// maximum does not move with the slope, to first order. Calls `fitted` halfway.
Figures figures_of(const Judgements& judgements, const ScoredMetric& metric,
                   const std::function<void()>& fitted) {
    const auto choices = choices_of(judgements.list, metric.distances);
    const double slope = fit_choice_model(choices).slope;
    fitted();
    const bool moves = std::isfinite(slope);
    double curvature = 0;
    for (const auto& choice : choices) {
        curvature += moves ? derivatives(choice, slope).curvature : 0;
    }
    return figures_of(
        judgements, slope,
        [&](std::size_t k) { return prefers_left(judgements.list[k], metric.distances); },
        [&](std::size_t k) { return log_likelihood(choices[k], slope); },
        [&](std::size_t k) {
            return curvature > 0 ? derivatives(choices[k], slope).gradient / curvature : 0;
        });
}

/// Of the prediction that is always with the majority and knows the share of each answer. It has no
/// slope.
Figures best_figures(const Judgements& judgements) {
    return figures_of(
        judgements, 0,
        [&](std::size_t k) {
            const auto [left, right] = halves(judgements.list[k]);
            return left >= right ? 1.0 : 0.0;
        },
        [&](std::size_t k) {
            const auto [left, right] = halves(judgements.list[k]);
            return log_term(left, left + right) + log_term(right, left + right);
        },
        [](std::size_t) { return 0.0; });
}

/// With an interval within what the figure can be.
Estimate estimate(const ClusteredFigure& figure, const ScoreClusters& clusters, double least,
                  double most) {
    return within(least, estimated(figure, clusters.effective, clusters.too_few), most);
}

MetricScore metric_score(const Judgements& judgements, const ScoredMetric& metric,
                         const Figures& figures, const ScoreClusters& all,
                         const ScoreClusters& untied) {
    MetricScore result{.name = metric.name,
                       .majorities = estimate(figures.majorities, untied, 0, 1),
                       .votes = estimate(figures.votes, all, 0, 1),
                       .slope = estimate(figures.slope, all, -infinity, infinity),
                       .log_likelihood = estimate(figures.log_likelihood, all, -infinity, 0),
                       .total_log_likelihood = figures.total_log_likelihood,
                       .ties = 0,
                       .undecided = 0,
                       .zero_distances = 0};
    for (const auto& judgement : judgements.list) {
        const double left = metric.distances[judgement.left];
        const double right = metric.distances[judgement.right];
        result.ties += left == right ? 1 : 0;
        result.zero_distances += (left == 0) != (right == 0) ? 1 : 0;
        result.undecided += is_undecided(metric, judgement) ? 1 : 0;
    }
    return result;
}

/// Counts who predicts untied majorities better.
void count_right(const Judgements& judgements, std::span<const ScoredMetric> metrics,
                 PairScore& pair) {
    for (const auto& judgement : judgements.list) {
        if (!judgement.untied()) {
            continue;
        }
        const double first =
            is_right(judgement, prefers_left(judgement, metrics[pair.first].distances));
        const double second =
            is_right(judgement, prefers_left(judgement, metrics[pair.second].distances));
        pair.first_right += first > second ? 1 : 0;
        pair.second_right += second > first ? 1 : 0;
    }
}

std::vector<PairScore> pair_scores(const Judgements& judgements,
                                   std::span<const ScoredMetric> metrics,
                                   std::span<const Figures> figures, const ScoreClusters& untied) {
    std::vector<PairScore> pairs;
    std::vector<double> p_values;
    for (std::uint32_t first = 0; first < metrics.size(); ++first) {
        for (std::uint32_t second = first + 1; second < metrics.size(); ++second) {
            // Of the same judgements: the interval is that of paired data.
            const auto of_both = difference(figures[first].majorities, figures[second].majorities);
            pairs.push_back({.first = first,
                             .second = second,
                             .first_right = 0,
                             .second_right = 0,
                             .difference = estimate(of_both, untied, -1, 1),
                             .p_holm = p_of_zero(of_both, untied.effective, untied.too_few)});
            // Pairs that cannot be told apart are tests like others.
            p_values.push_back(std::isnan(pairs.back().p_holm) ? 1 : pairs.back().p_holm);
        }
    }
    const auto adjusted = holm(p_values);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        pairs[i].p_holm = std::isnan(pairs[i].p_holm) ? pairs[i].p_holm : adjusted[i];
    }
    tbb::parallel_for(std::size_t{0}, pairs.size(),
                      [&](std::size_t i) { count_right(judgements, metrics, pairs[i]); });
    return pairs;
}

}  // namespace

std::vector<std::uint32_t> open_pairs(const Judgements& judgements, const ScoredMetric& metric) {
    std::vector<std::uint32_t> pairs;
    for (const auto& judgement : judgements.list) {
        if (is_undecided(metric, judgement) && std::isfinite(bound_of(metric, judgement))) {
            for (const std::uint32_t pair : {judgement.left, judgement.right}) {
                if (metric.bounds[pair] > 0) {
                    pairs.push_back(pair);
                }
            }
        }
    }
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

Score score(const Judgements& judgements, std::span<const ScoredMetric> metrics,
            const std::function<void(double share)>& progress) {
    Score result{};
    result.judgements = judgements.list.size();
    for (const auto& judgement : judgements.list) {
        result.untied += judgement.untied() ? 1 : 0;
        result.votes += judgement.votes();
        result.equal_votes += judgement.votes_equal;
    }
    result.clusters = clusters_of(judgements, votes_of);
    const auto untied = clusters_of(judgements, majorities_of);
    const Figures best = best_figures(judgements);
    result.ceiling = estimate(best.votes, result.clusters, 0, 1);
    result.ceiling_log_likelihood = estimate(best.log_likelihood, result.clusters, -infinity, 0);

    std::vector<Figures> figures;
    const auto done = [&](double metrics_done) {
        if (progress) {
            progress(metrics_done / static_cast<double>(metrics.size()));
        }
    };
    for (const auto& metric : metrics) {
        const auto before = static_cast<double>(figures.size());
        figures.push_back(figures_of(judgements, metric, [&] { done(before + 0.5); }));
        result.metrics.push_back(
            metric_score(judgements, metric, figures.back(), result.clusters, untied));
        done(before + 1);
    }
    result.pairs = pair_scores(judgements, metrics, figures, untied);
    return result;
}

std::vector<Choice> choices_of(std::span<const Judgement> judgements,
                               std::span<const double> distances) {
    const double floor = smallest_positive(distances);
    std::vector<Choice> choices;
    choices.reserve(judgements.size());
    for (const auto& judgement : judgements) {
        choices.push_back(choice_of(judgement, distances, floor));
    }
    return choices;
}

std::vector<Prediction> predictions(std::span<const Judgement> judgements,
                                    std::span<const double> distances, double slope) {
    const double own_slope = std::max(slope, 0.0);
    const auto choices = choices_of(judgements, distances);
    std::vector<Prediction> result;
    result.reserve(judgements.size());
    for (std::size_t k = 0; k < judgements.size(); ++k) {
        result.push_back(
            {prefers_left(judgements[k], distances), log_likelihood(choices[k], own_slope)});
    }
    return result;
}

PredictionScores score_predictions(const Judgements& judgements, std::span<const Prediction> first,
                                   std::span<const Prediction> second) {
    PredictionScores result{};
    for (const auto& judgement : judgements.list) {
        result.untied += judgement.untied() ? 1 : 0;
        result.votes += judgement.votes();
    }
    result.judgements = judgements.list.size();
    result.clusters = clusters_of(judgements, votes_of);
    const auto untied = clusters_of(judgements, majorities_of);
    const auto figures = [&](std::span<const Prediction> predicted) {
        return figures_of(
            judgements, 0, [&](std::size_t k) { return predicted[k].prefers_left; },
            [&](std::size_t k) { return predicted[k].log_likelihood; },
            [](std::size_t) { return 0.0; });
    };
    const auto scored = [&](const Figures& of, double least, double most, double most_likelihood) {
        return PredictionScore{
            estimate(of.majorities, untied, least, most),
            estimate(of.votes, result.clusters, least, most),
            estimate(of.log_likelihood, result.clusters, -infinity, most_likelihood)};
    };
    const Figures of_first = figures(first);
    const Figures of_second = figures(second);
    result.first = scored(of_first, 0, 1, 0);
    result.second = scored(of_second, 0, 1, 0);
    result.gain =
        scored({.majorities = difference(of_second.majorities, of_first.majorities),
                .votes = difference(of_second.votes, of_first.votes),
                .slope = {},
                .log_likelihood = difference(of_second.log_likelihood, of_first.log_likelihood),
                .total_log_likelihood = 0},
               -1, 1, infinity);
    return result;
}

void limit_to_own_order(Score& score) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const double chance = std::log(0.5);
    for (auto& metric : score.metrics) {
        if (metric.is_chance()) {
            metric.log_likelihood = {chance, {none, none}, "the slope is below 0: that of chance"};
            metric.total_log_likelihood = chance * static_cast<double>(score.votes);
        }
    }
}

std::vector<std::size_t> best_first(const Score& score) {
    std::vector<std::size_t> order(score.metrics.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto share = [&](std::size_t metric) {
        const double value = score.metrics[metric].majorities.value;
        return std::isnan(value) ? -1 : value;
    };
    std::ranges::stable_sort(order, std::ranges::greater(), share);
    return order;
}

}  // namespace merl::scan
