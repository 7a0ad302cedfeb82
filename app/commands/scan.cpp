#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/cli/exit_status.h"
#include "app/cli/interrupt.h"
#include "app/cli/open_metrics.h"
#include "app/cli/options.h"
#include "app/cli/progress.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/output/describe.h"
#include "app/output/output_directory.h"
#include "app/pipeline/obtain_distances.h"
#include "app/pipeline/refine.h"
#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "scan/io/csv.h"
#include "scan/pairs/census.h"
#include "scan/select/disagreements.h"
#include "scan/select/selection.h"
#include "scan/select/tables.h"
#include "scan/select/undecided.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

const MetricNeeds kMetrics = {.from_database = "cwcbrt,pawcielab", .least = 2, .most = 2};

struct Options {
    DistanceOptions distances;
    std::string out = "merl-scan-results";
    std::uint32_t select = 100;
    std::uint32_t per_material = 10;
    std::optional<std::uint64_t> disagreements;  // how many rows to write; all without
    bool fast = false;
    bool force = false;
    bool quiet = false;
};

/// Wall-clock seconds of the stages, which follow each other.
struct Seconds {
    double device = 0;  // opening it
    double distances = 0;
    double refine = 0;
    double count = 0;
    double select = 0;
    double list = 0;
    double write = 0;
    double total() const { return device + distances + refine + count + select + list + write; }
};

struct Outcome {
    scan::Distances distances;
    ObtainedDistances obtained;  // without its table
    Refined refined;
    bool exact = false;           // whether what float32 leaves open was refined
    std::string unbounded;        // the metrics whose float32 distances have no bound
    std::uint64_t undecided = 0;  // configurations that float32 leaves open; 0 after refining
    scan::Census census;
    std::vector<scan::Configuration> selection;
    std::vector<scan::Configuration> disagreements;
    std::optional<scan::Configuration> strongest;
    ordered_json files = ordered_json::object();  // hashes of those that are read again
    Seconds seconds;
};

std::string summary_json(const Options& options, const Outcome& o) {
    const auto& d = o.distances;
    ordered_json strongest;
    if (o.strongest) {
        strongest = configuration_json(d.names, *o.strongest);
    }
    ordered_json agreement_range;
    if (!o.selection.empty()) {
        agreement_range = {o.selection.front().agreement, o.selection.back().agreement};
    }
    ordered_json counts = counts_json(o.census.counts);
    counts["counted_by"] = counted_by(o.census.streamed);
    ordered_json json = program_json();
    json["metrics"] = {as_utf8(d.first_metric), as_utf8(d.second_metric)};
    json.update(o.obtained.source);
    json.update(ordered_json{
        {"materials", d.materials()},
        {"pairs", d.pairs()},
        {"configurations", o.census.counts.configurations},
        {"disagreements", o.census.counts.disagreements()},
        {"rate", o.census.counts.disagreement_rate()},
        {"counts", counts},
        {"exact", o.exact},
        {"undecided_in_float32", o.undecided},
        {"refined_distances",
         {{as_utf8(d.first_metric), o.refined.first},
          {as_utf8(d.second_metric), o.refined.second}}},
        {"strongest_disagreement", strongest},
        {"selection",
         {{"configurations", o.selection.size()}, {"agreement_range", agreement_range}}},
        {"disagreements_written", o.disagreements.size()},
        {"options",
         {{"select", options.select},
          {"per_material", options.per_material},
          {"disagreements", options.disagreements ? ordered_json(*options.disagreements) : "all"},
          {"device", options.distances.device},
          {"memory_bytes", options.distances.memory},
          {"threads", options.distances.threads}}}});
    json.update(o.obtained.device);
    json["warnings"] = texts_json(o.obtained.warnings);
    json["files"] = o.files;
    json["seconds"] = {{"device", o.seconds.device}, {"distances", o.seconds.distances},
                       {"refine", o.seconds.refine}, {"count", o.seconds.count},
                       {"select", o.seconds.select}, {"list", o.seconds.list},
                       {"write", o.seconds.write},   {"total", o.seconds.total()}};
    return json_text(json);
}

