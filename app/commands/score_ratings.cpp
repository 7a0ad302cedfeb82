#include "app/commands/score_ratings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "app/pipeline/rating_score.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/number.h"
#include "engine/base/stopwatch.h"
#include "engine/base/text.h"
#include "engine/database/model_database.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"
#include "scan/score/rating_file.h"
#include "scan/score/rating_score.h"
#include "scan/score/rating_tables.h"
#include "scan/score/ratings.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// A file that was read.
struct Source {
    std::string file;
    std::string content_hash;
    std::string sha256;
};

struct Outcome {
    scan::RatingFile file;
    Source source;
    std::optional<Source> names;
    scan::Ratings ratings;
    ObtainedListedDistances obtained;
    pipeline::RatingScoreResult result;
    double rating_seconds = 0;

    const pipeline::Provenance& provenance() const { return obtained.distances.provenance; }
    const scan::RatingScore& score() const { return result.score; }
    double total_seconds() const {
        return rating_seconds + provenance().seconds.total + result.refine_seconds +
               result.score_seconds;
    }
};

/// What --scale says.
std::optional<scan::RatingScale> scale_of(const std::string& text) {
    if (text.empty()) {
        return std::nullopt;
    }
    const auto colon = text.find(':');
    const std::string_view all = text;
    const auto low = parse_finite(all.substr(0, colon));
    const auto high =
        colon == std::string::npos ? std::nullopt : parse_finite(all.substr(colon + 1));
    if (!low || !high || *low >= *high ||
        std::max(std::abs(*low), std::abs(*high)) > scan::max_rating) {
        throw Error(
            Fault::usage,
            fmt::format("--scale: found \"{}\"; expected the least and the greatest rating, "
                        "like 1:5",
                        text));
    }
    return scan::RatingScale{*low, *high};
}

std::string read(const std::string& file, Source& source) {
    auto text = scan::read_input(file);
    source = {file, hash_of(text), sha256_of(text)};
    return text;
}

ordered_json file_json(const Source& source) {
    return {{"file", as_utf8(source.file)},
            {"content_hash", source.content_hash},
            {"sha256", source.sha256}};
}

std::uint64_t ratings_of(const scan::Ratings& ratings) {
    std::uint64_t count = 0;
    for (const auto& rated : ratings.list) {
        count += rated.ratings;
    }
    return count;
}

/// Approximations with more than one rating.
std::uint64_t averaged(const scan::Ratings& ratings) {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(ratings.list, [](const auto& rated) { return rated.ratings > 1; }));
}

ordered_json ratings_json(const Outcome& o) {
    ordered_json unknown = ordered_json::object();
    for (const auto& [name, rows, close] : o.ratings.unknown) {
        unknown[as_utf8(name)] = rows;
    }
    auto json = file_json(o.source);
    json["format"] = o.file.format;
    json["higher_is_better"] = o.file.higher_is_better;
    const auto& scale = o.file.scale;
    json["scale"] = scale ? ordered_json{scale->low, scale->high} : ordered_json();
    json["names"] = o.names ? file_json(*o.names) : ordered_json();
    json["names_without_use"] = texts_json(o.ratings.unused_names);
    json["rows"] = o.ratings.rows;
    json["rows_with_unknown_names"] = o.ratings.rows_with_unknown;
    json["unknown_names"] = unknown;
    json["rows_of_originals"] = o.ratings.rows_of_originals;
    json["ratings"] = ratings_of(o.ratings);
    json["rated_approximations"] = o.ratings.list.size();
    json["averaged_approximations"] = averaged(o.ratings);
    json["approximation_names"] = texts_json(o.ratings.names);
    return json;
}

ordered_json figures_json(const scan::RatingFigures& figures) {
    return {{"spearman", estimate_json(figures.spearman)},
            {"kendall", estimate_json(figures.kendall)},
            {"pairs", estimate_json(figures.pairs)},
            {"pairs_apart", estimate_json(figures.pairs_apart)}};
}

