#include "app/pipeline/score.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/commands/obtain_distances.h"
#include "app/commands/obtain_judgements.h"
#include "app/commands/score_ratings.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "app/pages/score_plot.h"
#include "engine/base/stopwatch.h"
#include "engine/base/text.h"
#include "engine/database/model_database.h"
#include "engine/database/open_database.h"
#include "scan/io/csv.h"
#include "scan/score/score_tables.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

struct Outcome {
    ObtainedJudgements judgements;
    ObtainedDistances obtained;
    pipeline::ScoreResult result;
    double judgement_seconds = 0;

    const pipeline::Provenance& provenance() const { return obtained.distances.provenance; }
    double total_seconds() const {
        return judgement_seconds + provenance().seconds.total + result.refine_seconds +
               result.score_seconds;
    }
};

ordered_json metric_json(const scan::MetricScore& metric) {
    return {{"majorities", estimate_json(metric.majorities)},
            {"votes", estimate_json(metric.votes)},
            {"slope", estimate_json(metric.slope)},
            {"log_likelihood_per_vote", estimate_json(metric.log_likelihood)},
            {"log_likelihood", figure_json(metric.total_log_likelihood)},
            {"ties", metric.ties},
            {"undecided", metric.undecided},
            {"zero_distances", metric.zero_distances},
            {"selected", metric.selected},
            {"fitted_to_judgements", metric.fitted}};
}

ordered_json intervals_json(const scan::ScoreClusters& clusters) {
    return {
        {"level", 0.95},
        {"clusters", "all materials of a configuration"},
        {"materials", clusters.materials},
        {"references", clusters.references},
        {"configurations_without_reference", clusters.without_reference},
        {"compared_materials", clusters.alternatives},
        {"effective_clusters", figure_json(clusters.effective)},
        {"too_few", clusters.too_few.empty() ? ordered_json() : ordered_json(clusters.too_few)}};
}

std::string summary_json(const ScoreOptions& options, const Outcome& o) {
    const auto described = metrics_json(o.provenance());
    const auto refined_by = refined_by_json(o.provenance());
    ordered_json metrics = ordered_json::array();
    for (std::size_t m = 0; m < o.result.score.metrics.size(); ++m) {
        metrics.push_back(described[m]);
        metrics.back().update(metric_json(o.result.score.metrics[m]));
        metrics.back()["refined_distances"] = o.result.refined.empty() ? 0 : o.result.refined[m];
        metrics.back()["refined_by"] = refined_by[as_utf8(o.provenance().metrics[m].name)];
    }
    ordered_json json = program_json();
    json["judgements"] = judgements_json(o.judgements, o.result.judgements);
    json.update(source_json(o.provenance()));
    json.update(ordered_json{
        {"materials", o.obtained.distances.table.materials()},
        {"intervals", intervals_json(o.result.score.clusters)},
        {"ceiling",
         {{"votes", estimate_json(o.result.score.ceiling)},
          {"log_likelihood_per_vote", estimate_json(o.result.score.ceiling_log_likelihood)}}},
        {"metrics", metrics},
        {"options", computing_options_json(options.distances)}});
    json.update(engines_json(o.provenance()));
    json["warnings"] = texts_json(o.provenance().warnings);
    json["seconds"] = {{"judgements", o.judgement_seconds},
                       {"device", o.provenance().seconds.opening},
                       {"distances", o.provenance().seconds.without_opening()},
                       {"refine", o.result.refine_seconds},
                       {"score", o.result.score_seconds},
                       {"total", o.total_seconds()}};
    return json_text(json);
}

/// A metric as it is called in tables.
std::string label(const scan::MetricScore& metric) {
    return metric.name + (metric.selected ? " *" : "") + (metric.fitted ? " +" : "");
}

/// The likelihood of what a metric says, and why it is that of chance where it is.
std::string likelihood_text(const scan::MetricScore& metric) {
    return metric.is_chance() ? fmt::format("{:.3f} [{}]", metric.log_likelihood.value,
                                            metric.is_opposed() ? "opposed" : "chance")
                              : estimate_text(metric.log_likelihood);
}

void print_metrics(const scan::Score& score) {
    std::size_t width = 6;
    for (const auto& metric : score.metrics) {
        width = std::max(width, printable(label(metric)).size());
    }
    print_line("");
    print_line(fmt::format("{:<{}}  {:<22}  {:<22}  {:<22}  {}", "metric", width, "majorities",
                           "votes", "slope", "log-likelihood per vote"));
    for (const std::size_t m : scan::best_first(score)) {
        const auto& metric = score.metrics[m];
        print_line(fmt::format("{:<{}}  {:<22}  {:<22}  {:<22}  {}", label(metric), width,
                               estimate_text(metric.majorities), estimate_text(metric.votes),
                               estimate_text(metric.slope), likelihood_text(metric)));
    }
    if (std::ranges::any_of(score.metrics, &scan::MetricScore::is_opposed)) {
        print_line(
            "[opposed]: the slope is below 0, people do the opposite; what the metric says "
            "is no better than chance");
    }
    if (std::ranges::any_of(score.metrics, [](const scan::MetricScore& metric) {
            return metric.is_chance() && !metric.is_opposed();
        })) {
        print_line(
            "[chance]: the slope is below 0, but not clear of it; what the metric says is no "
            "better than chance");
    }
    if (std::ranges::any_of(score.metrics, &scan::MetricScore::selected)) {
        print_line("* circular: what was judged are disagreements of this metric with another");
    }
    if (std::ranges::any_of(score.metrics, &scan::MetricScore::fitted)) {
        print_line(
            "+ fitted to these judgements: how well it fits them, not how well it predicts "
            "others");
    }
}

