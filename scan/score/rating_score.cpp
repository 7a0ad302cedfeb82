#include "scan/score/rating_score.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "scan/score/score.h"
#include "scan/statistics/clustered_figure.h"
#include "scan/statistics/rank_correlation.h"
#include "scan/statistics/sign_test.h"

namespace merl::scan {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

/// Of fewer approximations what holds among them says little of others.
constexpr std::size_t fewest_names = 3;

/// Approximations as figures see them: places of those with the same original follow each other.
struct Rated {
    std::vector<std::uint32_t> original;  // of each, numbered from 0 without gaps
    std::vector<double> worse;            // ratings, turned so that the larger is the worse
    std::uint32_t originals = 0;
};

/// Those that have a prediction, with predictions that are the larger the worse.
struct Predicted {
    Rated rated;
    std::vector<double> worse;
};

/// The figures before there are intervals.
struct Figures {
    ClusteredFigure spearman;
    ClusteredFigure kendall;
    ClusteredFigure pairs;
    ClusteredFigure pairs_apart;
    std::uint64_t ties = 0;
};

/// What the clusters of figures are.
struct Clusters {
    RatingClusters all;
    RatingClusters pairs;
    RatingClusters pairs_apart;
    std::uint64_t equal_pairs = 0;
    std::uint64_t single_originals = 0;
};

/// Whether ratings differ by more than the amount. As decimals: 0.4 and 0.3 differ by 0.1.
bool are_apart(double first, double second, double amount) {
    constexpr double rounding = 1e-9;
    return std::abs(first - second) > amount * (1 + rounding);
}

/// Calls `visit` with the places of every two approximations of one original.
template <typename Visit>
void for_each_pair(const Rated& rated, const Visit& visit) {
    for (std::size_t begin = 0; begin < rated.original.size();) {
        std::size_t end = begin;
        while (end < rated.original.size() && rated.original[end] == rated.original[begin]) {
            ++end;
        }
        for (std::size_t i = begin; i < end; ++i) {
            for (std::size_t j = i + 1; j < end; ++j) {
                visit(i, j);
            }
        }
        begin = end;
    }
}

/// The approximations of which `worse` has a number.
Predicted predicted(const Ratings& ratings, std::span<const double> worse) {
    Predicted result;
    auto& rated = result.rated;
    std::optional<std::uint32_t> last;
    for (std::size_t i = 0; i < ratings.list.size(); ++i) {
        if (std::isnan(worse[i])) {
            continue;
        }
        rated.originals += last == ratings.list[i].original ? 0 : 1;
        last = ratings.list[i].original;
        rated.original.push_back(rated.originals - 1);
        const double rating = ratings.list[i].rating;
        rated.worse.push_back(ratings.higher_is_better ? 0 - rating : rating);
        result.worse.push_back(worse[i]);
    }
    return result;
}

RatingClusters clusters_of(const std::vector<std::uint64_t>& sizes, const char* originals) {
    RatingClusters result;
    for (const auto size : sizes) {
        result.observations += size;
        result.originals += size > 0 ? 1 : 0;
    }
    result.effective = effective_clusters(sizes);
    result.too_few = too_few(result.originals, originals);
    if (result.too_few.empty() && result.effective < fewest_effective_clusters) {
        result.too_few = fmt::format("effective number of {}: {:.2f}; expected {} or more",
                                     originals, result.effective, fewest_effective_clusters);
    }
    return result;
}

Clusters clusters_of(const Rated& rated, double apart) {
    std::vector<std::uint64_t> all(rated.originals);
    std::vector<std::uint64_t> pairs(rated.originals);
    std::vector<std::uint64_t> pairs_apart(rated.originals);
    Clusters result;
    for (const auto original : rated.original) {
        ++all[original];
    }
    for_each_pair(rated, [&](std::size_t i, std::size_t j) {
        const bool differ = rated.worse[i] != rated.worse[j];
        result.equal_pairs += differ ? 0 : 1;
        pairs[rated.original[i]] += differ ? 1 : 0;
        pairs_apart[rated.original[i]] += are_apart(rated.worse[i], rated.worse[j], apart) ? 1 : 0;
    });
    result.single_originals = static_cast<std::uint64_t>(std::ranges::count(all, 1U));
    result.all = clusters_of(all, "originals");
    result.pairs = clusters_of(pairs, "originals with approximations that are rated differently");
    result.pairs_apart = clusters_of(pairs_apart, "originals with approximations that are apart");
    return result;
}

ClusteredFigure by_original(const RankCorrelation& correlation, const Rated& rated) {
    ClusteredFigure figure{correlation.value, std::vector<double>(rated.originals)};
    for (std::size_t i = 0; i < rated.original.size(); ++i) {
        figure.influences[rated.original[i]] += correlation.influences[i];
    }
    return figure;
}

/// The share of pairs in people's order, of sums by original.
struct Share {
    explicit Share(std::uint32_t originals) : right(originals), pairs(originals) {}