ordered_json clusters_json(const scan::RatingClusters& clusters, const char* observations) {
    return {
        {observations, clusters.observations},
        {"originals", clusters.originals},
        {"effective_clusters", figure_json(clusters.effective)},
        {"too_few", clusters.too_few.empty() ? ordered_json() : ordered_json(clusters.too_few)}};
}

ordered_json name_alone_json(const scan::RatingScore& score) {
    if (!score.name_alone) {
        return nullptr;
    }
    ordered_json json = {{"approximations", score.name_alone->approximations},
                         {"originals", score.name_alone->originals}};
    json.update(figures_json(score.name_alone->figures));
    return json;
}

ordered_json scores_json(const Outcome& o) {
    auto metrics = metrics_json(o.provenance());
    const auto refined_by = refined_by_json(o.provenance());
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        const auto& metric = o.score().metrics[m];
        metrics[m].update(figures_json(metric.figures));
        metrics[m]["ties"] = metric.ties;
        metrics[m]["undecided"] = metric.undecided;
        metrics[m]["fitted_to_ratings"] = metric.fitted;
        metrics[m]["refined_distances"] = o.result.refined.empty() ? 0 : o.result.refined[m];
        metrics[m]["refined_by"] = refined_by[as_utf8(o.provenance().metrics[m].name)];
    }
    return metrics;
}

std::string summary_json(const ScoreOptions& options, const Outcome& o) {
    ordered_json json = program_json();
    json["ratings"] = ratings_json(o);
    json.update(source_json(o.provenance()));
    auto given = computing_options_json(options.distances);
    given["reference"] = options.ratings.reference.empty()
                             ? ordered_json()
                             : ordered_json(as_utf8(options.ratings.reference));
    json.update(ordered_json{{"materials", o.obtained.distances.table.materials()},
                             {"intervals",
                              {{"level", 0.95},
                               {"clusters", "originals"},
                               {"correlations", clusters_json(o.score().all, "approximations")},
                               {"pairs", clusters_json(o.score().pairs, "pairs")},
                               {"pairs_apart", clusters_json(o.score().pairs_apart, "pairs")}}},
                             {"apart", o.score().apart},
                             {"pairs_rated_the_same", o.score().equal_pairs},
                             {"originals_with_one_approximation", o.score().single_originals},
                             {"metrics", scores_json(o)},
                             {"name_alone", name_alone_json(o.score())},
                             {"doubts", texts_json(o.score().doubts)},
                             {"options", given}});
    json.update(engines_json(o.provenance()));
    json["warnings"] = texts_json(o.provenance().warnings);
    json["seconds"] = {{"ratings", o.rating_seconds},
                       {"device", o.provenance().seconds.opening},
                       {"distances", o.provenance().seconds.without_opening()},
                       {"refine", o.result.refine_seconds},
                       {"score", o.result.score_seconds},
                       {"total", o.total_seconds()}};
    return json_text(json);
}

/// Names that stand for nothing, as lines of a summary.
Lines unknown_lines(const scan::Ratings& ratings) {
    constexpr std::size_t named = 5;
    if (ratings.unknown.empty()) {
        return {};
    }
    std::string names;
    for (std::size_t i = 0; i < std::min(named, ratings.unknown.size()); ++i) {
        const auto& [name, rows, close] = ratings.unknown[i];
        names += fmt::format("{}{}{}", i == 0 ? "" : ", ", name,
                             close.empty() ? "" : fmt::format(" (there is {})", close));
    }
    return {{"unknown",
             fmt::format("{}, in {} of {}: {}{}", counted(ratings.unknown.size(), "name"),
                         fmt::group_digits(ratings.rows_with_unknown), counted(ratings.rows, "row"),
                         names, ratings.unknown.size() > named ? " … (summary.json)" : "")}};
}

