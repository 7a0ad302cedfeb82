#include "scan/score/score_tables.h"

#include <fmt/format.h>

#include <string>

#include "scan/io/csv.h"

namespace merl::scan {

void append_estimate(std::string& out, const Estimate& estimate) {
    append_figure(out, estimate.value);
    append_figure(out, estimate.interval.low);
    append_figure(out, estimate.interval.high);
}

void write_scores(int file, const Score& score) {
    std::string text = "metric";
    for (const auto* column : {"majorities", "votes", "slope", "log_likelihood_per_vote"}) {
        text += fmt::format(",{0},{0}_low,{0}_high", column);
    }
    text += ",log_likelihood,ties,undecided,zero_distances,selected,fitted\n";
    for (const auto& metric : score.metrics) {
        text += csv_field(metric.name);
        append_estimate(text, metric.majorities);
        append_estimate(text, metric.votes);
        append_estimate(text, metric.slope);
        append_estimate(text, metric.log_likelihood);
        append_figure(text, metric.total_log_likelihood);
        text += fmt::format(",{},{},{},{},{}\n", metric.ties, metric.undecided,
                            metric.zero_distances, metric.selected ? 1 : 0, metric.fitted ? 1 : 0);
    }
    write_all(file, text);
}

void write_pair_scores(int file, const Score& score) {
    std::string text =
        "metric_1,metric_2,right_1,right_2,difference,difference_low,difference_high,clear_of_0,"
        "p_holm\n";
    for (const auto& pair : score.pairs) {
        text += fmt::format("{},{},{},{}", csv_field(score.metrics[pair.first].name),
                            csv_field(score.metrics[pair.second].name), pair.first_right,
                            pair.second_right);
        append_estimate(text, pair.difference);
        text += clear_of_zero(pair.difference) ? ",1" : ",0";
        append_figure(text, pair.p_holm);
        text += '\n';
    }
    write_all(file, text);
}

}  // namespace merl::scan
