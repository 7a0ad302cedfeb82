#include "app/pipeline/tune.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/commands/obtain_distances.h"
#include "app/commands/obtain_judgements.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "engine/base/stopwatch.h"
#include "engine/base/text.h"
#include "scan/io/csv.h"
#include "scan/tune/tune_tables.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

struct Options {
    DistanceOptions computing;
    std::string metric;
    std::string fit;
    std::string judgements;
    std::optional<std::uint32_t> evaluations;
    std::uint64_t seed = 1;
    std::string out = "merl-scan-tune";
    bool force = false;
    bool quiet = false;
};

struct Outcome {
    ObtainedJudgements judgements;
    OpenedDatabase opened;
    pipeline::TuneResult result;
    std::vector<std::string> warnings;
    double judgement_seconds = 0;
    double total_seconds = 0;

    const scan::Tuning& tuning() const { return result.tuning; }
    const engine::Metric& metric() const { return opened.metrics[0]; }
    const pipeline::Provenance& provenance() const { return result.distances.provenance; }

    /// What --metrics takes for the metric with the fitted parameters.
    std::string fitted_text() const { return engine::text_of(result.metric); }
};

ordered_json score_json(const scan::PredictionScore& score) {
    return {{"majorities", estimate_json(score.majorities)},
            {"votes", estimate_json(score.votes)},
            {"log_likelihood_per_vote", estimate_json(score.log_likelihood)}};
}

ordered_json scores_json(const scan::PredictionScores& scores) {
    return {{"configurations", scores.judgements},
            {"untied", scores.untied},
            {"votes", scores.votes},
            {"effective_clusters", figure_json(scores.clusters.effective)},
            {"before", score_json(scores.first)},
            {"after", score_json(scores.second)},
            {"gain", score_json(scores.gain)}};
}

ordered_json validation_json(const scan::CrossValidation& validation) {
    if (validation.folds.empty()) {
        return nullptr;
    }
    auto json = scores_json(validation.scores);
    json["folds"] = validation.folds.size();
    return json;
}

ordered_json parameters_json(const scan::Tuning& tuning) {
    ordered_json json = ordered_json::array();
    for (std::size_t i = 0; i < tuning.parameters.size(); ++i) {
        const auto& parameter = tuning.parameters[i];
        const auto range_json = [&](const scan::CrossValidation& validation) {
            const auto [least, most] = scan::range_of(validation, i);
            return ordered_json::array({figure_json(least), figure_json(most)});
        };
        json.push_back({{"name", parameter.name},
                        {"before", parameter.start},
                        {"after", tuning.fit.values[i]},
                        {"range", {parameter.low, parameter.high}},
                        {"by_references", range_json(tuning.by_reference)},
                        {"by_materials", range_json(tuning.by_materials)}});
    }
    return json;
}

std::string summary_json(const Options& options, const Outcome& o) {
    const auto& tuning = o.tuning();
    ordered_json json = program_json();
    json["judgements"] = judgements_json(o.judgements, o.result.judgements);
    json.update(source_json(o.provenance()));
    const auto metrics = metrics_json(o.provenance());
    json.update(ordered_json{{"materials", o.result.distances.table.materials()},
                             {"metric_before", metrics[0]},
                             {"metric_after", metrics[1]},
                             {"for_metrics", as_utf8(o.fitted_text())},
                             {"parameters", parameters_json(tuning)},
                             {"slope_before", figure_json(tuning.start_slope)},
                             {"slope_after", figure_json(tuning.fit.slope)},
                             {"left_out",
                              {{"nothing", scores_json(tuning.scores)},
                               {"references", validation_json(tuning.by_reference)},
                               {"materials", validation_json(tuning.by_materials)}}},
                             {"doubts", texts_json(o.result.doubts)},
                             {"evaluations", tuning.evaluations},
                             {"fits", tuning.fits},
                             {"fits_cut_short", tuning.cut_short},
                             {"from_means", o.result.from_means},
                             {"refined_distances", o.result.refined}});
    json["options"] = computing_options_json(options.computing);
    json["options"]["seed"] = options.seed;
    json["options"]["evaluations"] =
        options.evaluations ? ordered_json(*options.evaluations) : ordered_json();
    json.update(engines_json(o.provenance()));
    json["warnings"] = texts_json(o.warnings);
    json["seconds"] = {{"judgements", o.judgement_seconds},
                       {"device", o.provenance().seconds.opening},
                       {"reading", o.result.reading_seconds},
                       {"fit", o.result.fit_seconds},
                       {"distances", o.provenance().seconds.without_opening()},
                       {"refine", o.result.refine_seconds},
                       {"total", o.total_seconds}};
    return json_text(json);
}

