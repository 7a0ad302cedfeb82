#include "scan/votes/vote_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <string_view>
#include <vector>

#include "scan/io/csv.h"

namespace merl::scan {
namespace {

void append_counts(std::string& out, const OptionCounts& counts) {
    out += fmt::format(",{},{},{}", counts.votes[0], counts.votes[1], counts.votes[2]);
}

std::string materials_text(const FourMaterials& materials) {
    return fmt::format("{},{},{},{}", csv_field(materials[0]), csv_field(materials[1]),
                       csv_field(materials[2]), csv_field(materials[3]));
}

/// The columns of votes with their sides undone.
std::string side_columns(const Votes& votes, const std::string& before = "") {
    return fmt::format("{},{}votes_equal,{}", csv_field(before + "votes_" + votes.first_metric),
                       before, csv_field(before + "votes_" + votes.second_metric));
}

/// The names of the columns of votes_columns().
std::string votes_header(const Votes& votes, const std::string& before) {
    const auto column = [&](const std::string& metric, const char* end) {
        return csv_field(fmt::format("{}p_{}{}", before, metric, end));
    };
    return fmt::format("{0},{1}missing,{1}mean,{2},{3},{4},{5},{1}favours",
                       side_columns(votes, before), before, column(votes.second_metric, ""),
                       column(votes.second_metric, "_holm"), column(votes.first_metric, ""),
                       column(votes.first_metric, "_holm"));
}

/// The votes on a configuration and what they say, each after a comma.
void append_votes(std::string& text, const Votes& votes, const ConfigurationVotes& row) {
    append_counts(text, row.sides);
    text += fmt::format(",{}", row.sides.missing);
    for (const double figure :
         {row.sides.mean(), row.p_second, row.p_second_holm, row.p_first, row.p_first_holm}) {
        append_figure(text, figure);
    }
    text += ',';
    if (row.p_second <= significance_level) {
        text += csv_field(votes.second_metric);
    } else if (row.p_first <= significance_level) {
        text += csv_field(votes.first_metric);
    }
}

}  // namespace

void write_configuration_votes(int file, const Votes& votes, const VoteStatistics& statistics,
                               const VoteStatistics* kept) {
    std::string text =
        fmt::format("configuration,kind,left_1,left_2,right_1,right_2,agreement,{}{}\n",
                    votes_header(votes, ""),
                    kept == nullptr ? "" : fmt::format(",{}", votes_header(votes, "kept_")));
    for (std::size_t i = 0; i < statistics.configurations.size(); ++i) {
        const auto& row = statistics.configurations[i];
        const auto& configuration = votes.configurations[row.configuration];
        text += fmt::format("{},{},{}", configuration.number, kind_name(configuration.kind),
                            materials_text(configuration.materials));
        append_figure(text, configuration.agreement.value_or(std::nan("")));
        append_votes(text, votes, row);
        if (kept != nullptr) {
            append_votes(text, votes, kept->configurations[i]);
        }
        text += '\n';
    }
    write_all(file, text);
}

void write_judge_votes(int file, const Votes& votes, const VoteStatistics& statistics,
                       const Exclusion& exclusion) {
    std::string text = fmt::format(
        "judge,file,trials,missing,{},shown_left,shown_equal,shown_right,swapped,side_bias_p,"
        "repeats,repeats_same,repeats_opposite,sentinels,sentinel_failures,response_ms_quartile_1,"
        "response_ms_median,response_ms_quartile_3,most_used_key,most_used_key_answers,longest_run,"
        "looks_wrong,excluded_by\n",
        side_columns(votes));
    for (std::size_t j = 0; j < votes.judges.size(); ++j) {
        const auto& judge = statistics.judges[j];
        text +=
            fmt::format("{},{},{},{}", csv_free_text(votes.judges[j].name),
                        csv_free_text(votes.judges[j].file), votes.trials, judge.trials.missing);
        append_counts(text, judge.sides);
        append_counts(text, judge.bias.shown);
        text += fmt::format(",{}", judge.bias.swapped);
        append_figure(text, judge.bias.p_value);
        text += fmt::format(",{},{},{},{},{}", judge.repeats.answered, judge.repeats.passed,
                            judge.repeats.opposite, judge.sentinels.answered,
                            judge.sentinels.answered - judge.sentinels.passed);
        for (const double quartile : judge.times.quartiles) {
            append_figure(text, quartile);
        }
        const auto most = judge.most_used();
        std::vector<std::string_view> rules;
        std::ranges::transform(exclusion.judges[j], std::back_inserter(rules),
                               [](const Finding& finding) { return name_of(finding.rule); });
        text += fmt::format(
            ",{},{},{},{},{}\n", most.answers > 0 ? most.key : "", most.answers, judge.longest_run,
            csv_free_text(fmt::format("{}", fmt::join(judge.doubts, "; "))), fmt::join(rules, " "));
    }
    write_all(file, text);
}

void write_judgements(int file, const Votes& votes, const VoteStatistics& statistics) {
    std::string text = "left_1,left_2,right_1,right_2,votes_left,votes_equal,votes_right\n";
    for (const auto& row : statistics.configurations) {
        text += materials_text(votes.configurations[row.configuration].materials);
        append_counts(text, row.sides);
        text += '\n';
    }
    write_all(file, text);
}

std::string thesis_table(const Votes& votes, const VoteStatistics& statistics) {
    // By number of votes, most votes for the second metric first.
    std::map<std::array<std::uint64_t, 3>, std::pair<std::uint64_t, double>, std::greater<>> rows;
    for (const auto& row : statistics.configurations) {
        if (votes.configurations[row.configuration].kind == TrialKind::selection) {
            const auto& v = row.sides.votes;
            auto& [count, p] = rows[{v[2], v[1], v[0]}];
            ++count;
            p = row.p_second;
        }
    }
    std::size_t width = 5;
    for (const auto& [v, row] : rows) {
        width = std::max(width, v[0] + v[1] + v[2]);
    }
    width = std::min<std::size_t>(width, 40);
    std::string text = fmt::format("{:<{}}  mean   configurations  p\n", "votes", width);
    for (const auto& [v, row] : rows) {
        const std::uint64_t n = v[0] + v[1] + v[2];
        const std::string pattern =
            n == 0    ? "none"
            : n <= 40 ? std::string(v[0], '3') + std::string(v[1], '2') + std::string(v[2], '1')
                      : fmt::format("{}x3 {}x2 {}x1", v[0], v[1], v[2]);
        text += fmt::format(
            "{:<{}}  {:<5}  {:>14}  {}\n", pattern, width,
            n == 0 ? ""
                   : fmt::format("{:.2f}", static_cast<double>(3 * v[0] + 2 * v[1] + v[2]) /
                                               static_cast<double>(n)),
            row.first, n == 0 ? "" : fmt::format("{:.4f}", row.second));
    }
    const auto& all = statistics.selection.sides.votes;
    text += fmt::format("\noption 1 ({})  {}\noption 2 (equal)  {}\noption 3 ({})  {}\n",
                        votes.first_metric, all[0], all[1], votes.second_metric, all[2]);
    text += fmt::format("{} of {} configurations favour {} at {}, each by itself\n",
                        statistics.significance.alone[1], statistics.significance.judged,
                        votes.second_metric, significance_level);
    return text;
}

}  // namespace merl::scan