Lines ratings_lines(const Outcome& o) {
    const auto& ratings = o.ratings;
    Lines lines = {
        {"ratings", fmt::format("{}, {}: the {} the better", o.source.file, o.file.format,
                                ratings.higher_is_better ? "higher" : "lower")},
        {"", fmt::format("{} of {}, called {}", counted(ratings.list.size(), "approximation"),
                         counted(o.score().all.originals, "original"),
                         ratings.names.size() > 8
                             ? fmt::format("{} names", fmt::group_digits(ratings.names.size()))
                             : fmt::format("{}", fmt::join(ratings.names, ", ")))}};
    if (const auto several = averaged(ratings); several > 0) {
        lines.emplace_back(
            "", fmt::format("{}; those of one approximation are averaged, of {}",
                            counted(ratings_of(ratings), "rating"), fmt::group_digits(several)));
    }
    if (ratings.rows_of_originals > 0) {
        lines.emplace_back("", fmt::format("{} of an original itself left out",
                                           counted(ratings.rows_of_originals, "rating")));
    }
    for (auto& line : unknown_lines(ratings)) {
        lines.push_back(std::move(line));
    }
    return lines;
}

/// A metric as it is called in tables.
std::string label(const scan::MetricRatingScore& metric) {
    return metric.name + (metric.fitted ? " +" : "");
}

void print_figures(const std::string& name, std::size_t width, const scan::RatingFigures& figures) {
    print_line(fmt::format("{:<{}}  {:<22}  {:<22}  {:<22}  {}", name, width,
                           estimate_text(figures.spearman), estimate_text(figures.kendall),
                           estimate_text(figures.pairs), estimate_text(figures.pairs_apart)));
}

void print_metrics(const Outcome& o) {
    const auto& score = o.score();
    std::size_t width = std::string_view(scan::name_alone_text).size();
    for (const auto& metric : score.metrics) {
        width = std::max(width, printable(label(metric)).size());
    }
    print_line("");
    print_line(fmt::format("{:<{}}  {:<22}  {:<22}  {:<22}  {}", "metric", width, "spearman",
                           "kendall", "pairs in order", "pairs apart"));
    for (const auto m : scan::best_first(score)) {
        print_figures(label(score.metrics[m]), width, score.metrics[m].figures);
    }
    if (score.name_alone) {
        print_figures(scan::name_alone_text, width, score.name_alone->figures);
        print_line(
            fmt::format("{}: the mean rating of what is called the same with other originals{}",
                        scan::name_alone_text,
                        score.name_alone->approximations == o.ratings.list.size()
                            ? ""
                            : fmt::format("; of {} of {} alone, the others have none",
                                          fmt::group_digits(score.name_alone->approximations),
                                          counted(o.ratings.list.size(), "approximation"))));
    }
    if (std::ranges::any_of(score.metrics, &scan::MetricRatingScore::fitted)) {
        print_line(
            "+ fitted to these ratings: how well it fits them, not how well it predicts others");
    }
}

/// The best metric against every other, and against the name alone.
void print_differences(const scan::RatingScore& score) {
    const auto best = scan::best_first(score).front();
    if (score.differences.empty()) {
        return;
    }
    print_line("");
    print_line(
        fmt::format("{} minus another, pairs in order; Spearman's:", label(score.metrics[best])));
    const auto text = [](const scan::Estimate& difference) {
        const bool open = difference.too_few.empty() && !scan::clear_of_zero(difference);
        return estimate_text(difference) + (open ? ", not clear of 0" : "");
    };
    const auto print = [&](const std::string& other, const scan::RatingDifference& row) {
        const bool turned = row.first != best;
        const auto of = [&](const scan::FigureDifference& figure) {
            return text(turned ? scan::negative(figure.estimate) : figure.estimate);
        };
        print_line(fmt::format("  against {}: {}; {}", other, of(row.pairs), of(row.spearman)));
    };
    for (const auto other : scan::best_first(score)) {
        for (const auto& row : score.differences) {
            if (row.second && other != best &&
                ((row.first == best && *row.second == other) ||
                 (row.first == other && *row.second == best))) {
                print(label(score.metrics[other]), row);
            }
        }
    }
    for (const auto& row : score.differences) {
        if (!row.second && row.first == best) {
            print(scan::name_alone_text, row);
        }
    }
}

