#include "scan/tune/tune_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "scan/io/csv.h"
#include "scan/score/score_tables.h"

namespace merl::scan {
namespace {

void append_scores(std::string& out, const char* left_out, const PredictionScores& scores) {
    const std::pair<const char*, const PredictionScore*> rows[] = {
        {"before", &scores.first}, {"after", &scores.second}, {"gain", &scores.gain}};
    for (const auto& [name, score] : rows) {
        out += fmt::format("{},{},{},{},{}", left_out, name, scores.judgements, scores.untied,
                           scores.votes);
        append_estimate(out, score->majorities);
        append_estimate(out, score->votes);
        append_estimate(out, score->log_likelihood);
        out += '\n';
    }
}

}  // namespace

FoldRange range_of(const CrossValidation& validation, std::size_t parameter) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    FoldRange range = {infinity, -infinity};
    for (const auto& fold : validation.folds) {
        range.least = std::min(range.least, fold.fit.values[parameter]);
        range.most = std::max(range.most, fold.fit.values[parameter]);
    }
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    return validation.folds.empty() ? FoldRange{none, none} : range;
}

void write_tuning(int file, const Tuning& tuning) {
    std::string text = "left_out,parameters,configurations,untied,all_votes";
    for (const auto* column : {"majorities", "votes", "log_likelihood_per_vote"}) {
        text += fmt::format(",{0},{0}_low,{0}_high", column);
    }
    text += '\n';
    append_scores(text, "nothing", tuning.scores);
    for (const auto* validation : {&tuning.by_reference, &tuning.by_materials}) {
        if (!validation->folds.empty()) {
            append_scores(text, name_of(validation->kind).c_str(), validation->scores);
        }
    }
    write_all(file, text);
}

void write_parameters(int file, const Tuning& tuning) {
    std::string text =
        "parameter,before,after,low,high,references_least,references_most,materials_least,"
        "materials_most\n";
    for (std::size_t i = 0; i < tuning.parameters.size(); ++i) {
        const auto& parameter = tuning.parameters[i];
        text += csv_field(parameter.name);
        for (const double value :
             {parameter.start, tuning.fit.values[i], parameter.low, parameter.high}) {
            append_figure(text, value);
        }
        for (const auto* validation : {&tuning.by_reference, &tuning.by_materials}) {
            const auto [least, most] = range_of(*validation, i);
            append_figure(text, least);
            append_figure(text, most);
        }
        text += '\n';
    }
    write_all(file, text);
}

void write_folds(int file, const Tuning& tuning, const std::vector<std::string>& materials) {
    std::string text = "fold,left_out,materials,fitted_on,tested_on,evaluations,slope";
    for (const auto& parameter : tuning.parameters) {
        text += ',' + csv_field(parameter.name);
    }
    text += '\n';
    std::size_t number = 0;
    for (const auto* validation : {&tuning.by_reference, &tuning.by_materials}) {
        for (const auto& [fold, trained, tested, fit] : validation->folds) {
            std::string names;
            for (std::size_t m = 0; m < materials.size(); ++m) {
                if (fold.left_out[m]) {
                    names += (names.empty() ? "" : " | ") + materials[m];
                }
            }
            text += fmt::format("{},{},{},{},{},{}", ++number, name_of(fold.kind), csv_field(names),
                                trained, tested, fit.evaluations);
            append_figure(text, fit.slope);
            for (const double value : fit.values) {
                append_figure(text, value);
            }
            text += '\n';
        }
    }
    write_all(file, text);
}

}  // namespace merl::scan
