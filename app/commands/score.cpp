#include "scan/score/score.h"

#include <fmt/format.h>

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

#include "app/cli/exit_status.h"
#include "app/cli/interrupt.h"
#include "app/cli/options.h"
#include "app/cli/progress.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/output/describe.h"
#include "app/output/output_directory.h"
#include "app/pages/score_plot.h"
#include "app/pipeline/obtain_distances.h"
#include "app/pipeline/refine.h"
#include "app/pipeline/scan_database.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "engine/database/abc_database.h"
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
    scan::BootstrapOptions bootstrap;
    bool force = false;
    bool quiet = false;
};

/// Wall-clock seconds of the stages, which follow each other.
struct Seconds {
    double judgements = 0;
    double device = 0;
    double distances = 0;
    double refine = 0;
    double score = 0;
    double total() const { return judgements + device + distances + refine + score; }
};

struct Outcome {
    std::string format;  // of the judgements
    std::string content_hash;
    scan::Judgements judgements;
    std::optional<ScanRecord> scanned;  // what the judgements are on, if they are those of `votes`
    ObtainedDistances obtained;
    std::vector<std::uint64_t> refined;  // distances recomputed in float64, by metric
    scan::Score score;
    Seconds seconds;
};

ordered_json metric_json(const scan::MetricScore& metric) {
    return {{"majorities", estimate_json(metric.majorities)},
            {"votes", estimate_json(metric.votes)},
            {"slope", estimate_json(metric.slope)},
            {"log_likelihood_per_vote", estimate_json(metric.log_likelihood)},
            {"log_likelihood", figure_json(metric.total_log_likelihood)},
            {"ties", metric.ties},
            {"undecided", metric.undecided},
            {"zero_distances", metric.zero_distances}};
}

std::string summary_json(const Options& options, const Outcome& o) {
    const auto& j = o.judgements;
    ordered_json unknown = ordered_json::object();
    for (const auto& [name, rows] : j.unknown) {
        unknown[as_utf8(name)] = rows;
    }
    ordered_json metrics = ordered_json::array();
    for (std::size_t m = 0; m < o.score.metrics.size(); ++m) {
        metrics.push_back(o.obtained.described_metrics[m]);
        metrics.back().update(metric_json(o.score.metrics[m]));
        metrics.back()["refined_distances"] = o.refined.empty() ? 0 : o.refined[m];
    }
    ordered_json json = program_json();
    json["judgements"] = {{"file", as_utf8(options.judgements)},
                          {"format", o.format},
                          {"content_hash", o.content_hash},
                          {"rows", j.rows},
                          {"rows_with_unknown_materials", j.rows_with_unknown},
                          {"unknown_materials", unknown},
                          {"configurations", o.score.judgements},
                          {"untied", o.score.untied},
                          {"votes", o.score.votes},
                          {"equal_votes", o.score.equal_votes}};
    json.update(o.obtained.source);
    json.update(ordered_json{
        {"materials", o.obtained.table.materials()},
        {"bootstrap",
         {{"replicates", options.bootstrap.replicates},
          {"seed", options.bootstrap.seed},
          {"interval", "percentile, 95 %"},
          {"clusters", j.clusters},
          {"too_few", o.score.too_few.empty() ? ordered_json() : ordered_json(o.score.too_few)},
          {"reference_materials", j.references}}},
        {"ceiling",
         {{"votes", estimate_json(o.score.ceiling)},
          {"log_likelihood_per_vote", estimate_json(o.score.ceiling_log_likelihood)}}},
        {"metrics", metrics},
        {"options",
         {{"device", options.distances.device},
          {"memory_bytes", options.distances.memory},
          {"threads", options.distances.threads}}}});
    json.update(o.obtained.device);
    json["warnings"] = texts_json(o.obtained.warnings);
    json["seconds"] = {{"judgements", o.seconds.judgements}, {"device", o.seconds.device},
                       {"distances", o.seconds.distances},   {"refine", o.seconds.refine},
                       {"score", o.seconds.score},           {"total", o.seconds.total()}};
    return json_text(json);
}

std::string cluster_text(const scan::Judgements& judgements) {
    const std::uint32_t alone = judgements.clusters - judgements.references;
    const std::string references = counted(judgements.references, "reference material");
    const std::string others = counted(alone, "configuration");
    return alone == 0                   ? references
           : judgements.references == 0 ? others
                                        : fmt::format("{} and {} without", references, others);
}