/// What the bounds left open, and what became of it.
void print_precision(const Outcome& o) {
    const std::uint64_t refined =
        std::accumulate(o.result.refined.begin(), o.result.refined.end(), std::uint64_t{0});
    if (refined > 0) {
        print_result("refined", fmt::format("{} distances in float64, on which predictions rest",
                                            fmt::group_digits(refined)));
    }
    for (const auto& metric : o.result.score.metrics) {
        if (metric.undecided > 0) {
            print_result("undecided",
                         fmt::format("{}: {}, nearer than its bound can tell, if it has one",
                                     metric.name, counted(metric.undecided, "configuration")));
        }
    }
}

/// The best metric against every other.
void print_pairs(const scan::Score& score) {
    const std::size_t best = scan::best_first(score).front();
    if (score.pairs.empty()) {
        return;
    }
    print_line("");
    print_line(
        fmt::format("{} minus another metric, majorities predicted; where they disagree, "
                    "who is right:",
                    label(score.metrics[best])));
    for (const std::size_t other : scan::best_first(score)) {
        for (const auto& pair : score.pairs) {
            if ((pair.first != best || pair.second != other) &&
                (pair.first != other || pair.second != best)) {
                continue;
            }
            const bool first = pair.first == best;
            const auto difference = first ? pair.difference : scan::negative(pair.difference);
            const bool open = difference.too_few.empty() && !scan::clear_of_zero(difference);
            print_line(fmt::format("  against {}: {}, {} to {}{}", label(score.metrics[other]),
                                   estimate_text(difference),
                                   fmt::group_digits(first ? pair.first_right : pair.second_right),
                                   fmt::group_digits(first ? pair.second_right : pair.first_right),
                                   open ? "; not clear of 0" : ""));
        }
    }
}

void print_summary(const ScoreOptions& options, const Outcome& o) {
    print_results(judgements_lines(o.judgements, o.result.judgements));
    print_results(source_lines(o.obtained.distances));
    print_result("ceiling", estimate_text(o.result.score.ceiling) + " of the votes");
    const auto& clusters = o.result.score.clusters;
    print_result("intervals", clusters.too_few.empty()
                                  ? "95 %, clusters are " +
                                        counted(clusters.materials, "material") +
                                        ", all of a configuration"
                                  : "none; " + clusters.too_few);
    print_precision(o);
    print_results(engine_lines(o.provenance()));
    print_result("seconds",
                 fmt::format("{:.2f}: judgements {:.2f}, device {:.2f}, distances {:.2f}, "
                             "refine {:.2f}, score {:.2f}",
                             o.total_seconds(), o.judgement_seconds, o.provenance().seconds.opening,
                             o.provenance().seconds.without_opening(), o.result.refine_seconds,
                             o.result.score_seconds));
    print_result("results", options.out);
    print_metrics(o.result.score);
    print_pairs(o.result.score);
}

/// What was judged are disagreements of two metrics: of those it says nothing else.
void warn_of_circular_scores(Outcome& o) {
    const auto& metrics = o.obtained.distances.table.metrics;
    if (std::ranges::any_of(
            metrics, [&](const auto& m) { return o.judgements.are_selected_by(m.metric); })) {
        warn(o.obtained.distances.provenance,
             fmt::format("what was judged are disagreements of {}, as {} says: their scores are "
                         "circular and say only which of the two is right where they disagree; "
                         "what one gains the other loses, and neither can be compared with other "
                         "metrics or other judgements",
                         fmt::join(o.judgements.scanned->selected_by, " and "),
                         o.judgements.scanned->summary));
    }
}

/// Says which metrics have seen the answers.
void warn_of_fitted(const ScoreOptions& options, Outcome& o) {
    for (const auto& metric : o.provenance().metrics) {
        if (const auto* data = o.judgements.fitted_to(metric)) {
            warn(o.obtained.distances.provenance,
                 fmt::format("{} was fitted to {} ({}): its figures say how well it fits these "
                             "judgements, not how well it predicts others",
                             metric.name, options.judgements, data->citation));
        }
    }
}

