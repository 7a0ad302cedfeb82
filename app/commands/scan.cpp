#include "app/pipeline/scan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/commands/obtain_distances.h"
#include "app/commands/refining_notice.h"
#include "app/commands/scan_options.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "app/output/tile_folder.h"
#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "engine/base/text.h"
#include "scan/io/csv.h"
#include "scan/select/scan_tables.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

const MetricNeeds kMetrics = {.from_database = "cwcbrt,pawcielab", .least = 2, .most = 2};

struct Outcome {
    pipeline::PairDistances distances;  // without its table, which `result` has
    pipeline::ScanResult result;
    Lines source;
    ordered_json files = ordered_json::object();  // hashes of those that are read again
    double write_seconds = 0;

    double total_seconds() const {
        const auto& s = result.seconds;
        return distances.provenance.seconds.total + s.refine + s.count + s.select + s.list +
               write_seconds;
    }
};

std::string summary_json(const ScanCommandOptions& options, const Outcome& o) {
    const auto& d = o.result.distances;
    ordered_json strongest;
    if (o.result.strongest) {
        strongest = configuration_json(d.names, *o.result.strongest);
    }
    ordered_json counts = counts_json(o.result.census.counts);
    counts["counted_by"] = counted_by(o.result.census.streamed);
    ordered_json open = ordered_json::array();
    for (const auto& one : o.result.open) {
        open.push_back({{"left", pair_json(d.names, one.left)},
                        {"right", pair_json(d.names, one.right)},
                        {"metric", as_utf8(one.metric)}});
    }
    ordered_json json = program_json();
    json["metrics"] = {as_utf8(d.first_metric), as_utf8(d.second_metric)};
    json.update(source_json(o.distances.provenance));
    json.update(ordered_json{
        {"materials", d.materials()},
        {"pairs", d.pairs()},
        {"configurations", o.result.census.counts.configurations},
        {"disagreements", o.result.census.counts.disagreements()},
        {"disagreements_between",
         {{"least", o.result.bounded.least}, {"greatest", o.result.bounded.greatest()}}},
        {"rate", o.result.census.counts.disagreement_rate()},
        {"counts", counts},
        {"exact", o.result.exact},
        {"exact_selection", o.result.selection_is_exact},
        {"undecided_in_float32", o.result.undecided},
        {"undecided", {{"configurations", o.result.left_open}, {"listed", open}}},
        {"refined_distances",
         {{as_utf8(d.first_metric), o.result.refined.first},
          {as_utf8(d.second_metric), o.result.refined.second}}},
        {"refined_by", refined_by_json(o.distances.provenance)},
        {"strongest_disagreement", strongest},
        {"selection", selection_json(o.result.selection)},
        {"disagreements_written", o.result.disagreements.size()},
        {"options", scan_options_json(options)}});
    json.update(engines_json(o.distances.provenance));
    json["warnings"] = texts_json(o.distances.provenance.warnings);
    json["files"] = o.files;
    const auto& s = o.result.seconds;
    json["seconds"] = {{"device", o.distances.provenance.seconds.opening},
                       {"distances", o.distances.provenance.seconds.without_opening()},
                       {"refine", s.refine},
                       {"count", s.count},
                       {"select", s.select},
                       {"list", s.list},
                       {"write", o.write_seconds},
                       {"total", o.total_seconds()}};
    return json_text(json);
}

/// What was counted or, where bounds leave some of it open, between which numbers the exact one is.
std::string disagreements_text(const pipeline::ScanResult& result) {
    const auto& counts = result.census.counts;
    const auto& [least, undecided] = result.bounded;
    if (undecided == 0 || !result.unbounded.empty()) {
        return fmt::format("{} ({:.2f} %)", fmt::group_digits(counts.disagreements()),
                           100 * counts.disagreement_rate());
    }
    const auto percent = [&](std::uint64_t disagreements) {
        return 100 * static_cast<double>(disagreements) /
               static_cast<double>(counts.configurations);
    };
    return fmt::format("{} to {} ({:.2f} to {:.2f} %)", fmt::group_digits(least),
                       fmt::group_digits(least + undecided), percent(least),
                       percent(least + undecided));
}