    ClusteredFigure figure() const {
        const double all = std::accumulate(pairs.begin(), pairs.end(), 0.0);
        ClusteredFigure result{std::accumulate(right.begin(), right.end(), 0.0) / all,
                               std::vector<double>(pairs.size())};
        for (std::size_t o = 0; o < pairs.size(); ++o) {
            result.influences[o] = (right[o] - result.value * pairs[o]) / all;
        }
        return result;
    }

    std::vector<double> right;
    std::vector<double> pairs;
};

/// A tie of what predicts is half in people's order.
Figures figures_of(const Predicted& predicted, double apart) {
    const auto& rated = predicted.rated;
    Share pairs(rated.originals);
    Share pairs_apart(rated.originals);
    std::uint64_t ties = 0;
    for_each_pair(rated, [&](std::size_t i, std::size_t j) {
        const double people = rated.worse[i] - rated.worse[j];
        const double says = predicted.worse[i] - predicted.worse[j];
        if (people == 0) {
            return;
        }
        const auto original = rated.original[i];
        const double right = says == 0 ? 0.5 : (says < 0) == (people < 0) ? 1 : 0;
        ties += says == 0 ? 1 : 0;
        pairs.right[original] += right;
        pairs.pairs[original] += 1;
        if (are_apart(rated.worse[i], rated.worse[j], apart)) {
            pairs_apart.right[original] += right;
            pairs_apart.pairs[original] += 1;
        }
    });
    return {by_original(spearman(predicted.worse, rated.worse), rated),
            by_original(kendall(predicted.worse, rated.worse), rated), pairs.figure(),
            pairs_apart.figure(), ties};
}

Estimate estimate(const ClusteredFigure& figure, const RatingClusters& clusters, double least) {
    return within(least, estimated(figure, clusters.effective, clusters.too_few), 1);
}

RatingFigures estimates(const Figures& figures, const Clusters& clusters) {
    return {estimate(figures.spearman, clusters.all, -1),
            estimate(figures.kendall, clusters.all, -1), estimate(figures.pairs, clusters.pairs, 0),
            estimate(figures.pairs_apart, clusters.pairs_apart, 0)};
}

/// The mean rating of each approximation's name with other originals, turned as ratings are.
std::vector<double> predictions_of_names(const Ratings& ratings) {
    std::vector<double> result(ratings.list.size(), none);
    std::vector<std::vector<std::size_t>> of_name(ratings.names.size());
    for (std::size_t i = 0; i < ratings.list.size(); ++i) {
        of_name[ratings.list[i].name].push_back(i);
    }
    for (const auto& places : of_name) {
        // Sums from either end: taking one's own from that of all would leave its roundings.
        std::vector<double> before(places.size() + 1);
        std::vector<double> after(places.size() + 1);
        for (std::size_t i = 0; i < places.size(); ++i) {
            const auto j = places.size() - 1 - i;
            before[i + 1] = before[i] + ratings.list[places[i]].rating;
            after[j] = after[j + 1] + ratings.list[places[j]].rating;
        }
        for (std::size_t begin = 0; begin < places.size();) {
            std::size_t end = begin;
            while (end < places.size() &&
                   ratings.list[places[end]].original == ratings.list[places[begin]].original) {
                ++end;
            }
            const auto others = places.size() - (end - begin);
            const double sum = before[begin] + after[end];
            for (; begin < end; ++begin) {
                if (others > 0) {
                    result[places[begin]] = decimal_mean(sum, others);
                }
            }
        }
    }
    return result;
}

/// The score, and what it is made of if every approximation has a prediction.
struct ScoredNames {
    std::optional<NameScore> score;
    std::optional<Figures> figures;
};

ScoredNames score_names(const Ratings& ratings, double apart) {
    NameScore result{.predicted = predictions_of_names(ratings),
                     .approximations = 0,
                     .originals = 0,
                     .figures = {}};
    auto worse = result.predicted;
    if (ratings.higher_is_better) {
        std::ranges::transform(worse, worse.begin(), [](double rating) { return 0 - rating; });
    }
    const auto known = predicted(ratings, worse);
    if (known.worse.empty()) {
        return {};
    }
    result.approximations = known.worse.size();
    result.originals = known.rated.originals;
    auto figures = figures_of(known, apart);
    // The better an approximation is, the worse is the mean of the others of its name: over all
    // originals the order within a name is reversed, which is no fault of names.
    figures.spearman.value = none;
    figures.kendall.value = none;
    result.figures = estimates(figures, clusters_of(known.rated, apart));
    const bool is_complete = known.worse.size() == ratings.list.size();
    return {std::move(result), is_complete ? std::optional(figures) : std::nullopt};
}

FigureDifference difference_of(const ClusteredFigure& first, const ClusteredFigure& second,
                               const RatingClusters& clusters, double most) {
    const auto figure = difference(first, second);
    return {within(-most, estimated(figure, clusters.effective, clusters.too_few), most),
            p_of_zero(figure, clusters.effective, clusters.too_few)};
}

/// Adjusts the p-values of one figure for all rows that can have it.
void adjust(std::span<RatingDifference> differences, FigureDifference RatingDifference::*figure) {
    std::vector<double> p_values;
    p_values.reserve(differences.size());
    for (const auto& row : differences) {
        // What cannot be told apart is a test like others.
        p_values.push_back(std::isnan((row.*figure).p_holm) ? 1 : (row.*figure).p_holm);
    }
    const auto adjusted = holm(p_values);
    for (std::size_t i = 0; i < differences.size(); ++i) {
        double& p = (differences[i].*figure).p_holm;
        p = std::isnan(p) ? p : adjusted[i];
    }
}

/// Every two metrics, and each with the name alone if that predicts everything.
std::vector<RatingDifference> differences_of(std::span<const Figures> metrics,
                                             const std::optional<Figures>& name_alone,
                                             const Clusters& clusters) {
    std::vector<RatingDifference> result;
    const auto add = [&](std::uint32_t first, std::optional<std::uint32_t> second) {
        const auto& a = metrics[first];
        const auto& b = second ? metrics[*second] : *name_alone;
        result.push_back({first, second, difference_of(a.spearman, b.spearman, clusters.all, 2),
                          difference_of(a.pairs, b.pairs, clusters.pairs, 1),
                          difference_of(a.pairs_apart, b.pairs_apart, clusters.pairs_apart, 1)});
    };
    for (std::uint32_t first = 0; first < metrics.size(); ++first) {
        for (std::uint32_t second = first + 1; second < metrics.size(); ++second) {
            add(first, second);
        }
    }
    const std::size_t of_metrics = result.size();
    for (std::uint32_t first = 0; name_alone && first < metrics.size(); ++first) {
        add(first, std::nullopt);
    }
    adjust(std::span(result).first(of_metrics), &RatingDifference::spearman);  // names have none
    adjust(result, &RatingDifference::pairs);
    adjust(result, &RatingDifference::pairs_apart);
    return result;
}

/// A tenth of what ratings can be or, if that is not stated, of what they are.
double tenth_of_scale(const Ratings& ratings) {
    const auto [least, most] = std::ranges::minmax_element(
        ratings.list, {}, [](const auto& rated) { return rated.rating; });
    const auto scale = ratings.scale.value_or(RatingScale{least->rating, most->rating});
    return (scale.high - scale.low) / 10;
}

std::vector<std::string> doubts_of(const Ratings& ratings, const RatingScore& score) {
    std::vector<std::string> doubts;
    if (!score.all.too_few.empty()) {
        doubts.push_back("there are no intervals: " + score.all.too_few);
    } else if (!score.pairs.too_few.empty()) {
        doubts.push_back("shares of pairs have no intervals: " + score.pairs.too_few);
    }
    if (score.single_originals > 0) {
        doubts.push_back(
            fmt::format("{} of {} originals have one rated approximation: they take part in "
                        "correlations, and in no share of pairs",
                        score.single_originals, score.all.originals));
    }
    if (ratings.names.size() < fewest_names) {
        doubts.push_back(
            fmt::format("there are {} approximations an original at most: a metric "
                        "that is right of these need not be right of others",
                        ratings.names.size()));
    }
    const auto beats_names = [](const RatingDifference& row) {
        return !row.second && row.pairs.estimate.interval.low > 0;
    };
    if (score.name_alone && score.name_alone->approximations == ratings.list.size() &&
        std::ranges::none_of(score.differences, beats_names)) {
        doubts.emplace_back(
            "no metric is clearly better than the name of the approximation alone, which says "
            "nothing of the original");
    }
    return doubts;
}

/// Distances that are equal, and how far off the exact ones can be.
struct Group {
    double value;
    double bound;                        // the largest
    std::vector<std::uint32_t> inexact;  // places of those with a bound
    std::size_t size;
};

std::vector<Group> groups_of(const MetricColumn& column) {
    std::vector<std::uint32_t> order(column.values.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::sort(order, {}, [&](std::uint32_t i) { return column.values[i]; });
    std::vector<Group> groups;
    for (const auto i : order) {
        if (groups.empty() || groups.back().value != column.values[i]) {
            groups.push_back({column.values[i], 0, {}, 0});
        }
        auto& group = groups.back();
        ++group.size;
        group.bound = std::max(group.bound, column.bounds[i]);
        if (column.bounds[i] > 0) {
            group.inexact.push_back(i);
        }
    }
    return groups;
}

}  // namespace

std::size_t place_of(const ListedDistances& table, const RatedApproximation& rated) {
    const auto place = table.place_of(rated.pair());
    if (!place) {
        throw std::invalid_argument("found a rated approximation without a distance");
    }
    return *place;
}

std::vector<std::uint32_t> open_places(const MetricColumn& column) {
    if (column.bounds.empty()) {
        return {};
    }
    auto groups = groups_of(column);
    std::vector<std::uint32_t> places;
    std::ranges::sort(groups, {}, [](const Group& g) { return g.value - g.bound; });
    double highest = -std::numeric_limits<double>::infinity();  // that one before can be
    for (std::size_t g = 0; g < groups.size(); ++g) {
        const auto& group = groups[g];
        const bool meets_before = group.value - group.bound <= highest;
        const bool meets_next =
            g + 1 < groups.size() &&
            groups[g + 1].value - groups[g + 1].bound <= group.value + group.bound;
        const bool may_not_tie = !column.is_final && group.size > 1;
        if (meets_before || meets_next || may_not_tie) {
            places.insert(places.end(), group.inexact.begin(), group.inexact.end());
        }
        highest = std::max(highest, group.value + group.bound);
    }
    std::ranges::sort(places);
    return places;
}

RatingScore score_ratings(const Ratings& ratings, const ListedDistances& table,
                          std::optional<double> apart,
                          const std::function<void(double share)>& progress) {
    std::vector<std::size_t> places;
    for (const auto& rated : ratings.list) {
        places.push_back(place_of(table, rated));
    }
    RatingScore score{};
    score.apart = apart.value_or(tenth_of_scale(ratings));
    Clusters clusters;
    std::vector<Figures> figures;
    for (const auto& column : table.metrics) {
        std::vector<double> distances;
        distances.reserve(places.size());
        for (const auto place : places) {
            distances.push_back(column.values.at(place));
        }
        const auto all = predicted(ratings, distances);
        if (figures.empty()) {
            clusters = clusters_of(all.rated, score.apart);
        }
        figures.push_back(figures_of(all, score.apart));
        score.metrics.push_back({.name = column.metric,
                                 .figures = estimates(figures.back(), clusters),
                                 .ties = figures.back().ties,
                                 .undecided = open_places(column).size()});
        if (progress) {
            progress(static_cast<double>(figures.size()) /
                     static_cast<double>(table.metrics.size()));
        }
    }
    score.all = clusters.all;
    score.pairs = clusters.pairs;
    score.pairs_apart = clusters.pairs_apart;
    score.equal_pairs = clusters.equal_pairs;
    score.single_originals = clusters.single_originals;
    auto names = score_names(ratings, score.apart);
    score.differences = differences_of(figures, names.figures, clusters);
    score.name_alone = std::move(names.score);
    score.doubts = doubts_of(ratings, score);
    return score;
}

std::vector<std::size_t> best_first(const RatingScore& score) {
    std::vector<std::size_t> order(score.metrics.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto share = [&](std::size_t m) {
        const double value = score.metrics[m].figures.pairs.value;
        return std::isnan(value) ? -1 : value;
    };
    std::ranges::stable_sort(order, std::ranges::greater(), share);
    return order;
}

}  // namespace merl::scan
