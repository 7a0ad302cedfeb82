#include "scan/votes/vote_statistics.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "scan/pairs/material_labels.h"
#include "scan/statistics/crossed_share.h"
#include "scan/statistics/krippendorff.h"
#include "scan/statistics/sign_test.h"
#include "scan/statistics/uniform_test.h"
#include "scan/votes/doubts.h"

namespace merl::scan {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

/// First looks: by judge and configuration, the vote with its sides undone.
std::vector<std::vector<std::uint8_t>> first_looks(const Votes& votes) {
    std::vector<std::vector<std::uint8_t>> sides(
        votes.judges.size(), std::vector<std::uint8_t>(votes.configurations.size()));
    for (std::size_t j = 0; j < votes.judges.size(); ++j) {
        for (const auto& ballot : votes.judges[j].ballots) {
            if (!ballot.repeat) {
                sides[j][ballot.configuration] = ballot.side();
            }
        }
    }
    return sides;
}

/// The numbers of the clusters that each configuration is in, each once, and how many there are:
/// its materials, or its original alone.
struct Clusters {
    std::vector<std::vector<std::uint32_t>> configurations;
    std::uint32_t count = 0;
};

Clusters number_clusters(const Votes& votes) {
    Clusters result;
    std::map<std::string, std::uint32_t> numbers;
    for (const auto& configuration : votes.configurations) {
        auto& list = result.configurations.emplace_back();
        const std::span<const std::string> all = configuration.materials;
        for (const auto& name : votes.reference.empty() ? all : all.first(1)) {
            const auto number =
                numbers.emplace(name, static_cast<std::uint32_t>(numbers.size())).first->second;
            if (std::ranges::find(list, number) == list.end()) {
                list.push_back(number);
            }
        }
    }
    result.count = static_cast<std::uint32_t>(numbers.size());
    return result;
}

/// Indices of configurations.
using Subset = std::vector<std::uint32_t>;

class Statistics {
  public:
    Statistics(const Votes& votes, const BootstrapOptions& options,
               const std::function<void(double share)>& progress)
        : votes_(votes),
          options_(options),
          progress_(progress),
          looks_(first_looks(votes)),
          clusters_(number_clusters(votes)) {}

    VoteStatistics compute() const {
        VoteStatistics result{};
        add_configurations(result, TrialKind::selection);
        add_configurations(result, TrialKind::random);
        result.significance = significance(result);
        result.selection = overall(result, TrialKind::selection);
        if (has(TrialKind::random)) {
            result.random = overall(result, TrialKind::random);
        }
        result.alpha = alpha(result);
        result.sentinels_known =
            std::ranges::all_of(votes_.configurations, [](const auto& configuration) {
                return configuration.kind != TrialKind::sentinel || configuration.expected != 0;
            });
        add_judges(result);
        return result;
    }

  private:
    bool has(TrialKind kind) const {
        return std::ranges::any_of(votes_.configurations,
                                   [&](const auto& c) { return c.kind == kind; });
    }

    Subset of_kind(TrialKind kind) const {
        Subset subset;
        for (std::uint32_t k = 0; k < votes_.configurations.size(); ++k) {
            if (votes_.configurations[k].kind == kind) {
                subset.push_back(k);
            }
        }
        return subset;
    }

    OptionCounts sides_of(std::uint32_t configuration) const {
        OptionCounts sides;
        for (const auto& judge : looks_) {
            sides.add(judge[configuration]);
        }
        return sides;
    }

    void add_configurations(VoteStatistics& result, TrialKind kind) const {
        const std::size_t begin = result.configurations.size();
        std::vector<double> p_first;
        std::vector<double> p_second;
        std::map<std::uint64_t, UniformVotes> tests;
        for (std::uint32_t k = 0; k < votes_.configurations.size(); ++k) {
            if (votes_.configurations[k].kind != kind) {
                continue;
            }
            result.configurations.push_back({.configuration = k,
                                             .sides = sides_of(k),
                                             .p_first = none,
                                             .p_first_holm = none,
                                             .p_second = none,
                                             .p_second_holm = none});
            auto& row = result.configurations.back();
            const auto n = row.sides.answered();
            if (n == 0) {
                p_first.push_back(1);
                p_second.push_back(1);
                continue;
            }
            const auto& test = tests.try_emplace(n, static_cast<std::uint32_t>(n)).first->second;
            const auto sum = row.sides.votes[0] + 2 * row.sides.votes[1] + 3 * row.sides.votes[2];
            p_first.push_back(row.p_first = test.at_most(sum));
            p_second.push_back(row.p_second = test.at_least(sum));
        }
        const auto first = holm(p_first);
        const auto second = holm(p_second);
        for (std::size_t i = begin; i < result.configurations.size(); ++i) {
            auto& row = result.configurations[i];
            if (row.sides.answered() > 0) {
                row.p_first_holm = first[i - begin];
                row.p_second_holm = second[i - begin];
            }
        }
    }