void print_summary(const ScoreOptions& options, const Outcome& o) {
    const auto& score = o.score();
    print_results(ratings_lines(o));
    print_results(source_lines(o.provenance(), o.obtained.distances.table.materials()));
    print_result(
        "pairs",
        fmt::format("{} of one original that are rated differently, {} of them by more than {:.6g}",
                    fmt::group_digits(score.pairs.observations),
                    fmt::group_digits(score.pairs_apart.observations), score.apart));
    if (score.all.too_few.empty()) {
        print_result("intervals", "95 %, clusters are " + counted(score.all.originals, "original"));
    }
    for (const auto& doubt : score.doubts) {
        print_result("doubt", doubt);
    }
    const auto refined =
        std::accumulate(o.result.refined.begin(), o.result.refined.end(), std::uint64_t{0});
    if (refined > 0) {
        print_result("refined", fmt::format("{} distances in float64, on which ranks rest",
                                            fmt::group_digits(refined)));
    }
    for (const auto& metric : score.metrics) {
        if (metric.undecided > 0) {
            print_result("undecided",
                         fmt::format("{}: {}, nearer to others than its bound can tell, if it has "
                                     "one",
                                     metric.name, counted(metric.undecided, "approximation")));
        }
    }
    print_results(engine_lines(o.provenance()));
    print_result("seconds",
                 fmt::format("{:.2f}: ratings {:.2f}, device {:.2f}, distances {:.2f}, "
                             "refine {:.2f}, score {:.2f}",
                             o.total_seconds(), o.rating_seconds, o.provenance().seconds.opening,
                             o.provenance().seconds.without_opening(), o.result.refine_seconds,
                             o.result.score_seconds));
    print_result("results", options.out);
    print_metrics(o);
    print_differences(score);
}

/// Whether a label is of the built-in stand-in: its materials are fits themselves.
bool is_stand_in(const pipeline::Provenance& provenance, std::string_view label) {
    return provenance.database &&
           std::ranges::any_of(provenance.database->parts, [&](const auto& part) {
               return part.label == label && part.kind == engine::built_in_kind;
           });
}

void warn_of_stand_in(Outcome& o) {
    const auto& names = o.obtained.distances.table.names;
    const bool any = std::ranges::any_of(o.ratings.list, [&](const auto& rated) {
        const auto& name = names[rated.original];
        return is_stand_in(o.provenance(), name.substr(0, name.find('/')));
    });
    if (any) {
        warn(
            o.obtained.distances.provenance,
            fmt::format("originals are of the {}: distances are from fits, and people saw what was "
                        "measured",
                        engine::built_in_kind));
    }
}

void warn_of_names(Outcome& o) {
    const auto& unused = o.ratings.unused_names;
    if (!unused.empty()) {
        warn(o.obtained.distances.provenance,
             fmt::format("{}: {} of its names are not in the ratings, such as \"{}\"",
                         o.names->file, unused.size(), unused.front()));
    }
}

/// Marks the metrics that have seen the answers, and says which.
void mark_fitted(Outcome& o) {
    for (std::size_t m = 0; m < o.provenance().metrics.size(); ++m) {
        const auto& metric = o.provenance().metrics[m];
        const auto found =
            std::ranges::find(metric.fitted, o.source.sha256, &engine::FittedTo::sha256);
        if (found != metric.fitted.end()) {
            o.result.score.metrics[m].fitted = true;
            warn(o.obtained.distances.provenance,
                 fmt::format("{} was fitted to {} ({}): its figures say how well it fits these "
                             "ratings, not how well it predicts others",
                             metric.name, o.source.file, found->citation));
        }
    }
}