/// The names of the built-in databases that distances are of: whatever is published has to say so.
std::string stand_in_of(const pipeline::DatabaseProvenance& database) {
    if (database.parts.empty()) {
        return database.kind == engine::built_in_kind ? database.name : "";
    }
    std::string names;
    for (const auto& part : database.parts) {
        if (part.kind == engine::built_in_kind) {
            names += (names.empty() ? "" : "; ") + part.name;
        }
    }
    return names;
}

/// What the plot says below its title.
std::string subtitle(const ScoreOptions& options, const Outcome& o) {
    const auto name = std::filesystem::path(options.judgements).filename().string();
    const auto& database = o.provenance().database;
    const auto stand_in = database ? stand_in_of(*database) : "";
    const auto skipped =
        database && !database->skipped.empty() ? counted(database->skipped.size(), "bad file") : "";
    return fmt::format("{}: {}{}{}", name, judgements_text(o.result.judgements),
                       stand_in.empty() ? "" : "; distances of " + stand_in,
                       skipped.empty() ? "" : "; without " + skipped);
}

int score_judgements(const ScoreOptions& options) {
    const auto threads = limit_threads(options.distances.threads);
    TerminalControl terminal(options.quiet);
    const auto control = terminal.control();
    Outcome o;
    OutputDirectory out(
        options.out, options.force,
        {{.name = "score.csv",
          .write = [&](int file) { scan::write_scores(file, o.result.score); }},
         {.name = "score_pairs.csv",
          .write = [&](int file) { scan::write_pair_scores(file, o.result.score); }},
         {.name = "score.svg",
          .write =
              [&](int file) {
                  scan::write_all(file, score_svg(o.result.score, subtitle(options, o)));
              }},
         {.name = "summary.json",
          .write = [&](int file) { scan::write_all(file, summary_json(options, o)); }}},
        {options.judgements, options.distances.distances});
    Stopwatch watch;
    o.judgements = obtain_judgements(options.judgements, options.distances, control);
    o.judgement_seconds = watch.lap();
    o.obtained = obtain_distances(with_judged_database(options.distances, o.judgements),
                                  kScoreMetrics, control);
    const auto& database = o.provenance().database;
    for (const auto& text :
         compare_with_judged(o.judgements, options.distances, database ? &*database : nullptr)) {
        warn(o.obtained.distances.provenance, text);
    }
    warn_of_circular_scores(o);
    warn_of_fitted(options, o);
    o.result = pipeline::score_distances(
        o.obtained.distances.table, o.judgements.file, o.obtained.database.get(),
        o.obtained.metrics, options.distances.memory, control, o.obtained.engines.get());
    for (std::size_t m = 0; m < o.result.score.metrics.size(); ++m) {
        auto& metric = o.result.score.metrics[m];
        metric.selected = o.judgements.are_selected_by(metric.name);
        metric.fitted = o.judgements.fitted_to(o.provenance().metrics[m]) != nullptr;
    }
    warn_if_all_are_zero(o.obtained.distances.provenance, o.obtained.distances.table.metrics);
    out.finish();
    terminal.clear();
    if (!options.quiet) {
        print_summary(options, o);
    }
    return kSuccess;
}

}  // namespace

void add_score(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<ScoreOptions>();
    auto* command = program.add_subcommand(
        "score", "How well distances predict what people say about the similarity of materials");
    auto* judgements = add_judgements_option(*command, options->judgements);
    auto* ratings = add_rating_options(*command, options->ratings);
    add_distance_options(*command, options->distances, kScoreMetrics);
    add_output_options(*command, options->out, options->force);
    add_quiet_option(*command, options->quiet);
    judgements->excludes(ratings);
    command->footer(
        std::string(
            "Writes score.csv, score_pairs.csv, score.svg and summary.json (docs/scoring.md). "
            "Without\n"
            "--database and --distances, the judgements.csv of `votes` is scored with the database "
            "whose\n"
            "spheres were judged. With --ratings it writes ratings.csv, rating_scores.csv,\n"
            "rating_differences.csv and summary.json. An original \"x\" of the ratings is "
            "REFERENCE/x, its\n"
            "approximation \"m\" is m/x; only these distances are computed.\n"
            "\n") +
        kDatabaseHelp +
        "\n"
        "Examples:\n"
        "  merl-scan score --judgements votes.csv\n"
        "  merl-scan score --judgements lagunas.json --database ~/merl/brdfs --metrics all\n"
        "  merl-scan score --judgements votes.csv --distances network.csv --out network-score\n"
        "  merl-scan score --ratings ratings.csv --database measured=~/merl --database abc \\\n"
        "      --reference measured");
    command->callback([&chosen, options, judgements, ratings] {
        if (judgements->count() + ratings->count() == 0) {
            throw CLI::RequiredError("--judgements or --ratings");
        }
        chosen = [options] {
            return options->ratings.ratings.empty() ? score_judgements(*options)
                                                    : score_ratings(*options);
        };
    });
}

}  // namespace merl::app