std::string judgements_text(const Outcome& o) {
    return fmt::format(
        "{}, {} with a majority; {}{}", counted(o.score.judgements, "configuration"),
        fmt::group_digits(o.score.untied), counted(o.score.votes, "vote"),
        o.score.equal_votes == 0
            ? ""
            : fmt::format(", {} of them equal", fmt::group_digits(o.score.equal_votes)));
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

void print_metrics(const scan::Score& score) {
    std::size_t width = 6;
    for (const auto& metric : score.metrics) {
        width = std::max(width, printable(metric.name).size());
    }
    print_line("");
    print_line(fmt::format("{:<{}}  {:<22}  {:<22}  {:<22}  {}", "metric", width, "majorities",
                           "votes", "slope", "log-likelihood per vote"));
    for (const std::size_t m : best_first(score)) {
        const auto& metric = score.metrics[m];
        print_line(fmt::format("{:<{}}  {:<22}  {:<22}  {:<22}  {}", metric.name, width,
                               estimate_text(metric.majorities), estimate_text(metric.votes),
                               estimate_text(metric.slope), estimate_text(metric.log_likelihood)));
    }
}

/// What the bounds of float32 left open, and what became of it.
void print_precision(const Outcome& o) {
    const std::uint64_t refined =
        std::accumulate(o.refined.begin(), o.refined.end(), std::uint64_t{0});
    if (refined > 0) {
        print_result("refined", fmt::format("{} distances in float64, on which predictions rest",
                                            fmt::group_digits(refined)));
    }
    for (const auto& metric : o.score.metrics) {
        if (metric.undecided > 0) {
            print_result("undecided",
                         fmt::format("{}: {} configurations, computed in float32 without a bound "
                                     "that tells",
                                     metric.name, fmt::group_digits(metric.undecided)));
        }
    }
}

/// A p-value; one that is too small for a double comes as 0.
std::string p_text(double p) {
    return std::isnan(p) ? "from too few" : p < 1e-300 ? "< 1e-300" : fmt::format("= {:.2g}", p);
}

/// The best metric against every other: who is right where they disagree.
void print_pairs(const scan::Score& score) {
    const std::size_t best = best_first(score).front();
    if (score.pairs.empty()) {
        return;
    }
    print_line("");
    print_line(
        fmt::format("Where {} and another metric disagree, who is right (untied majorities):",
                    score.metrics[best].name));
    for (const std::size_t other : best_first(score)) {
        for (const auto& pair : score.pairs) {
            if ((pair.first != best || pair.second != other) &&
                (pair.first != other || pair.second != best)) {
                continue;
            }
            const bool first = pair.first == best;
            print_line(fmt::format("  against {}: {} to {}, p {}", score.metrics[other].name,
                                   fmt::group_digits(first ? pair.first_right : pair.second_right),
                                   fmt::group_digits(first ? pair.second_right : pair.first_right),
                                   p_text(pair.p_value)));
        }
    }
}

void print_summary(const Options& options, const Outcome& o) {
    print_result("judgements", fmt::format("{}, {}", options.judgements, o.format));
    print_result("", judgements_text(o));
    print_unknown(o.judgements);
    for (const auto& [name, text] : o.obtained.source_lines) {
        print_result(name, text);
    }
    print_result("ceiling", estimate_text(o.score.ceiling) + " of the votes");
    print_result("intervals", fmt::format("95 %, {} bootstrap samples of {}, seed {}",
                                          fmt::group_digits(options.bootstrap.replicates),
                                          cluster_text(o.judgements), options.bootstrap.seed));
    if (!o.score.too_few.empty()) {
        print_result("too few", o.score.too_few + ", for intervals and p-values");
    }
    print_precision(o);
    for (const auto& [name, text] : o.obtained.device_lines) {
        print_result(name, text);
    }
    const auto& s = o.seconds;
    print_result("seconds",
                 fmt::format("{:.2f}: judgements {:.2f}, device {:.2f}, distances {:.2f}, "
                             "refine {:.2f}, score {:.2f}",
                             s.total(), s.judgements, s.device, s.distances, s.refine, s.score));
    print_result("results", options.out);
    print_metrics(o.score);
    print_pairs(o.score);
}

scan::JudgementFile read_judgements(const Options& options, Outcome& o) {
    const std::string text = scan::read_input(options.judgements);
    o.content_hash = hash_of(text);
    // The published indices are those of the 100 MERL materials, whatever the database has of them.
    const auto merl = scan::lagunas_order(engine::make_abc_database()->materials());
    Progress progress("reading judgements", options.quiet);
    return scan::parse_judgements(text, options.judgements, merl,
                                  [&](double share) { progress.update(share); });
}

/// Whether the options say which materials are scored.
bool names_materials(const DistanceOptions& options) {
    return !options.database.empty() || !options.distances.empty();
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
        distances.database = database_option(*o.scanned);
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
                        found.why_not, options.judgements, kBuiltIn));
    }
}

