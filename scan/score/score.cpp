#include "scan/score/score.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "scan/statistics/choice_model.h"
#include "scan/statistics/sign_test.h"

namespace merl::scan {
namespace {

/// Sums over the judgements of one cluster, or over all; votes count equal ones half for each side.
struct Sums {
    double untied = 0;
    double majorities = 0;  // predicted
    double votes = 0;
    double predicted = 0;  // votes
};

/// What the bootstrap needs of one metric, or of the best possible prediction.
struct Prediction {
    std::size_t judgements;
    std::vector<Sums> clusters;
    std::vector<std::vector<Choice>> choices;  // per cluster; none for the best prediction
    std::vector<double> log_likelihoods;       // per cluster, of the best prediction alone
};

/// The figures of one bootstrap sample, or of the judgements as they are.
struct Figures {
    double majorities;
    double votes;
    double slope;
    double log_likelihood;  // all votes together
    double log_likelihood_per_vote;
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
    double smallest = std::numeric_limits<double>::infinity();
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

Prediction predict(const Judgements& judgements, const ScoredMetric& metric) {
    Prediction prediction{
        .judgements = judgements.list.size(), .clusters = {}, .choices = {}, .log_likelihoods = {}};
    prediction.clusters.resize(judgements.clusters);
    prediction.choices.resize(judgements.clusters);
    const double floor = smallest_positive(metric.distances);
    for (const auto& judgement : judgements.list) {
        add(prediction.clusters[judgement.cluster], judgement,
            prefers_left(judgement, metric.distances));
        prediction.choices[judgement.cluster].push_back(
            choice_of(judgement, metric.distances, floor));
    }
    return prediction;
}

/// x ln(x / n), with its limit at 0.
double log_term(double x, double n) {
    return x == 0 ? 0 : x * std::log(x / n);
}

/// The prediction that is always with the majority and knows the share of each answer.
Prediction predict_best(const Judgements& judgements) {
    Prediction prediction{
        .judgements = judgements.list.size(), .clusters = {}, .choices = {}, .log_likelihoods = {}};
    prediction.clusters.resize(judgements.clusters);
    prediction.log_likelihoods.resize(judgements.clusters);
    for (const auto& judgement : judgements.list) {
        const auto [left, right] = halves(judgement);
        add(prediction.clusters[judgement.cluster], judgement, left >= right ? 1 : 0);
        prediction.log_likelihoods[judgement.cluster] +=
            log_term(left, left + right) + log_term(right, left + right);
    }
    return prediction;
}

/// The figures where cluster i counts times[i] times; `start` is a guess of the slope.
Figures figures_of(const Prediction& prediction, std::span<const std::uint32_t> times,
                   double start) {
    Sums total;
    std::vector<WeightedChoices> data;
    double log_likelihood = 0;
    for (std::size_t cluster = 0; cluster < times.size(); ++cluster) {
        if (times[cluster] == 0) {
            continue;
        }
        const double weight = times[cluster];
        const Sums& sums = prediction.clusters[cluster];
        total.untied += weight * sums.untied;
        total.majorities += weight * sums.majorities;
        total.votes += weight * sums.votes;
        total.predicted += weight * sums.predicted;
        if (prediction.choices.empty()) {
            log_likelihood += weight * prediction.log_likelihoods[cluster];
        } else {
            data.push_back({prediction.choices[cluster], weight});
        }
    }
    ChoiceModel model{0, log_likelihood};
    if (!prediction.choices.empty()) {
        model = fit_choice_model(data, start);
    }
    // 0 / 0 is not a number, and says so: a sample without a vote or an untied majority.
    return {total.majorities / total.untied, total.predicted / total.votes, model.slope,
            model.log_likelihood, model.log_likelihood / total.votes};
}

/// The figures of the judgements as they are and of every bootstrap sample.
struct Sampled {
    Figures actual;
    std::vector<Figures> samples;
    std::string too_few;  // why there are none