void read_ratings(const RatingOptions& options, const pipeline::Control& control, Outcome& o,
                  scan::RatingNaming& naming) {
    const auto scale = scale_of(options.scale);
    const auto text = read(options.ratings, o.source);
    o.file = scan::parse_ratings(text, options.ratings, scale, control.stage("reading ratings"));
    naming.reference = options.reference;
    if (!options.names.empty()) {
        const auto names = read(options.names, o.names.emplace());
        naming.names = scan::parse_rating_names(names, options.names);
    }
}

}  // namespace

CLI::Option* add_rating_options(CLI::App& command, RatingOptions& options) {
    auto* ratings =
        command
            .add_option("--ratings", options.ratings,
                        "How well approximations look like their originals: a CSV file with the "
                        "columns original, approximation, and rating (higher is better) or "
                        "difference (lower is better), or that of Lavoué et al. 2021")
            ->transform(not_empty());
    command
        .add_option("--names", options.names,
                    "What names in the ratings stand for: a CSV file with the columns "
                    "name_in_ratings,name")
        ->transform(not_empty())
        ->needs(ratings);
    command
        .add_option("--reference", options.reference,
                    "The label of the database that the originals of the ratings are of")
        ->transform(not_empty())
        ->needs(ratings);
    command
        .add_option("--scale", options.scale,
                    "The least and the greatest rating that there can be, like 1:5; others are an "
                    "error")
        ->transform(not_empty())
        ->needs(ratings);
    command
        .add_option("--differ-by", options.differ_by,
                    "Pairs of approximations are also scored without those whose ratings differ by "
                    "this or less (default: a tenth of the scale or, if none is stated, of the "
                    "range of the ratings)")
        ->transform(number(0, 1e300))
        ->needs(ratings);
    return ratings;
}

int score_ratings(const ScoreOptions& options) {
    const auto threads = limit_threads(options.distances.threads);
    TerminalControl terminal(options.quiet);
    const auto control = terminal.control();
    Outcome o;
    OutputDirectory out(
        options.out, options.force,
        {{.name = "ratings.csv",
          .write =
              [&](int file) {
                  scan::write_ratings(file, o.ratings, o.obtained.distances.table, o.score());
              }},
         {.name = "rating_scores.csv",
          .write = [&](int file) { scan::write_rating_scores(file, o.score()); }},
         {.name = "rating_differences.csv",
          .write = [&](int file) { scan::write_rating_differences(file, o.score()); }},
         {.name = "summary.json",
          .write = [&](int file) { scan::write_all(file, summary_json(options, o)); }}},
        {options.ratings.ratings, options.ratings.names, options.distances.distances});
    Stopwatch watch;
    scan::RatingNaming naming;
    read_ratings(options.ratings, control, o, naming);
    o.rating_seconds = watch.lap();
    const auto pairs_of = [&](std::span<const std::string> names) {
        o.ratings = scan::resolve_ratings(o.file, naming, names);
        return scan::rated_pairs(o.ratings);
    };
    o.obtained = obtain_listed_distances(options.distances, kScoreMetrics, pairs_of, control);
    warn_of_stand_in(o);
    warn_of_names(o);
    o.result = pipeline::score_ratings(
        o.obtained.distances.table, o.ratings, options.ratings.differ_by, o.obtained.database.get(),
        o.obtained.metrics, options.distances.memory, control, o.obtained.engines.get());
    mark_fitted(o);
    warn_if_all_are_zero(o.obtained.distances.provenance, o.obtained.distances.table.metrics);
    out.finish();
    terminal.clear();
    if (!options.quiet) {
        print_summary(options, o);
    }
    return kSuccess;
}

}  // namespace merl::app