    Significance significance(const VoteStatistics& result) const {
        Significance s;
        const auto count = [](std::array<std::uint64_t, 2>& counts, double first, double second) {
            counts[0] += first <= significance_level ? 1 : 0;
            counts[1] += second <= significance_level ? 1 : 0;
        };
        for (const auto& row : result.configurations) {
            if (votes_.configurations[row.configuration].kind == TrialKind::selection) {
                ++s.configurations;
                s.judged += row.sides.answered() > 0 ? 1 : 0;
                count(s.alone, row.p_first, row.p_second);
                count(s.holm, row.p_first_holm, row.p_second_holm);
                s.most_votes = std::max(s.most_votes, row.sides.answered());
            }
        }
        for (std::uint32_t equal = 0; equal < s.fewest_judges.size() && s.configurations > 0;
             ++equal) {
            s.fewest_judges.at(equal) = fewest_judges(significance_level, s.configurations, equal);
        }
        s.least_p = std::pow(3.0, -static_cast<double>(s.most_votes));
        s.least_p_needed =
            significance_level / static_cast<double>(std::max<std::uint64_t>(1, s.configurations));
        return s;
    }

    /// The mean of what votes on these configurations are worth, with sides undone: `worth` of the
    /// votes 1, 2 and 3 on a configuration.
    template <typename Worth>
    CrossedShare crossed_share(const Subset& subset, const Worth& worth) const {
        std::vector<CrossedValue> values;
        for (std::uint32_t j = 0; j < looks_.size(); ++j) {
            for (const std::uint32_t k : subset) {
                if (looks_[j][k] != 0) {
                    values.push_back({j, k, worth(k).at(looks_[j][k] - 1U)});
                }
            }
        }
        return {values, static_cast<std::uint32_t>(looks_.size()), clusters_.configurations,
                clusters_.count};
    }

    OverallVotes overall(const VoteStatistics& result, TrialKind kind) const {
        OverallVotes o{};
        for (const auto& row : result.configurations) {
            if (votes_.configurations[row.configuration].kind != kind) {
                continue;
            }
            for (std::size_t option = 0; option < 3; ++option) {
                o.sides.votes.at(option) += row.sides.votes.at(option);
            }
            o.sides.missing += row.sides.missing;
            o.first_right += row.sides.votes[0] > row.sides.votes[2] ? 1 : 0;
            o.second_right += row.sides.votes[0] < row.sides.votes[2] ? 1 : 0;
        }
        add_shares(o, kind);
        if (!votes_.reference.empty()) {
            o.approximations = approximations(kind);
        }
        for (std::size_t j = 0; j < looks_.size(); ++j) {
            const auto sides = sides_of_judge(j, kind);
            o.judges_first += sides.votes[0] > sides.votes[2] ? 1 : 0;
            o.judges_second += sides.votes[0] < sides.votes[2] ? 1 : 0;
        }
        o.judges_p = sign_test(o.judges_first, o.judges_second);
        return o;
    }

    /// Judges who voted on any of these configurations.
    std::uint64_t judges_of(const Subset& subset) const {
        return static_cast<std::uint64_t>(std::ranges::count_if(looks_, [&](const auto& looks) {
            return std::ranges::any_of(subset, [&](std::uint32_t k) { return looks[k] != 0; });
        }));
    }

    /// Those of these configurations that anybody voted on.
    Subset judged(const Subset& subset) const {
        Subset result;
        std::ranges::copy_if(subset, std::back_inserter(result),
                             [&](std::uint32_t k) { return sides_of(k).answered() > 0; });
        return result;
    }

    /// Why the votes on these configurations are too few for intervals; empty if they are not.
    std::string too_few_votes(const Subset& subset) const {
        std::set<std::uint32_t> clusters;
        const auto configurations = judged(subset);
        for (const std::uint32_t k : configurations) {
            const auto& list = clusters_.configurations[k];
            clusters.insert(list.begin(), list.end());
        }
        for (const auto& reason :
             {too_few(judges_of(subset), "judges", least_judges),
              too_few(configurations.size(), "configurations"),
              too_few(clusters.size(), votes_.reference.empty() ? "materials" : "originals")}) {
            if (!reason.empty()) {
                return reason;
            }
        }
        return {};
    }