    Estimate estimate(double Figures::*figure) const {
        std::vector<double> values;
        values.reserve(samples.size());
        for (const auto& sample : samples) {
            values.push_back(sample.*figure);
        }
        return bootstrapped(actual.*figure, values, too_few);
    }
};

Sampled sample(const Prediction& prediction, const BootstrapOptions& options,
               const std::function<void(double share)>& progress) {
    const auto clusters = static_cast<std::uint32_t>(prediction.clusters.size());
    Sampled result;
    result.actual = figures_of(prediction, std::vector<std::uint32_t>(clusters, 1), 0);
    result.too_few = too_few(clusters, "clusters");
    result.samples.resize(result.too_few.empty() ? options.replicates : 0);
    // Tenths of a second between interrupts, however many judgements there are.
    const std::size_t at_a_time =
        std::max(std::min<std::size_t>(2'000'000 / prediction.judgements, 64),
                 static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()));
    for (std::size_t begin = 0; begin < result.samples.size(); begin += at_a_time) {
        const std::size_t end = std::min(begin + at_a_time, result.samples.size());
        tbb::parallel_for(begin, end, [&](std::size_t i) {
            const auto times = resample(options.seed, static_cast<std::uint32_t>(i), clusters);
            result.samples[i] = figures_of(prediction, times, result.actual.slope);
        });
        progress(static_cast<double>(end) / static_cast<double>(result.samples.size()));
    }
    return result;
}

MetricScore metric_score(const Judgements& judgements, const ScoredMetric& metric,
                         const Sampled& sampled) {
    MetricScore result{.name = metric.name,
                       .majorities = sampled.estimate(&Figures::majorities),
                       .votes = sampled.estimate(&Figures::votes),
                       .slope = sampled.estimate(&Figures::slope),
                       .log_likelihood = sampled.estimate(&Figures::log_likelihood_per_vote),
                       .total_log_likelihood = sampled.actual.log_likelihood,
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

PairScore pair_score(const Judgements& judgements, std::span<const ScoredMetric> metrics,
                     std::span<const Sampled> sampled, std::uint32_t first, std::uint32_t second) {
    PairScore result{.first = first,
                     .second = second,
                     .first_right = 0,
                     .second_right = 0,
                     .p_value = 1,
                     .p_holm = 1,
                     .difference = {}};
    for (const auto& judgement : judgements.list) {
        if (!judgement.untied()) {
            continue;
        }
        const double right_1 =
            is_right(judgement, prefers_left(judgement, metrics[first].distances));
        const double right_2 =
            is_right(judgement, prefers_left(judgement, metrics[second].distances));
        result.first_right += right_1 > right_2 ? 1 : 0;
        result.second_right += right_2 > right_1 ? 1 : 0;
    }
    const std::string& reason = sampled[first].too_few;
    if (!reason.empty()) {
        result.p_value = std::numeric_limits<double>::quiet_NaN();
        result.p_holm = result.p_value;
    } else {
        result.p_value = sign_test(result.first_right, result.second_right);
    }
    // Both metrics see the same samples: the interval is that of paired data.
    std::vector<double> differences;
    for (std::size_t i = 0; i < sampled[first].samples.size(); ++i) {
        differences.push_back(sampled[first].samples[i].majorities -
                              sampled[second].samples[i].majorities);
    }
    result.difference = bootstrapped(
        sampled[first].actual.majorities - sampled[second].actual.majorities, differences, reason);
    return result;
}

std::vector<PairScore> pair_scores(const Judgements& judgements,
                                   std::span<const ScoredMetric> metrics,
                                   std::span<const Sampled> sampled) {
    std::vector<PairScore> pairs;
    for (std::uint32_t first = 0; first < metrics.size(); ++first) {
        for (std::uint32_t second = first + 1; second < metrics.size(); ++second) {
            PairScore pair{};
            pair.first = first;
            pair.second = second;
            pairs.push_back(pair);
        }
    }
    tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t i) {
        pairs[i] = pair_score(judgements, metrics, sampled, pairs[i].first, pairs[i].second);
    });
    std::vector<double> p_values;
    p_values.reserve(pairs.size());
    for (const auto& pair : pairs) {
        p_values.push_back(pair.p_value);
    }
    if (pairs.empty() || !sampled[0].too_few.empty()) {
        return pairs;
    }
    const auto adjusted = holm(p_values);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        pairs[i].p_holm = adjusted[i];
    }
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
            const BootstrapOptions& options, const std::function<void(double share)>& progress) {
    Score result{};
    result.judgements = judgements.list.size();
    for (const auto& judgement : judgements.list) {
        result.untied += judgement.untied() ? 1 : 0;
        result.votes += judgement.votes();
        result.equal_votes += judgement.votes_equal;
    }
    // The best prediction is one part of the work, and each metric is one.
    std::size_t done = 0;
    const auto sampled_part = [&](const Prediction& prediction) {
        auto part = sample(prediction, options, [&](double share) {
            if (progress) {
                progress((static_cast<double>(done) + share) /
                         static_cast<double>(metrics.size() + 1));
            }
        });
        ++done;
        return part;
    };
    const Sampled best = sampled_part(predict_best(judgements));
    result.too_few = best.too_few;
    result.ceiling = best.estimate(&Figures::votes);
    result.ceiling_log_likelihood = best.estimate(&Figures::log_likelihood_per_vote);

    std::vector<Sampled> sampled;
    for (const auto& metric : metrics) {
        sampled.push_back(sampled_part(predict(judgements, metric)));
        result.metrics.push_back(metric_score(judgements, metric, sampled.back()));
    }
    result.pairs = pair_scores(judgements, metrics, sampled);
    return result;
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