void print_summary(const Options& options, const Outcome& o) {
    const auto& d = o.distances;
    const auto& counts = o.census.counts;
    for (const auto& [name, text] : o.obtained.source_lines) {
        print_result(name, text);
    }
    print_result("metrics", fmt::format("{}, {}", d.first_metric, d.second_metric));
    print_result("pairs", fmt::format("{}", fmt::group_digits(d.pairs())));
    print_result("configurations", fmt::format("{}", fmt::group_digits(counts.configurations)));
    print_result("disagreements",
                 fmt::format("{} ({:.2f} %)", fmt::group_digits(counts.disagreements()),
                             100 * counts.disagreement_rate()));
    if (o.strongest) {
        print_result(
            "strongest",
            fmt::format("{} against {}, agreement {:.6f}", pair_text(d.names, o.strongest->left),
                        pair_text(d.names, o.strongest->right), o.strongest->agreement));
    }
    if (!o.selection.empty()) {
        print_result("selection", fmt::format("{} configurations, agreement {:.6f} to {:.6f}",
                                              o.selection.size(), o.selection.front().agreement,
                                              o.selection.back().agreement));
    }
    if (!o.exact) {
        print_result("undecided",
                     o.unbounded.empty()
                         ? fmt::format("{}, closer than float32 can tell",
                                       counted(o.undecided, "configuration"))
                         : fmt::format("{}: no error bound is known for {}",
                                       counted(o.undecided, "configuration"), o.unbounded));
    } else if (o.obtained.database) {
        print_result(
            "refined",
            fmt::format("{} + {} distances in float64; {} {} closer than float32 can tell",
                        o.refined.first, o.refined.second, counted(o.undecided, "configuration"),
                        o.undecided == 1 ? "was" : "were"));
    }
    for (const auto& [name, text] : o.obtained.device_lines) {
        print_result(name, text);
    }
    const auto& s = o.seconds;
    print_result(
        "seconds",
        fmt::format(
            "{:.2f}: device {:.2f}, distances {:.2f}, refine {:.2f}, count {:.3f}, select {:.3f}, "
            "list {:.2f}, write {:.2f}",
            s.total(), s.device, s.distances, s.refine, s.count, s.select, s.list, s.write));
    print_result("results", options.out);
}

/// Writes the tables; summary.json, the last, is what says that they are complete.
void write_results(OutputDirectory& out, const Outcome& o, bool quiet) {
    Progress progress("writing", quiet);
    out.write("pairs.csv", [&](int file) { scan::write_pairs(file, o.distances); });
    throw_if_interrupted();
    out.write("disagreements.csv", [&](int file) {
        scan::write_disagreements(file, o.distances, o.disagreements,
                                  [&](double share) { progress.update(share); });
    });
    throw_if_interrupted();
    out.write("selection.csv",
              [&](int file) { scan::write_selection(file, o.distances, o.selection); });
}

