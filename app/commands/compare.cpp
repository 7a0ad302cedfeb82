#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/commands/obtain_distances.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "app/pages/compare_page.h"
#include "engine/base/stopwatch.h"
#include "engine/base/text.h"
#include "scan/io/csv.h"
#include "scan/select/compare_metrics.h"
#include "scan/select/triangle.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

const MetricNeeds kMetrics = {.from_database = "all", .least = 2, .refines = false};

/// So many of the strongest disagreements of two metrics are named.
constexpr std::uint32_t kStrongest = 5;

struct Options {
    DistanceOptions distances;
    std::string out = "merl-scan-comparison";
    bool force = false;
    bool quiet = false;
};

struct Outcome {
    pipeline::PairDistances distances;
    scan::ComparisonResult compared;
    std::vector<scan::TriangleCheck> triangles;  // of metrics that are not proven to keep it
    double compare_seconds = 0;
    double write_seconds = 0;

    double total_seconds() const {
        return distances.provenance.seconds.total + compare_seconds + write_seconds;
    }
};

ordered_json comparison_json(const scan::DistanceTable& table, const scan::Comparison& c) {
    ordered_json strongest = ordered_json::array();
    for (const auto& configuration : c.strongest) {
        strongest.push_back(configuration_json(table.names, configuration));
    }
    return {{"metrics",
             {as_utf8(table.metrics[c.first].metric), as_utf8(table.metrics[c.second].metric)}},
            {"disagreements", c.counts.disagreements()},
            {"rate", c.counts.disagreement_rate()},
            {"tau_b", c.tau_b ? ordered_json(*c.tau_b) : ordered_json()},
            {"counts", counts_json(c.counts)},
            {"undecided_in_float32", c.undecided ? ordered_json(*c.undecided) : ordered_json()},
            {"strongest", strongest}};
}

std::string summary_json(const Options& options, const Outcome& o) {
    const auto& table = o.distances.table;
    const auto& provenance = o.distances.provenance;
    ordered_json json = program_json();
    json["metrics"] = metrics_json(provenance);
    json.update(source_json(provenance));
    ordered_json comparisons = ordered_json::array();
    for (const auto& comparison : o.compared.comparisons) {
        comparisons.push_back(comparison_json(table, comparison));
    }
    ordered_json triangles = ordered_json::array();
    for (const auto& check : o.triangles) {
        triangles.push_back(triangle_json(table, check));
    }
    json.update(ordered_json{{"materials", table.materials()},
                             {"pairs", table.pairs()},
                             {"configurations", scan::configuration_count(table.pairs())},
                             {"counted_by", counted_by(o.compared.streamed)},
                             {"comparisons", comparisons},
                             {"triangle_inequality", triangles},
                             {"options", computing_options_json(options.distances)}});
    json.update(engines_json(provenance));
    json["warnings"] = texts_json(provenance.warnings);
    json["seconds"] = {{"device", o.distances.provenance.seconds.opening},
                       {"distances", o.distances.provenance.seconds.without_opening()},
                       {"compare", o.compare_seconds},
                       {"write", o.write_seconds},
                       {"total", o.total_seconds()}};
    return json_text(json);
}

void print_comparisons(const scan::DistanceTable& table,
                       const std::vector<scan::Comparison>& comparisons) {
    std::size_t first_width = 0;
    std::size_t second_width = 0;
    for (const auto& c : comparisons) {
        first_width = std::max(first_width, width_of(table.metrics[c.first].metric));
        second_width = std::max(second_width, width_of(table.metrics[c.second].metric));
    }
    print_line("");
    print_line(padded("", first_width + 2 + second_width) +
               "  disagree   tau-b  undecided  strongest disagreement and its agreement");
    for (const auto& c : comparisons) {
        std::string strongest = "none";
        if (!c.strongest.empty()) {
            const auto& s = c.strongest.front();
            strongest = fmt::format("{} against {}, {:.3g}", pair_text(table.names, s.left),
                                    pair_text(table.names, s.right), s.agreement);
        }
        print_line(fmt::format(
            "{}  {}  {:>6.2f} %  {:>6}  {:>9}  {}",
            padded(table.metrics[c.first].metric, first_width),
            padded(table.metrics[c.second].metric, second_width),
            100 * c.counts.disagreement_rate(), c.tau_b ? fmt::format("{:.3f}", *c.tau_b) : "-",
            c.undecided ? fmt::format("{}", fmt::group_digits(*c.undecided)) : "-", strongest));
    }
    print_line("");
}

