#include "app/pipeline/score.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/commands/obtain_distances.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "app/output/scan_record.h"
#include "app/pages/score_plot.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "engine/base/text.h"
#include "engine/database/abc_database.h"
#include "engine/database/open_database.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"
#include "scan/score/judgement_file.h"
#include "scan/score/lagunas.h"
#include "scan/score/score_tables.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

const MetricNeeds kMetrics = {.from_database = "all"};

struct Options {
    DistanceOptions distances;
    std::string judgements;
    std::string out = "merl-scan-score";
    bool force = false;
    bool quiet = false;
};

struct Outcome {
    scan::JudgementFile file;
    std::string content_hash;           // of the judgements
    std::string sha256;                 // the same file, as metrics name what they were fitted to
    std::optional<ScanRecord> scanned;  // what the judgements are on, if they are those of `votes`
    ObtainedDistances obtained;
    pipeline::ScoreResult result;
    double judgement_seconds = 0;

    const pipeline::Provenance& provenance() const { return obtained.distances.provenance; }
    double total_seconds() const {
        return judgement_seconds + provenance().seconds.total + result.refine_seconds +
               result.score_seconds;
    }
};

/// What the metric says of the judgements, if its parameters were fitted to this very file.
const engine::FittedTo* fitted_to(const pipeline::MetricProvenance& metric, const Outcome& o) {
    const auto found = std::ranges::find(metric.fitted, o.sha256, &engine::FittedTo::sha256);
    return found == metric.fitted.end() ? nullptr : &*found;
}

ordered_json metric_json(const scan::MetricScore& metric) {
    return {{"majorities", estimate_json(metric.majorities)},
            {"votes", estimate_json(metric.votes)},
            {"slope", estimate_json(metric.slope)},
            {"log_likelihood_per_vote", estimate_json(metric.log_likelihood)},
            {"log_likelihood", figure_json(metric.total_log_likelihood)},
            {"ties", metric.ties},
            {"undecided", metric.undecided},
            {"zero_distances", metric.zero_distances},
            {"selected", metric.selected}};
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

std::string summary_json(const Options& options, const Outcome& o) {
    const auto& j = o.result.judgements;
    ordered_json unknown = ordered_json::object();
    for (const auto& [name, rows] : j.unknown) {
        unknown[as_utf8(name)] = rows;
    }
    const auto described = metrics_json(o.provenance());
    ordered_json metrics = ordered_json::array();
    for (std::size_t m = 0; m < o.result.score.metrics.size(); ++m) {
        metrics.push_back(described[m]);
        metrics.back().update(metric_json(o.result.score.metrics[m]));
        metrics.back()["refined_distances"] = o.result.refined.empty() ? 0 : o.result.refined[m];
        metrics.back()["fitted_to_judgements"] = fitted_to(o.provenance().metrics[m], o) != nullptr;
    }
    ordered_json json = program_json();
    json["judgements"] = {
        {"file", as_utf8(options.judgements)},
        {"format", o.file.format},
        {"content_hash", o.content_hash},
        {"sha256", o.sha256},
        {"rows", j.rows},
        {"rows_with_unknown_materials", j.rows_with_unknown},
        {"unknown_materials", unknown},
        {"configurations", o.result.score.judgements},
        {"without_votes", j.without_votes},
        {"untied", o.result.score.untied},
        {"votes", o.result.score.votes},
        {"equal_votes", o.result.score.equal_votes},
        {"selected_by", o.scanned ? ordered_json(o.scanned->selected_by) : ordered_json::array()}};
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

std::string judgements_text(const Outcome& o) {
    return fmt::format(
        "{}, {} with a majority; {}{}", counted(o.result.score.judgements, "configuration"),
        fmt::group_digits(o.result.score.untied), counted(o.result.score.votes, "vote"),
        o.result.score.equal_votes == 0
            ? ""
            : fmt::format(", {} of them equal", fmt::group_digits(o.result.score.equal_votes)));
}

void print_unknown(const scan::Judgements& judgements) {
    constexpr std::size_t named = 5;
    std::string names;
    for (std::size_t i = 0; i < std::min(named, judgements.unknown.size()); ++i) {
        names += (i == 0 ? "" : ", ") + judgements.unknown[i].name;
    }
    if (!judgements.unknown.empty()) {
        print_result(
            "unknown",
            fmt::format("{}, in {} of {}: {}{}", counted(judgements.unknown.size(), "material"),
                        fmt::group_digits(judgements.rows_with_unknown),
                        counted(judgements.rows, "row"), names,
                        judgements.unknown.size() > named ? " … (summary.json)" : ""));
    }
}

/// A metric as it is called in tables.
std::string label(const scan::MetricScore& metric) {
    return metric.name + (metric.selected ? " *" : "");
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
                               estimate_text(metric.slope),
                               metric.opposed()
                                   ? fmt::format("{:.3f} [opposed]", metric.log_likelihood.value)
                                   : estimate_text(metric.log_likelihood)));
    }
    if (std::ranges::any_of(score.metrics, &scan::MetricScore::opposed)) {
        print_line(
            "[opposed]: the slope is below 0, people do the opposite; what the metric says "
            "is no better than chance");
    }
    if (std::ranges::any_of(score.metrics, &scan::MetricScore::selected)) {
        print_line("* circular: what was judged are disagreements of this metric with another");
    }
}