    /// Shares and lead. The lead is that of a share in which "equal" is half a vote.
    void add_shares(OverallVotes& o, TrialKind kind) const {
        const auto subset = of_kind(kind);
        const std::string reason = too_few_votes(subset);
        const auto share = [&](const std::array<double, 3>& worth) {
            return crossed_share(subset, [&](std::uint32_t) { return worth; });
        };
        for (std::size_t option = 0; option < 3; ++option) {
            std::array<double, 3> worth{};
            worth.at(option) = 1;
            o.shares.at(option) = share(worth).estimate(reason);
        }
        const auto balance = share({0, 0.5, 1});
        o.lead = balance.estimate(reason);
        for (double* const end : {&o.lead.value, &o.lead.interval.low, &o.lead.interval.high}) {
            *end = 2 * *end - 1;
        }
        // However few differ, judges who all agree may do so by chance: as with as many throws of a
        // coin.
        o.p_value = o.lead.too_few.empty()
                        ? std::max(sign_test(judges_of(subset), 0), balance.p_value(0.5))
                        : none;
    }

    /// How often each label was chosen, by itself and beside each other one.
    std::vector<ApproximationVotes> approximations(TrialKind kind) const {
        // Configurations by label and other label; with an empty one those of all others.
        std::map<std::pair<std::string, std::string>, Subset> subsets;
        for (const std::uint32_t k : judged(of_kind(kind))) {
            const auto [left, right] = labels_of(k);
            subsets[{left, ""}].push_back(k);
            subsets[{right, ""}].push_back(k);
            subsets[std::minmax(left, right)].push_back(k);
        }
        std::vector<ApproximationVotes> result;
        result.reserve(subsets.size());
        for (const auto& [labels, subset] : subsets) {
            result.push_back(approximation_votes(labels.first, labels.second, subset));
        }
        std::stable_partition(result.begin(), result.end(),
                              [](const auto& row) { return row.other.empty(); });
        return result;
    }

    /// The labels of the left and the right approximation of a configuration.
    std::pair<std::string, std::string> labels_of(std::uint32_t k) const {
        const auto& m = votes_.configurations[k].materials;
        return {std::string(labelled(m[1]).label), std::string(labelled(m[3]).label)};
    }

    ApproximationVotes approximation_votes(const std::string& label, const std::string& other,
                                           const Subset& subset) const {
        ApproximationVotes row{.label = label, .other = other, .share = {none, {none, none}}};
        row.configurations = subset.size();
        const auto is_left = [&](std::uint32_t k) { return labels_of(k).first == label; };
        for (const std::uint32_t k : subset) {
            const auto sides = sides_of(k);
            row.votes[0] += sides.votes.at(is_left(k) ? 0 : 2);
            row.votes[1] += sides.votes[1];
            row.votes[2] += sides.votes.at(is_left(k) ? 2 : 0);
        }
        row.share = crossed_share(subset, [&](std::uint32_t k) {
                        return is_left(k) ? std::array{1.0, 0.5, 0.0} : std::array{0.0, 0.5, 1.0};
                    }).estimate(too_few_votes(subset));
        return row;
    }

    OptionCounts sides_of_judge(std::size_t judge, TrialKind kind) const {
        OptionCounts sides;
        for (std::size_t k = 0; k < votes_.configurations.size(); ++k) {
            if (votes_.configurations[k].kind == kind) {
                sides.add(looks_[judge][k]);
            }
        }
        return sides;
    }

    Estimate alpha(const VoteStatistics& result) const {
        std::vector<UnitCounts> units;
        for (const auto& row : result.configurations) {
            if (votes_.configurations[row.configuration].kind == TrialKind::selection) {
                const auto& votes = row.sides.votes;
                units.push_back({static_cast<std::uint32_t>(votes[0]),
                                 static_cast<std::uint32_t>(votes[1]),
                                 static_cast<std::uint32_t>(votes[2])});
            }
        }
        return ordinal_alpha(units, options_, progress_);
    }

    void add_judges(VoteStatistics& result) const {
        std::vector<double> all_times;
        for (std::size_t j = 0; j < votes_.judges.size(); ++j) {
            JudgeVotes judge{};
            judge.sides = sides_of_judge(j, TrialKind::selection);
            std::vector<double> times;
            for (const auto& ballot : votes_.judges[j].ballots) {
                judge.trials.add(ballot.shown);
                if (ballot.shown != 0) {
                    look_at(ballot, j, judge);
                    if (ballot.response_ms) {
                        times.push_back(*ballot.response_ms);
                    }
                }
            }
            judge.bias.p_value = p_of(judge.bias);
            judge.times = quartiles(times);
            all_times.insert(all_times.end(), times.begin(), times.end());
            judge.longest_run = longest_run(votes_.judges[j]);
            judge.doubts = doubts_about(votes_, judge, result.sentinels_known);
            add_up(judge, result);
            result.judges.push_back(std::move(judge));
        }
        result.bias.p_value = p_of(result.bias);
        result.times = quartiles(all_times);
    }