void print_triangles(const scan::DistanceTable& table,
                     const std::vector<scan::TriangleCheck>& checks) {
    if (checks.empty()) {
        return;
    }
    std::size_t width = 0;
    for (const auto& check : checks) {
        width = std::max(width, width_of(table.metrics[check.metric].metric));
    }
    print_line("The triangle inequality, where nothing proves it:");
    for (const auto& check : checks) {
        print_line(fmt::format("{}  {}", padded(table.metrics[check.metric].metric, width),
                               triangle_text(table, check)));
    }
    print_line("");
}

void print_summary(const Options& options, const Outcome& o) {
    const auto& table = o.distances.table;
    print_results(source_lines(o.distances));
    print_result("pairs", fmt::format("{}", fmt::group_digits(table.pairs())));
    print_result("configurations",
                 fmt::format("{}", fmt::group_digits(scan::configuration_count(table.pairs()))));
    print_result("metrics", fmt::format("{}", table.metrics.size()));
    print_comparisons(table, o.compared.comparisons);
    print_triangles(table, o.triangles);
    print_results(engine_lines(o.distances.provenance));
    print_result("seconds",
                 fmt::format("{:.2f}: device {:.2f}, distances {:.2f}, compare {:.2f}, write "
                             "{:.2f}",
                             o.total_seconds(), o.distances.provenance.seconds.opening,
                             o.distances.provenance.seconds.without_opening(), o.compare_seconds,
                             o.write_seconds));
    print_result("results", options.out + ": open compare.html in a browser");
}

/// The metrics that may break the triangle inequality: those that were read from a table too.
std::vector<std::size_t> unproven(const pipeline::Provenance& provenance) {
    std::vector<std::size_t> metrics;
    for (std::size_t m = 0; m < provenance.metrics.size(); ++m) {
        if (!provenance.metrics[m].is_pseudometric) {
            metrics.push_back(m);
        }
    }
    return metrics;
}

int run(const Options& options) {
    const auto threads = limit_threads(options.distances.threads);
    TerminalControl terminal(options.quiet);
    const auto control = terminal.control();
    Outcome o;
    Stopwatch watch;
    OutputDirectory out(
        options.out, options.force,
        {{.name = "distances.csv",
          .write =
              [&](int file) {
                  scan::write_distance_table(file, o.distances.table, control.stage("writing"));
              }},
         {.name = "compare.csv",
          .write =
              [&](int file) {
                  scan::write_comparisons(file, o.distances.table, o.compared.comparisons);
              }},
         {.name = "triangle.csv",
          .write = [&](int file) { scan::write_triangles(file, o.distances.table, o.triangles); }},
         {.name = "compare.html",
          .write =
              [&](int file) {
                  scan::write_all(file, compare_page(o.distances, o.compared, o.triangles));
              }},
         {.name = "summary.json",
          .write =
              [&](int file) {
                  o.write_seconds = watch.lap();
                  scan::write_all(file, summary_json(options, o));
              }}},
        {options.distances.distances});
    o.distances = obtain_distances(options.distances, kMetrics, control).distances;
    warn_if_all_are_zero(o.distances.provenance, o.distances.table.metrics);
    watch.lap();
    o.compared = scan::compare_metrics(o.distances.table, kStrongest, control.stage("comparing"));
    o.triangles = scan::check_triangles(o.distances.table, unproven(o.distances.provenance),
                                        control.stage("checking triangles"));
    o.compare_seconds = watch.lap();
    out.finish();
    terminal.clear();
    if (!options.quiet) {
        print_summary(options, o);
    }
    return kSuccess;
}

}  // namespace

void add_compare(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "compare", "Every two metrics beside each other: how often they disagree, and where most");
    add_distance_options(*command, options->distances, kMetrics);
    add_output_options(*command, options->out, options->force);
    add_quiet_option(*command, options->quiet);
    command->footer(
        std::string("Writes distances.csv, compare.csv, triangle.csv, compare.html and "
                    "summary.json\n"
                    "(docs/file-formats.md).\n"
                    "\n") +
        kMetricsHelp + "\n" + kDatabaseHelp +
        "\n"
        "Examples:\n"
        "  merl-scan compare\n"
        "  merl-scan compare --metrics cwcbrt,pawcielab,rmse --database ~/merl/brdfs --out "
        "results\n"
        "  merl-scan compare --database ~/merl --database ~/rgl --exclude '*fabric*'\n"
        "  merl-scan compare --metrics all,./my_metric.glsl --out results\n"
        "  merl-scan compare --distances network.csv --out results");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