/// Distances of other materials than those that were judged are an error, unless the user has named
/// the database. Judgements from elsewhere are scored with the stand-in, which is said.
void compare_with_scan(const Options& options, Outcome& o) {
    if (!o.scanned && !names_materials(options.distances)) {
        warn(o.obtained,
             fmt::format("{} does not say which materials were judged: they are scored with the "
                         "built-in stand-in; --database names another, or {}",
                         options.judgements, kBuiltIn));
    }
    if (!o.scanned || !o.scanned->has_database() || !o.obtained.database ||
        o.obtained.source["database"]["content_hash"] == o.scanned->content_hash) {
        return;
    }
    if (options.distances.database.empty()) {
        throw InputError(fmt::format(
            "{}: the content is not what was scanned and judged, as {} says; --database "
            "names a database to score all the same",
            o.obtained.database->name(), o.scanned->summary));
    }
    warn(o.obtained,
         fmt::format("{} has other content than the database that was judged, as {} says",
                     o.obtained.database->name(), o.scanned->summary));
}

scan::Score compute_score(const Options& options, const Outcome& o) {
    std::vector<scan::ScoredMetric> metrics;
    for (const auto& column : o.obtained.table.metrics) {
        metrics.push_back({column.metric, column.values, column.bounds});
    }
    Progress progress("scoring", options.quiet);
    return scan::score(o.judgements, metrics, options.bootstrap,
                       [&](double share) { progress.update(share); });
}

int run(const Options& options) {
    const auto threads = limit_threads(options.distances.threads);
    OutputDirectory out(options.out, options.force,
                        {"score.csv", "score_pairs.csv", "score.svg", "summary.json"},
                        {options.judgements, options.distances.distances});
    Outcome o;
    Stopwatch watch;
    const auto file = read_judgements(options, o);
    o.format = file.format;
    find_what_was_judged(options, o);
    o.seconds.judgements = watch.lap();
    o.obtained = obtain_distances(distance_options(options, o), kMetrics, options.quiet);
    compare_with_scan(options, o);
    o.seconds.device = o.obtained.device_seconds;
    o.seconds.distances = o.obtained.distance_seconds;
    watch.lap();
    o.judgements = scan::resolve_judgements(file, o.obtained.table.names);
    if (o.obtained.database) {
        Progress progress("refining", options.quiet);
        o.refined =
            refine_judged(o.obtained.table, o.judgements, *o.obtained.database, o.obtained.metrics,
                          options.distances.memory, [&](double share) { progress.update(share); });
    }
    warn_if_all_are_zero(o.obtained);
    o.seconds.refine = watch.lap();
    o.score = compute_score(options, o);
    o.seconds.score = watch.lap();
    throw_if_interrupted();
    out.write("score.csv", [&](int f) { scan::write_scores(f, o.score); });
    out.write("score_pairs.csv", [&](int f) { scan::write_pair_scores(f, o.score); });
    const auto name = std::filesystem::path(options.judgements).filename().string();
    const bool is_stand_in =
        o.obtained.database && o.obtained.database->kind() == engine::built_in_kind;
    const std::string subtitle =
        fmt::format("{}: {}{}", name, judgements_text(o),
                    is_stand_in ? "; distances of " + o.obtained.database->name() : "");
    out.write("score.svg", [&](int f) { scan::write_all(f, score_svg(o.score, subtitle)); });
    const std::string summary = summary_json(options, o);
    out.write("summary.json", [&](int f) { scan::write_all(f, summary); });
    throw_if_interrupted();
    out.commit();
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
    add_bootstrap_options(*command, options->bootstrap);
    command->add_flag("--quiet", options->quiet, "No progress and no summary");
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