    static std::uint64_t longest_run(const Judge& judge) {
        std::uint64_t longest = 0;
        std::uint64_t run = 0;
        std::uint8_t side = 0;
        for (const auto& ballot : judge.ballots) {
            if (ballot.shown == 1 || ballot.shown == 3) {
                run = ballot.shown == side ? run + 1 : 1;
                side = ballot.shown;
                longest = std::max(longest, run);
            }
        }
        return longest;
    }

    static double p_of(const SideBias& bias) {
        return bias.swapped == 0 ? none : sign_test(bias.shown.votes[0], bias.shown.votes[2]);
    }

    /// What an answered trial says about the judge.
    void look_at(const Ballot& ballot, std::size_t j, JudgeVotes& judge) const {
        const auto& configuration = votes_.configurations[ballot.configuration];
        const auto check = [&](Checks& checks, std::uint8_t expected) {
            ++checks.answered;
            checks.passed += ballot.side() == expected ? 1 : 0;
            checks.opposite += ballot.side() + expected == 4 && expected != 2 ? 1 : 0;
        };
        if (ballot.repeat && looks_[j][ballot.configuration] != 0) {
            check(judge.repeats, looks_[j][ballot.configuration]);
        }
        if (configuration.kind == TrialKind::sentinel) {
            if (!ballot.repeat && configuration.expected != 0) {
                check(judge.sentinels, configuration.expected);
            }
            return;
        }
        judge.bias.shown.add(ballot.shown);
        judge.bias.swapped += ballot.swapped ? 1 : 0;
    }

    static void add_up(const JudgeVotes& judge, VoteStatistics& result) {
        for (std::size_t option = 0; option < 3; ++option) {
            result.bias.shown.votes.at(option) += judge.bias.shown.votes.at(option);
        }
        result.bias.swapped += judge.bias.swapped;
        for (auto [checks, all] :
             {std::pair(&judge.repeats, &result.repeats), {&judge.sentinels, &result.sentinels}}) {
            all->answered += checks->answered;
            all->passed += checks->passed;
            all->opposite += checks->opposite;
        }
    }

    static ResponseTimes quartiles(const std::vector<double>& times) {
        ResponseTimes result{.count = times.size(), .quartiles = {none, none, none}};
        if (!times.empty()) {
            std::vector<double> sorted = times;
            std::ranges::sort(sorted);
            result.quartiles = {quantile(sorted, 0.25), quantile(sorted, 0.5),
                                quantile(sorted, 0.75)};
        }
        return result;
    }

    const Votes& votes_;
    const BootstrapOptions& options_;
    const std::function<void(double share)>& progress_;
    std::vector<std::vector<std::uint8_t>> looks_;
    Clusters clusters_;
};

}  // namespace

void OptionCounts::add(std::uint8_t vote) {
    if (vote == 0) {
        ++missing;
    } else {
        ++votes.at(vote - 1U);
    }
}

double OptionCounts::mean() const {
    return static_cast<double>(votes[0] + 2 * votes[1] + 3 * votes[2]) /
           static_cast<double>(answered());
}

MostUsedKey JudgeVotes::most_used() const {
    constexpr std::array<std::string_view, 3> keys = {"left", "equal", "right"};
    const auto* const most = std::ranges::max_element(trials.votes);
    return {keys.at(static_cast<std::size_t>(most - trials.votes.begin())), *most};
}

Estimate Checks::share() const {
    if (answered == 0) {
        return {none, {none, none}};
    }
    using Binomial = boost::math::binomial_distribution<double>;
    const auto n = static_cast<double>(answered);
    const auto k = static_cast<double>(passed);
    return {k / n,
            {passed == 0 ? 0 : Binomial::find_lower_bound_on_p(n, k, 0.025),
             passed == answered ? 1 : Binomial::find_upper_bound_on_p(n, k, 0.025)}};
}

VoteStatistics vote_statistics(const Votes& votes, const BootstrapOptions& options,
                               const std::function<void(double share)>& progress) {
    return Statistics(votes, options, progress).compute();
}

}  // namespace merl::scan