int run(const Options& options) {
    const auto threads = limit_threads(options.distances.threads);
    OutputDirectory out(options.out, options.force,
                        {"pairs.csv", "disagreements.csv", "selection.csv", "summary.json"},
                        {options.distances.distances});

    Outcome o;
    o.obtained = obtain_distances(options.distances, kMetrics, options.quiet);
    o.seconds.device = o.obtained.device_seconds;
    o.seconds.distances = o.obtained.distance_seconds;
    Stopwatch watch;
    o.distances = std::exchange(o.obtained.table, {}).distances(0, 1);
    o.undecided = scan::count_undecided(o.distances);
    const auto& metrics = o.obtained.metrics;
    o.exact = !options.fast &&
              std::ranges::all_of(metrics, [](const auto* metric) { return metric->has_twin(); });
    for (const auto* metric : metrics) {
        if (!metric->has_bound()) {
            o.unbounded += fmt::format("{}{}", o.unbounded.empty() ? "" : " and ", metric->name);
        }
    }
    if (o.exact && o.obtained.database) {
        Progress progress("refining", options.quiet);
        // The strongest disagreement is printed, so at least one is selected.
        o.refined = refine(o.distances, *o.obtained.database,
                           {o.obtained.metrics[0], o.obtained.metrics[1]},
                           std::max(1U, options.select), std::max(1U, options.per_material),
                           options.distances.memory, [&](double share) { progress.update(share); });
    }
    warn_if_all_are_zero(o.obtained, o.distances.first_metric, o.distances.first);
    warn_if_all_are_zero(o.obtained, o.distances.second_metric, o.distances.second);
    o.seconds.refine = watch.lap();
    o.census = scan::count_disagreements(o.distances);
    o.seconds.count = watch.lap();
    o.selection = scan::select_configurations(o.distances, options.select, options.per_material);
    if (const auto one = scan::strongest_disagreements(o.distances, 1); !one.empty()) {
        o.strongest = one.front();
    }
    o.seconds.select = watch.lap();
    throw_if_interrupted();
    const auto there = o.census.counts.disagreements();
    const auto listed = std::min(options.disagreements.value_or(there), there);
    if (listed > scan::max_listed) {
        throw Error(Fault::usage,
                    fmt::format("{} disagreements are more than can be listed ({}); give "
                                "--disagreements N for the N strongest, or 0",
                                listed, scan::max_listed));
    }
    {
        Progress progress("listing", options.quiet);
        const auto update = [&](double share) { progress.update(share); };
        o.disagreements = options.disagreements ? scan::strongest_disagreements(
                                                      o.distances, *options.disagreements, update)
                                                : scan::all_disagreements(o.distances, update);
    }
    if (!options.disagreements && o.disagreements.size() != o.census.counts.disagreements()) {
        throw std::logic_error(fmt::format("{} disagreements were counted and {} listed",
                                           o.census.counts.disagreements(),
                                           o.disagreements.size()));
    }
    o.seconds.list = watch.lap();
    throw_if_interrupted();
    write_results(out, o, options.quiet);
    for (const char* const name : {"pairs.csv", "selection.csv"}) {
        o.files[name] = content_hash_of_file(out.path(name));
    }
    o.seconds.write = watch.lap();
    throw_if_interrupted();
    const std::string summary = summary_json(options, o);
    out.write("summary.json", [&](int file) { scan::write_all(file, summary); });
    out.commit();
    if (!options.quiet) {
        print_summary(options, o);
    }
    return kSuccess;
}

}  // namespace

void add_scan(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "scan",
        "All pair distances under two metrics, all disagreements, and the configurations for "
        "judges");
    auto* distances = add_distance_options(*command, options->distances, kMetrics);
    add_output_options(*command, options->out, options->force);
    constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max();
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
    distances->excludes(
        command->add_flag("--fast", options->fast,
                          "Do not refine: float32 decides, and what it leaves open is counted"));
    command->add_flag("--quiet", options->quiet, "No progress and no summary");
    command->footer(
        std::string("Writes pairs.csv, disagreements.csv, selection.csv and summary.json "
                    "(docs/file-formats.md).\n"
                    "\n") +
        kMetricsHelp +
        "What a file's metric leaves open in float32 stays open, as with --fast.\n"
        "\n"
        "Examples:\n"
        "  merl-scan scan\n"
        "  merl-scan scan --database ~/merl/brdfs --out results\n"
        "  merl-scan scan --metrics rmse,pawcielab --disagreements 1000 --out rmse-results\n"
        "  merl-scan scan --metrics pawcielab,./my_metric.glsl:alpha=0.3\n"
        "  merl-scan scan --distances network.csv --metrics lpips,cwcbrt --out results\n"
        "  merl-scan scan --select 20 --per-material 3 --device llvmpipe --memory 256M --force");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