/// What the bounds of float32 left open, and what became of it.
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
                         fmt::format("{}: {} configurations, computed in float32 without a bound "
                                     "that tells",
                                     metric.name, fmt::group_digits(metric.undecided)));
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

void print_unjudged(const scan::Judgements& judgements) {
    if (judgements.without_votes > 0) {
        print_result(
            "", counted(judgements.without_votes, "configuration") + " without a vote left out");
    }
}

void print_summary(const Options& options, const Outcome& o) {
    print_result("judgements", fmt::format("{}, {}", options.judgements, o.file.format));
    print_result("", judgements_text(o));
    print_unjudged(o.result.judgements);
    print_unknown(o.result.judgements);
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

void read_judgements(const Options& options, Outcome& o, const pipeline::Control& control) {
    const std::string text = scan::read_input(options.judgements);
    o.content_hash = hash_of(text);
    o.sha256 = sha256_of(text);
    // The published indices are those of the 100 MERL materials, whatever the database has of them.
    const auto merl = scan::lagunas_order(engine::merl_materials());
    o.file =
        scan::parse_judgements(text, options.judgements, merl, control.stage("reading judgements"));
}

/// Whether the options say which materials are scored.
bool names_materials(const DistanceOptions& options) {
    return !options.database.database.empty() || !options.distances.empty();
}

/// Where distances come from: what the options say, otherwise the database whose spheres were
/// judged, if that is known.
DistanceOptions distance_options(const Options& options, const Outcome& o) {
    DistanceOptions distances = options.distances;
    if (o.scanned && !names_materials(distances)) {
        if (o.scanned->source.contains("distances")) {
            throw InputError(fmt::format(
                "{}: the judged selection is of distances from a table; name it with --distances, "
                "or with --database the database to score",
                o.scanned->summary));
        }
        distances.database = recorded_options(*o.scanned, options.distances.database);
    }
    return distances;
}

/// Finds out what was judged. Judgements of `votes` that were edited may be of any database.
void find_what_was_judged(const Options& options, Outcome& o) {
    auto found = find_scan_record(options.judgements, "judgements.csv", o.content_hash, nullptr);
    o.scanned = std::move(found.record);
    if (found.is_of_another_file && !names_materials(options.distances)) {
        throw InputError(
            fmt::format("{}, so nothing says which database {} is of; --database names it: a "
                        "directory, or {}",
                        found.why_not, options.judgements, engine::kBuiltIn));
    }
}

/// Distances of other materials than those that were judged are an error, unless the user has named
/// the database. Judgements from elsewhere are scored with the stand-in, which is said.
void compare_with_scan(const Options& options, Outcome& o) {
    if (!o.scanned && !names_materials(options.distances)) {
        warn(o.obtained.distances,
             fmt::format("{} does not say which materials were judged: they are scored with the "
                         "built-in stand-in; --database names another, or {}",
                         options.judgements, engine::kBuiltIn));
    }
    if (!o.scanned || !o.scanned->has_database() || !o.obtained.database ||
        o.provenance().database->content_hash == o.scanned->content_hash) {
        return;
    }
    if (options.distances.database.database.empty()) {
        throw InputError(fmt::format(
            "{}: the content is not what was scanned and judged, as {} says; --database "
            "names a database to score all the same",
            o.obtained.database->name(), o.scanned->summary));
    }
    warn(o.obtained.distances,
         fmt::format("{} has other content than the database that was judged, as {} says",
                     o.obtained.database->name(), o.scanned->summary));
}

/// Whether a metric is one of those whose disagreements were judged.
bool selected(const Outcome& o, const std::string& metric) {
    return o.scanned && std::ranges::find(o.scanned->selected_by, as_utf8(metric)) !=
                            o.scanned->selected_by.end();
}

/// What was judged are disagreements of two metrics: of those it says nothing else.
void warn_of_circular_scores(Outcome& o) {
    const auto& metrics = o.obtained.distances.table.metrics;
    if (std::ranges::any_of(metrics, [&](const auto& m) { return selected(o, m.metric); })) {
        warn(o.obtained.distances,
             fmt::format("what was judged are disagreements of {}, as {} says: their scores are "
                         "circular and say only which of the two is right where they disagree; "
                         "what one gains the other loses, and neither can be compared with other "
                         "metrics or other judgements",
                         fmt::join(o.scanned->selected_by, " and "), o.scanned->summary));
    }
}

/// Says which metrics have seen the answers.
void warn_of_fitted(const Options& options, Outcome& o) {
    for (const auto& metric : o.provenance().metrics) {
        if (const auto* data = fitted_to(metric, o)) {
            warn(o.obtained.distances,
                 fmt::format("{} was fitted to {} ({}): its figures say how well it fits these "
                             "judgements, not how well it predicts others",
                             metric.name, options.judgements, data->citation));
        }
    }
}

/// What the plot says below its title.
std::string subtitle(const Options& options, const Outcome& o) {
    const auto name = std::filesystem::path(options.judgements).filename().string();
    const auto& database = o.provenance().database;
    return fmt::format("{}: {}{}", name, judgements_text(o),
                       database && database->kind == engine::built_in_kind
                           ? "; distances of " + database->name
                           : "");
}

int run(const Options& options) {
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
    read_judgements(options, o, control);
    find_what_was_judged(options, o);
    o.judgement_seconds = watch.lap();
    o.obtained = obtain_distances(distance_options(options, o), kMetrics, control);
    compare_with_scan(options, o);
    warn_of_circular_scores(o);
    warn_of_fitted(options, o);
    o.result =
        pipeline::score_distances(o.obtained.distances.table, o.file, o.obtained.database.get(),
                                  o.obtained.metrics, options.distances.memory, control);
    for (auto& metric : o.result.score.metrics) {
        metric.selected = selected(o, metric.name);
    }
    warn_if_all_are_zero(o.obtained.distances);
    out.finish();
    terminal.clear();
    if (!options.quiet) {
        print_summary(options, o);
    }
    return kSuccess;
}

}  // namespace

void add_score(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "score", "How well distances predict what people say about the similarity of materials");
    command
        ->add_option("--judgements", options->judgements,
                     "What people said: a CSV file with the columns reference,a,b,votes_a,votes_b "
                     "or left_1,left_2,right_1,right_2,votes_left,votes_equal,votes_right, or the "
                     "JSON of Lagunas et al. 2019")
        ->required()
        ->transform(not_empty());
    add_distance_options(*command, options->distances, kMetrics);
    add_output_options(*command, options->out, options->force);
    add_quiet_option(*command, options->quiet);
    command->footer(
        "Writes score.csv, score_pairs.csv, score.svg and summary.json (docs/scoring.md). Without\n"
        "--database and --distances, the judgements.csv of `votes` is scored with the database "
        "whose\n"
        "spheres were judged.\n"
        "\n"
        "Examples:\n"
        "  merl-scan score --judgements votes.csv\n"
        "  merl-scan score --judgements lagunas.json --database ~/merl/brdfs --metrics all\n"
        "  merl-scan score --judgements votes.csv --distances network.csv --out network-score");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