void print_scores(const std::string& title, const scan::PredictionScores& scores) {
    print_line(fmt::format("{}, {}", title, counted(scores.judgements, "configuration")));
    const auto row = [](const char* name, const scan::PredictionScore& score, const char* more) {
        print_line(fmt::format("  {:<8}{:<22}  {:<22}  {}{}", name, estimate_text(score.majorities),
                               estimate_text(score.votes), estimate_text(score.log_likelihood),
                               more));
    };
    const auto& gain = scores.gain.log_likelihood;
    row("before", scores.first, "");
    row("after", scores.second, "");
    row("gain", scores.gain,
        gain.too_few.empty() && !scan::clear_of_zero(gain) ? "; not clear of 0" : "");
}

void print_figures(const scan::Tuning& tuning) {
    print_line("");
    print_line(fmt::format("{:<10}{:<22}  {:<22}  {}", "", "majorities", "votes",
                           "log-likelihood per vote"));
    print_scores("fitted on the same", tuning.scores);
    for (const auto* validation : {&tuning.by_reference, &tuning.by_materials}) {
        const auto kind = scan::name_of(validation->kind);
        if (validation->folds.empty()) {
            print_line(fmt::format("{} left out of fitting: too few", kind));
        } else {
            print_scores(fmt::format("{} left out of fitting, {}", kind,
                                     counted(validation->folds.size(), "fit")),
                         validation->scores);
        }
    }
}

void print_parameters(const scan::Tuning& tuning) {
    std::size_t width = 9;
    for (const auto& parameter : tuning.parameters) {
        width = std::max(width, printable(parameter.name).size());
    }
    print_line("");
    print_line(fmt::format("{:<{}}  {:<10}  {:<10}  {}", "parameter", width, "before", "after",
                           "with materials left out"));
    for (std::size_t i = 0; i < tuning.parameters.size(); ++i) {
        const auto& parameter = tuning.parameters[i];
        const double value = tuning.fit.values[i];
        const auto [least, most] = scan::range_of(tuning.by_materials, i);
        print_line(fmt::format(
            "{:<{}}  {:<10}  {:<10}  {}{}", parameter.name, width,
            fmt::format("{:.4g}", parameter.start), fmt::format("{:.4g}", value),
            std::isnan(least) ? "-" : fmt::format("{:.4g} to {:.4g}", least, most),
            value == parameter.low || value == parameter.high ? "; at the end of its range" : ""));
    }
}

void print_summary(const Options& options, const Outcome& o) {
    const auto& tuning = o.tuning();
    print_results(judgements_lines(o.judgements, o.result.judgements));
    print_results(source_lines(o.result.distances));
    print_result("metric", o.provenance().metrics[0].name);
    std::vector<std::string> names;
    for (const auto& parameter : tuning.parameters) {
        names.push_back(parameter.name);
    }
    print_result("fitted", fmt::format("{}", fmt::join(names, ", ")));
    const auto& clusters = tuning.scores.clusters;
    print_result("intervals", clusters.too_few.empty()
                                  ? "95 %, clusters are " +
                                        counted(clusters.materials, "material") +
                                        ", all of a configuration"
                                  : "none; " + clusters.too_few);
    print_results(engine_lines(o.provenance()));
    print_result("seconds",
                 fmt::format("{:.2f}: judgements {:.2f}, reading {:.2f}, fit {:.2f} ({}), "
                             "distances {:.2f}, refine {:.2f}",
                             o.total_seconds, o.judgement_seconds, o.result.reading_seconds,
                             o.result.fit_seconds, counted(tuning.evaluations, "evaluation"),
                             o.provenance().seconds.total, o.result.refine_seconds));
    if (tuning.cut_short > 0) {
        print_result("cut short",
                     fmt::format("{} of {} ended because evaluations ran out (--evaluations)",
                                 fmt::group_digits(tuning.cut_short), counted(tuning.fits, "fit")));
    }
    print_result("results", options.out);
    print_figures(tuning);
    print_parameters(tuning);
    print_line("");
    for (const auto& doubt : o.result.doubts) {
        print_line("doubt: " + doubt);
    }
    print_line(o.fitted_text());
}

/// "40 seconds", "3 hours": as much as an estimate is worth.
std::string duration_text(double seconds) {
    return seconds < 100    ? fmt::format("{:.0f} seconds", seconds)
           : seconds < 6000 ? fmt::format("{:.0f} minutes", seconds / 60)
           : seconds < 2e5  ? fmt::format("{:.0f} hours", seconds / 3600)
                            : fmt::format("{:.0f} days", seconds / 86400);
}

void warn(Outcome& o, const std::string& text) {
    print_warning(text);
    o.warnings.push_back(text);
}

/// Says where the metric has to do with the judgements already: what was judged are its own
/// disagreements, or it was made with the answers.
void warn_of_what_was_seen(Outcome& o) {
    std::vector<double> defaults;
    for (const auto& parameter : o.metric().header.parameters) {
        defaults.push_back(parameter.value);
    }
    const auto plain = engine::with_parameters(o.metric(), defaults).name;
    const auto is_it = [&](const std::string& name) {
        return name == as_utf8(plain) || name.starts_with(as_utf8(plain) + ":");
    };
    if (o.judgements.scanned && std::ranges::any_of(o.judgements.scanned->selected_by, is_it)) {
        warn(o, fmt::format("what was judged are disagreements of {}, as {} says: the fit is "
                            "circular, it learns to be right where these two disagree and nothing "
                            "else, and its figures cannot be compared with others",
                            fmt::join(o.judgements.scanned->selected_by, " and "),
                            o.judgements.scanned->summary));
    }
    for (const auto& data : o.metric().header.fitted) {
        if (data.sha256 == o.judgements.sha256) {
            warn(o, fmt::format("{} was made with {} ({}): its form, and what of it is not fitted "
                                "now, has seen these answers, and so have its figures where some "
                                "are left out",
                                plain, o.judgements.file.file, data.citation));
        }
    }
}