void print_summary(const ScanCommandOptions& options, const Outcome& o) {
    const auto& d = o.result.distances;
    const auto& counts = o.result.census.counts;
    print_results(o.source);
    print_result("metrics", fmt::format("{}, {}", d.first_metric, d.second_metric));
    print_result("pairs", fmt::format("{}", fmt::group_digits(d.pairs())));
    print_result("configurations", fmt::format("{}", fmt::group_digits(counts.configurations)));
    print_result("disagreements", disagreements_text(o.result));
    if (o.result.strongest) {
        print_result("strongest", fmt::format("{} against {}, agreement {:.6f}",
                                              pair_text(d.names, o.result.strongest->left),
                                              pair_text(d.names, o.result.strongest->right),
                                              o.result.strongest->agreement));
    }
    if (!o.result.selection.empty()) {
        print_result("selection", selection_text(o.result.selection));
    }
    if (!o.result.exact) {
        print_result("undecided", o.result.unbounded.empty()
                                      ? fmt::format("{}, closer than their bounds",
                                                    counted(o.result.left_open, "configuration"))
                                      : fmt::format("{}: no error bound is known for {}",
                                                    counted(o.result.undecided, "configuration"),
                                                    fmt::join(o.result.unbounded, " and ")));
    }
    const auto& refined = o.result.refined;
    if (o.result.exact && o.distances.provenance.database) {
        print_result(
            "refined",
            fmt::format("{} + {} distances in float64; {} {} closer than their bounds",
                        refined.first, refined.second, counted(o.result.undecided, "configuration"),
                        o.result.undecided == 1 ? "was" : "were"));
    } else if (refined.first + refined.second > 0) {
        print_result("refined",
                     fmt::format("{} + {} distances in float64, on which the selection rests",
                                 refined.first, refined.second));
    }
    print_results(engine_lines(o.distances.provenance));
    const auto& s = o.result.seconds;
    print_result(
        "seconds",
        fmt::format(
            "{:.2f}: device {:.2f}, distances {:.2f}, refine {:.2f}, count {:.3f}, select {:.3f}, "
            "list {:.2f}, write {:.2f}",
            o.total_seconds(), o.distances.provenance.seconds.opening,
            o.distances.provenance.seconds.without_opening(), s.refine, s.count, s.select, s.list,
            o.write_seconds));
    print_result("results", options.out);
}

/// Takes the table out of what was obtained.
pipeline::ScanResult compute(const ScanCommandOptions& options, ObtainedDistances& obtained,
                             const pipeline::Control& control) {
    auto scan_options = options.of_pipeline();
    scan_options.engines = obtained.engines.get();
    auto followed = control;
    // Of what is read nothing is refined.
    RefiningNotice notice(obtained.database ? obtained.database->grid().voxels() : 1,
                          !options.fast);
    if (!options.quiet) {
        scan_options.before_refining = [&](std::uint64_t distances, std::uint64_t of) {
            notice.begin(distances, of);
        };
        followed.progress = [&](std::string_view stage, double share) {
            control.progress(stage, share);
            notice.update(stage, share);
        };
    }
    try {
        return pipeline::scan_distances(std::exchange(obtained.distances.table, {}),
                                        obtained.database.get(), obtained.metrics, scan_options,
                                        followed);
    } catch (const pipeline::TooManyDisagreements& error) {
        throw Error(
            Fault::usage,
            fmt::format("{}; give --disagreements N for the N strongest, or 0", error.what()));
    }
}

int run(const ScanCommandOptions& options) {
    const auto threads = limit_threads(options.distances.threads);
    TerminalControl terminal(options.quiet);
    const auto control = terminal.control();
    Outcome o;
    Stopwatch writing;
    OutputDirectory out(
        options.out, options.force,
        {{.name = "pairs.csv",
          .write =
              [&](int file) {
                  scan::write_pairs(file, o.result.distances, control.stage("writing"));
              },
          .is_read_again = true},
         {.name = "disagreements.csv",
          .write =
              [&](int file) {
                  scan::write_disagreements(file, o.result.distances, o.result.disagreements,
                                            control.stage("writing"));
              }},
         {.name = "selection.csv",
          .write =
              [&](int file) {
                  scan::write_selection(file, o.result.distances, o.result.selection);
              },
          .is_read_again = true},
         {.name = "summary.json",
          .write =
              [&](int file) {
                  o.files = texts_json(out.hashes());
                  o.write_seconds = writing.lap();
                  scan::write_all(file, summary_json(options, o));
              }}},
        {options.distances.distances});
    auto obtained = obtain_distances(options.distances, kMetrics, control);
    o.source = source_lines(obtained.distances);
    o.result = compute(options, obtained, control);
    o.distances = std::move(obtained.distances);
    warn_if_all_are_zero(o.distances.provenance, o.result.distances.first_metric,
                         o.result.distances.first);
    warn_if_all_are_zero(o.distances.provenance, o.result.distances.second_metric,
                         o.result.distances.second);
    writing.lap();
    out.finish();
    terminal.clear();
    if (!options.quiet) {
        print_summary(options, o);
    }
    return kSuccess;
}

}  // namespace

