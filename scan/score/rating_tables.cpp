#include "scan/score/rating_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "scan/io/csv.h"
#include "scan/score/score_tables.h"

namespace merl::scan {
namespace {

void append_figures(std::string& text, const RatingFigures& figures) {
    append_estimate(text, figures.spearman);
    append_estimate(text, figures.kendall);
    append_estimate(text, figures.pairs);
    append_estimate(text, figures.pairs_apart);
}

}  // namespace

void write_ratings(int file, const Ratings& ratings, const ListedDistances& table,
                   const RatingScore& score) {
    std::string text = "original,approximation,ratings,rating,name_alone";
    for (const auto& column : table.metrics) {
        text += ',' + csv_field(column.metric);
    }
    text += '\n';
    for (std::size_t i = 0; i < ratings.list.size(); ++i) {
        const auto& rated = ratings.list[i];
        text += fmt::format("{},{},{},", csv_field(table.names[rated.original]),
                            csv_field(table.names[rated.approximation]), rated.ratings);
        append_number(text, rated.rating);
        text += score.name_alone ? "" : ",";
        if (score.name_alone) {
            append_figure(text, score.name_alone->predicted[i]);
        }
        const auto place = place_of(table, rated);
        for (const auto& column : table.metrics) {
            append_figure(text, column.values[place]);
        }
        text += '\n';
    }
    write_all(file, text);
}

void write_rating_scores(int file, const RatingScore& score) {
    std::string text = "metric";
    for (const auto* column : {"spearman", "kendall", "pairs", "pairs_apart"}) {
        text += fmt::format(",{0},{0}_low,{0}_high", column);
    }
    text += ",ties,undecided,fitted\n";
    for (const auto& metric : score.metrics) {
        text += csv_field(metric.name);
        append_figures(text, metric.figures);
        text += fmt::format(",{},{},{}\n", metric.ties, metric.undecided, metric.fitted ? 1 : 0);
    }
    if (score.name_alone) {
        text += name_alone_text;
        append_figures(text, score.name_alone->figures);
        text += ",,,\n";
    }
    write_all(file, text);
}

void write_rating_differences(int file, const RatingScore& score) {
    std::string text = "metric_1,metric_2";
    for (const auto* column : {"spearman", "pairs", "pairs_apart"}) {
        text += fmt::format(",{0},{0}_low,{0}_high,{0}_clear_of_0,{0}_p_holm", column);
    }
    text += '\n';
    for (const auto& row : score.differences) {
        text += csv_field(score.metrics[row.first].name) + ',' +
                (row.second ? csv_field(score.metrics[*row.second].name) : name_alone_text);
        for (const auto& figure : {row.spearman, row.pairs, row.pairs_apart}) {
            append_estimate(text, figure.estimate);
            text += clear_of_zero(figure.estimate) ? ",1" : ",0";
            append_figure(text, figure.p_holm);
        }
        text += '\n';
    }
    write_all(file, text);
}

}  // namespace merl::scan