/// What there is to say before the search, which may take long.
void begin(const Options& options, Outcome& o, TerminalControl& terminal,
           const pipeline::TuneBegin& found) {
    for (const auto& text : compare_with_judged(o.judgements, options.computing, &found.database)) {
        warn(o, text);
    }
    if (!found.is_quick && !options.quiet) {
        terminal.clear();
        print_result("estimate",
                     fmt::format("at most {} evaluations of {:.2g} seconds: {}; --evaluations "
                                 "bounds those of each fit",
                                 fmt::group_digits(found.evaluations), found.seconds_per_evaluation,
                                 duration_text(static_cast<double>(found.evaluations) *
                                               found.seconds_per_evaluation)));
        flush_output();
    }
}

int run(const Options& options) {
    Stopwatch watch;
    const auto metric = engine::open_metric(options.metric);
    const auto parameters =
        pipeline::tune_parameters(metric, options.fit.empty() ? std::vector<std::string>()
                                                              : split_list(options.fit, "--fit"));
    const auto threads = limit_threads(options.computing.threads);
    TerminalControl terminal(options.quiet);
    const auto control = terminal.control();
    Outcome o;
    OutputDirectory out(
        options.out, options.force,
        {{.name = "tune.csv", .write = [&](int file) { scan::write_tuning(file, o.tuning()); }},
         {.name = "parameters.csv",
          .write = [&](int file) { scan::write_parameters(file, o.tuning()); }},
         {.name = "folds.csv",
          .write =
              [&](int file) {
                  scan::write_folds(file, o.tuning(), o.result.distances.table.names);
              }},
         {.name = "summary.json",
          .write = [&](int file) { scan::write_all(file, summary_json(options, o)); }}},
        {options.judgements});
    o.judgements = obtain_judgements(options.judgements, options.computing, control);
    o.judgement_seconds = watch.lap();
    const auto computing = with_judged_database(options.computing, o.judgements);
    o.opened = open_for_distances(computing, {metric}, control);
    warn_of_what_was_seen(o);
    pipeline::TuneOptions search = {
        .evaluations = options.evaluations,
        .seed = options.seed,
        .memory_bytes = options.computing.memory,
        .begin = [&](const auto& found) { begin(options, o, terminal, found); }};
    with_memory_advice([&] {
        o.result = pipeline::tune(*o.opened.engines, *o.opened.database, o.metric(), parameters,
                                  o.judgements.file, search, control);
    });
    for (const auto& text : o.provenance().warnings) {
        warn(o, text);
    }
    o.total_seconds = o.judgement_seconds + watch.lap();
    out.finish();
    terminal.clear();
    if (!options.quiet) {
        print_summary(options, o);
    }
    return kSuccess;
}

}  // namespace

void add_tune(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "tune", "Fit the parameters of a metric to what people say, and say what that is worth");
    command
        ->add_option("--metric", options->metric,
                     "The metric, with the values to begin at, like gloss-contrast:haze=1")
        ->required()
        ->transform(not_empty());
    command
        ->add_option("--fit", options->fit,
                     "The parameters to fit, separated by commas (default: all that the metric "
                     "declares)")
        ->transform(not_empty());
    add_judgements_option(*command, options->judgements)->required();
    add_database_options(*command, options->computing.database);
    command
        ->add_option("--evaluations", options->evaluations,
                     fmt::format("How often one fit may have the distances of all pairs evaluated "
                                 "(default: {} for a summary of the library, {} for others)",
                                 pipeline::quick_evaluations, pipeline::slow_evaluations))
        ->transform(whole_number(1, 1'000'000));
    command
        ->add_option("--seed", options->seed, "Of the starts of searches and of what is left out")
        ->transform(whole_number(0, UINT64_MAX))
        ->capture_default_str();
    add_computing_options(*command, options->computing);
    add_output_options(*command, options->out, options->force);
    add_quiet_option(*command, options->quiet);
    command->footer(
        "Writes tune.csv, parameters.csv, folds.csv and summary.json (docs/tuning.md). The last "
        "line\n"
        "that is printed is the metric with its parameters, ready for --metrics. Metrics:\n" +
        std::string(kMetricsHelp) +
        "\n"
        "Examples:\n"
        "  merl-scan tune --metric gloss-contrast --judgements lagunas.json --database "
        "~/merl/brdfs\n"
        "  merl-scan tune --metric gloss-contrast:haze=1 --fit haze,gloss --judgements votes.csv");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