ordered_json scan_options_json(const ScanCommandOptions& options) {
    ordered_json json = {
        {"select", options.select},
        {"per_material", options.per_material},
        {"disagreements", options.disagreements ? ordered_json(*options.disagreements) : "all"}};
    json.update(computing_options_json(options.distances));
    return json;
}

void add_scan(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<ScanCommandOptions>();
    auto* command = program.add_subcommand(
        "scan",
        "All pair distances under two metrics, all disagreements, and the configurations for "
        "judges");
    add_distance_options(*command, options->distances, kMetrics);
    auto* reference =
        command
            ->add_option("--reference", options->reference,
                         "The label of originals: scan only them against the materials of the same "
                         "name in the other databases, which approximate them")
            ->transform(not_empty());
    auto* spheres = command->add_option(
        "--spheres", options->spheres,
        "With --reference: show in the page the spheres of the N originals on which the first two "
        "metrics disagree most, and of their approximations; 0 renders none");
    spheres->needs(reference);
    add_output_options(*command, options->out, options->force);
    constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max();
    spheres->transform(whole_number(0, kMost))->capture_default_str();
    command->add_option("--select", options->select, "Configurations for judges")
        ->transform(whole_number(0, kMost))
        ->capture_default_str();
    command
        ->add_option("--per-material", options->per_material,
                     "In how many of them a material may take part")
        ->transform(whole_number(0, kMost))
        ->capture_default_str();
    command
        ->add_option("--disagreements", options->disagreements,
                     "Write only the strongest N disagreements, 0 for none (default: all)")
        ->transform(whole_number(0, std::numeric_limits<std::uint64_t>::max()));
    command->add_flag("--fast", options->fast,
                      "Refine only what the selection rests on: the number of disagreements is "
                      "between bounds (with --reference: refine nothing)");
    add_quiet_option(*command, options->quiet);
    command->footer(
        std::string("Writes pairs.csv, disagreements.csv, selection.csv and summary.json "
                    "(docs/file-formats.md).\n"
                    "\n") +
        kMetricsHelp +
        "With --reference there may be more than two: the first two decide the configurations,\n"
        "and approximations.csv, instead of pairs.csv, has the distances and ranks under all;\n"
        "approximations.html shows them.\n"
        "What a file's metric leaves open in float32 stays open.\n"
        "\n" +
        kDatabaseHelp +
        "\n"
        "Examples:\n"
        "  merl-scan scan\n"
        "  merl-scan scan --database ~/merl/brdfs --out results\n"
        "  merl-scan scan --database ~/merl --database mine=~/fits --out results\n"
        "  merl-scan scan --database measured=~/merl --database abc --reference measured\n"
        "  merl-scan scan --database ~/merl --materials 'gold-*,chrome,@list.txt'\n"
        "  merl-scan scan --metrics rmse,pawcielab --disagreements 1000 --out rmse-results\n"
        "  merl-scan scan --metrics pawcielab,./my_metric.glsl:alpha=0.3\n"
        "  merl-scan scan --distances network.csv --metrics lpips,cwcbrt --out results\n"
        "  merl-scan scan --select 20 --per-material 3 --device llvmpipe --memory 256M --force");
    command->callback([&chosen, options] {
        if (options->fast && !options->distances.distances.empty() &&
            !is_tile_folder(options->distances.distances)) {
            throw CLI::ExcludesError("--distances", "--fast");  // of a table all is exact
        }
        chosen = [options] {
            return options->reference.empty() ? run(*options) : run_reference_scan(*options);
        };
    });
}

}  // namespace merl::app
