#include "scan/select/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/cli/exit_status.h"
#include "app/cli/interrupt.h"
#include "app/cli/open_metrics.h"
#include "app/cli/options.h"
#include "app/cli/progress.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/output/describe.h"
#include "app/output/output_directory.h"
#include "app/pages/compare_page.h"
#include "app/pipeline/obtain_distances.h"
#include "engine/base/stopwatch.h"
#include "scan/io/csv.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

const MetricNeeds kMetrics = {.from_database = "all", .least = 2};

/// So many of the strongest disagreements of two metrics are named.
constexpr std::uint32_t kStrongest = 5;

struct Options {
    DistanceOptions distances;
    std::string out = "merl-scan-comparison";
    bool force = false;
    bool quiet = false;
};

/// Wall-clock seconds of the stages, which follow each other.
struct Seconds {
    double device = 0;  // opening it
    double distances = 0;
    double compare = 0;
    double write = 0;
    double total() const { return device + distances + compare + write; }
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

std::string summary_json(const Options& options, const ObtainedDistances& obtained,
                         const scan::ComparisonResult& compared, const Seconds& seconds) {
    const auto& table = obtained.table;
    ordered_json json = program_json();
    json["metrics"] = obtained.described_metrics;
    json.update(obtained.source);
    ordered_json comparisons = ordered_json::array();
    for (const auto& comparison : compared.comparisons) {
        comparisons.push_back(comparison_json(table, comparison));
    }
    json.update(ordered_json{{"materials", table.materials()},
                             {"pairs", table.pairs()},
                             {"configurations", scan::configuration_count(table.pairs())},
                             {"counted_by", counted_by(compared.streamed)},
                             {"comparisons", comparisons},
                             {"options",
                              {{"device", options.distances.device},
                               {"memory_bytes", options.distances.memory},
                               {"threads", options.distances.threads}}}});
    json.update(obtained.device);
    json["warnings"] = texts_json(obtained.warnings);
    json["seconds"] = {{"device", seconds.device},
                       {"distances", seconds.distances},
                       {"compare", seconds.compare},
                       {"write", seconds.write},
                       {"total", seconds.total()}};
    return json_text(json);
}

/// So many columns a name takes when print_line has made it harmless.
std::size_t width_of(const std::string& name) {
    return printable(name).size();
}

/// A name with spaces after it, up to a width.
std::string padded(const std::string& name, std::size_t width) {
    return name + std::string(width - std::min(width, width_of(name)), ' ');
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

void print_summary(const Options& options, const ObtainedDistances& obtained,
                   const scan::ComparisonResult& compared, const Seconds& seconds) {
    const auto& table = obtained.table;
    for (const auto& [name, text] : obtained.source_lines) {
        print_result(name, text);
    }
    print_result("pairs", fmt::format("{}", fmt::group_digits(table.pairs())));
    print_result("configurations",
                 fmt::format("{}", fmt::group_digits(scan::configuration_count(table.pairs()))));
    print_result("metrics", fmt::format("{}", table.metrics.size()));
    print_comparisons(table, compared.comparisons);
    for (const auto& [name, text] : obtained.device_lines) {
        print_result(name, text);
    }
    print_result("seconds",
                 fmt::format("{:.2f}: device {:.2f}, distances {:.2f}, compare {:.2f}, write "
                             "{:.2f}",
                             seconds.total(), seconds.device, seconds.distances, seconds.compare,
                             seconds.write));
    print_result("results", options.out + ": open compare.html in a browser");
}

int run(const Options& options) {
    const auto threads = limit_threads(options.distances.threads);
    OutputDirectory out(options.out, options.force,
                        {"distances.csv", "compare.csv", "compare.html", "summary.json"},
                        {options.distances.distances});
    auto obtained = obtain_distances(options.distances, kMetrics, options.quiet);
    warn_if_all_are_zero(obtained);
    Seconds seconds = {obtained.device_seconds, obtained.distance_seconds, 0, 0};
    Stopwatch watch;
    scan::ComparisonResult compared;
    {
        Progress progress("comparing", options.quiet);
        compared = scan::compare_metrics(obtained.table, kStrongest,
                                         [&](double share) { progress.update(share); });
    }
    seconds.compare = watch.lap();
    {
        Progress progress("writing", options.quiet);
        out.write("distances.csv", [&](int file) {
            scan::write_distance_table(file, obtained.table,
                                       [&](double share) { progress.update(share); });
        });
    }
    out.write("compare.csv", [&](int file) {
        scan::write_comparisons(file, obtained.table, compared.comparisons);
    });
    throw_if_interrupted();
    const std::string page = compare_page(obtained, compared);
    out.write("compare.html", [&](int file) { scan::write_all(file, page); });
    seconds.write = watch.lap();
    throw_if_interrupted();
    const std::string summary = summary_json(options, obtained, compared, seconds);
    out.write("summary.json", [&](int file) { scan::write_all(file, summary); });
    out.commit();
    if (!options.quiet) {
        print_summary(options, obtained, compared, seconds);
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
    command->add_flag("--quiet", options->quiet, "No progress and no summary");
    command->footer(
        std::string("Writes distances.csv, compare.csv, compare.html and summary.json "
                    "(docs/file-formats.md).\n"
                    "\n") +
        kMetricsHelp +
        "\n"
        "Examples:\n"
        "  merl-scan compare\n"
        "  merl-scan compare --metrics cwcbrt,pawcielab,rmse --database ~/merl/brdfs --out "
        "results\n"
        "  merl-scan compare --metrics all,./my_metric.glsl --out results\n"
        "  merl-scan compare --distances network.csv --out results");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
