#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/guard.h"
#include "app/cli/terminal.h"
#include "app/cli/tried_device.h"
#include "app/commands/obtain_distances.h"
#include "app/commands/scan_options.h"
#include "app/output/image_file.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "app/pages/approximations_page.h"
#include "app/pipeline/reference_scan.h"
#include "app/pipeline/spheres.h"
#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "engine/base/text.h"
#include "engine/distance/engines.h"
#include "scan/io/csv.h"
#include "scan/reference/reference_tables.h"
#include "scan/select/scan_tables.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

const MetricNeeds kMetrics = {.from_database = "cwcbrt,pawcielab", .least = 2};

/// So many names, or originals, stand for all of them in a line.
constexpr std::size_t kNamed = 3;

struct Outcome {
    pipeline::Provenance provenance;
    std::size_t materials = 0;
    pipeline::ReferenceScanResult result;
    ordered_json files = ordered_json::object();  // hashes of those that are read again
    PageSpheres spheres;
    double render_seconds = 0;
    double write_seconds = 0;

    const scan::ReferenceDistances& distances() const { return result.distances; }
    const scan::Approximations& approximations() const { return result.distances.approximations; }
    const std::string& metric(std::size_t m) const {
        return result.distances.table.metrics[m].metric;
    }
    const std::string& name(std::uint32_t material) const {
        return result.distances.table.names[material];
    }

    /// The name of an original without its label.
    std::string original(std::uint32_t material) const {
        return name(material).substr(approximations().reference.size() + 1);
    }

    std::uint64_t originals() const {
        const auto& all = approximations();
        return distances().ranges.size() +
               static_cast<std::uint64_t>(std::ranges::count_if(all.lacking, [&](const auto& one) {
                   return one.labels.size() == all.labels.size();
               }));
    }

    /// How many approximations each label has.
    std::vector<std::uint64_t> by_label() const {
        std::vector<std::uint64_t> numbers(approximations().labels.size());
        for (const auto& one : approximations().list) {
            ++numbers[one.label];
        }
        return numbers;
    }

    double total_seconds() const {
        const auto& s = result.seconds;
        return provenance.seconds.total + s.refine + s.count + s.select + s.list + render_seconds +
               write_seconds;
    }
};

ordered_json pair_json(const Outcome& o, std::uint32_t pair) {
    const auto& one = o.distances().of_pair(pair);
    return {as_utf8(o.name(one.original)), as_utf8(o.name(one.approximation))};
}

ordered_json reference_json(const Outcome& o) {
    const auto& all = o.approximations();
    const auto numbers = o.by_label();
    ordered_json by_label = ordered_json::object();
    for (std::size_t label = 0; label < numbers.size(); ++label) {
        by_label[as_utf8(all.labels[label])] = numbers[label];
    }
    ordered_json lacking = ordered_json::object();
    for (const auto& one : all.lacking) {
        lacking[as_utf8(one.original)] = texts_json(one.labels);
    }
    return {{"label", as_utf8(all.reference)},
            {"originals", o.originals()},
            {"approximated", o.distances().ranges.size()},
            {"with_two_or_more", o.result.summary.contested},
            {"with_all", o.result.summary.complete},
            {"approximations", by_label},
            {"lacking", lacking},
            {"without_original", texts_json(all.without_original)},
            {"unrelated_labels", texts_json(all.unrelated)}};
}

ordered_json figures_json(const Outcome& o, std::size_t metric) {
    const auto& all = o.approximations();
    const auto& figures = o.result.summary.metrics[metric];
    ordered_json labels = ordered_json::object();
    for (std::size_t label = 0; label < all.labels.size(); ++label) {
        const auto& of_label = figures.labels[label];
        labels[as_utf8(all.labels[label])] = {
            {"mean_rank", of_label.mean_rank ? ordered_json(*of_label.mean_rank) : ordered_json()},
            {"best", of_label.best},
            {"tied_best", of_label.tied_best}};
    }
    ordered_json hardest = ordered_json::array();
    for (const auto& one : figures.hardest) {
        hardest.push_back({{"original", as_utf8(o.name(one.original))},
                           {"best", as_utf8(all.labels[one.label])},
                           {"distance", one.distance}});
    }
    return {{"metric", as_utf8(o.metric(metric))}, {"labels", labels}, {"hardest", hardest}};
}

ordered_json comparison_json(const Outcome& o, const scan::MetricPair& pair) {
    return {{"metrics", {as_utf8(o.metric(pair.first)), as_utf8(o.metric(pair.second))}},
            {"different_best", pair.different},
            {"partly_different_best", pair.partly},
            {"disagreements", pair.counts.disagreements()},
            {"rate", pair.counts.disagreement_rate()},
            {"counts", counts_json(pair.counts)}};
}

std::string summary_json(const ScanCommandOptions& options, const Outcome& o) {
    const auto& counts = o.result.counts;
    ordered_json names = ordered_json::array();
    ordered_json figures = ordered_json::array();
    ordered_json refined = ordered_json::object();
    for (std::size_t m = 0; m < o.result.refined.size(); ++m) {
        names.push_back(as_utf8(o.metric(m)));
        figures.push_back(figures_json(o, m));
        refined[as_utf8(o.metric(m))] = o.result.refined[m];
    }
    ordered_json comparisons = ordered_json::array();
    for (const auto& pair : o.result.summary.pairs) {
        comparisons.push_back(comparison_json(o, pair));
    }
    ordered_json open = ordered_json::array();
    for (const auto& one : o.result.left_open.open) {
        open.push_back({{"left", pair_json(o, one.left)},
                        {"right", pair_json(o, one.right)},
                        {"metric", as_utf8(one.metric)}});
    }
    ordered_json strongest;
    if (o.result.strongest) {
        strongest = {{"left", pair_json(o, o.result.strongest->left)},
                     {"right", pair_json(o, o.result.strongest->right)},
                     {"agreement", o.result.strongest->agreement}};
    }
    ordered_json chosen = scan_options_json(options);
    chosen["spheres"] = options.spheres;
    ordered_json json = program_json();
    json["metrics"] = names;
    json["reference"] = reference_json(o);
    json.update(source_json(o.provenance));
    json.update(ordered_json{
        {"materials", o.materials},
        {"pairs", o.distances().pairs.size()},
        {"configurations", counts.configurations},
        {"disagreements", counts.disagreements()},
        {"rate", counts.disagreement_rate()},
        {"counts", counts_json(counts)},
        {"ranks", figures},
        {"comparisons", comparisons},
        {"exact", o.result.exact},
        {"undecided_in_float32", o.result.undecided},
        {"undecided", {{"configurations", o.result.left_open.configurations}, {"listed", open}}},
        {"refined_distances", refined},
        {"refined_by", refined_by_json(o.provenance)},
        {"strongest_disagreement", strongest},
        {"selection", selection_json(o.result.selection)},
        {"disagreements_written", o.result.disagreements.size()},
        {"options", chosen}});
    json.update(engines_json(o.provenance));
    json["warnings"] = texts_json(o.provenance.warnings);
    json["files"] = o.files;
    const auto& s = o.result.seconds;
    json["seconds"] = {{"device", o.provenance.seconds.opening},
                       {"distances", o.provenance.seconds.without_opening()},
                       {"refine", s.refine},
                       {"count", s.count},
                       {"list", s.list},
                       {"select", s.select},
                       {"render", o.render_seconds},
                       {"write", o.write_seconds},
                       {"total", o.total_seconds()}};
    return json_text(json);
}

/// The first of some texts, and whether there are more.
std::string some_of(std::vector<std::string> texts) {
    if (texts.size() > kNamed) {
        texts.resize(kNamed);
        texts.emplace_back("...");
    }
    return fmt::format("{}", fmt::join(texts, ", "));
}

void print_approximations(const Outcome& o) {
    const auto& all = o.approximations();
    const auto numbers = o.by_label();
    std::vector<std::string> by_label;
    for (std::size_t label = 0; label < numbers.size(); ++label) {
        by_label.push_back(
            fmt::format("{} {}", all.labels[label], fmt::group_digits(numbers[label])));
    }
    print_result("originals",
                 fmt::format("{} of {}, {} with all of {}", fmt::group_digits(o.originals()),
                             all.reference, fmt::group_digits(o.result.summary.complete),
                             counted(all.labels.size(), "approximation")));
    print_result("approximations", fmt::format("{}: {}", fmt::group_digits(all.list.size()),
                                               fmt::join(by_label, ", ")));
    if (!all.lacking.empty()) {
        std::vector<std::string> lacking;
        for (const auto& one :
             std::span(all.lacking).first(std::min(all.lacking.size(), kNamed + 1))) {
            lacking.push_back(fmt::format("{} (no {})", one.original, some_of(one.labels)));
        }
        print_result("lacking", fmt::format("{}: {}", counted(all.lacking.size(), "original"),
                                            some_of(lacking)));
    }
    if (!all.without_original.empty()) {
        print_result("no original",
                     fmt::format("{}: {}", counted(all.without_original.size(), "material"),
                                 some_of(all.without_original)));
    }
}

/// The width of the longest name of a metric.
std::size_t metric_width(const Outcome& o) {
    std::size_t width = 0;
    for (const auto& column : o.distances().table.metrics) {
        width = std::max(width, width_of(column.metric));
    }
    return width;
}

void print_ranks(const Outcome& o) {
    const auto& summary = o.result.summary;
    if (summary.complete == 0) {
        print_line(
            "No original has all approximations, so mean ranks say nothing: "
            "approximations.csv has the ranks.");
        print_line("");
        return;
    }
    constexpr std::size_t kCell = 10;
    const auto& labels = o.approximations().labels;
    const auto width = metric_width(o);
    print_line(
        fmt::format("Mean rank over the {} that all approximate, and how often no other is "
                    "nearer:",
                    counted(summary.complete, "original")));
    std::string header = padded("", width);
    for (const auto& label : labels) {
        header += "  " + padded("", kCell - std::min(kCell, width_of(label))) + label;
    }
    print_line(header);
    for (std::size_t m = 0; m < summary.metrics.size(); ++m) {
        std::string line = padded(o.metric(m), width);
        for (std::size_t label = 0; label < labels.size(); ++label) {
            const auto& figures = summary.metrics[m].labels[label];
            line += fmt::format("  {:>{}.2f} {:>5}", figures.mean_rank.value(),
                                std::max(kCell, width_of(labels[label])) - 6,
                                fmt::format("{}", fmt::group_digits(figures.best)));
        }
        print_line(line);
    }
    print_line("");
    print_line("The hardest of these, and how far the best approximation is:");
    for (std::size_t m = 0; m < summary.metrics.size(); ++m) {
        std::vector<std::string> hardest;
        const auto& all = summary.metrics[m].hardest;
        for (const auto& one : std::span(all).first(std::min(all.size(), kNamed))) {
            hardest.push_back(fmt::format("{} {:.3g} ({})", o.original(one.original), one.distance,
                                          labels[one.label]));
        }
        print_line(fmt::format("{}  {}", padded(o.metric(m), width), fmt::join(hardest, ", ")));
    }
    print_line("");
}

void print_comparisons(const Outcome& o) {
    const auto contested = o.result.summary.contested;
    if (contested == 0) {
        return;
    }
    const auto width = metric_width(o);
    print_line(
        fmt::format("How often two metrics name a different best, of {} with two "
                    "approximations or more, and how often they disagree:",
                    counted(contested, "original")));
    for (const auto& pair : o.result.summary.pairs) {
        const auto partly =
            pair.partly == 0 ? ""
                             : fmt::format("; {} in part, by ties", fmt::group_digits(pair.partly));
        print_line(
            fmt::format("{}  {}  {:>6}  {:>6.2f} %  {:>6.2f} %{}",
                        padded(o.metric(pair.first), width), padded(o.metric(pair.second), width),
                        fmt::format("{}", fmt::group_digits(pair.different)),
                        100 * static_cast<double>(pair.different) / static_cast<double>(contested),
                        100 * pair.counts.disagreement_rate(), partly));
    }
    print_line("");
}

std::string pair_text(const Outcome& o, std::uint32_t pair) {
    return o.name(o.distances().of_pair(pair).approximation);
}

void print_decisions(const Outcome& o) {
    const auto& result = o.result;
    print_result("configurations", fmt::format("{} of an original and two approximations",
                                               fmt::group_digits(result.counts.configurations)));
    print_result(
        "disagreements",
        fmt::format("{} ({:.2f} %) of {} and {}", fmt::group_digits(result.counts.disagreements()),
                    100 * result.counts.disagreement_rate(), o.metric(0), o.metric(1)));
    if (result.strongest) {
        const auto& [left, right, agreement] = *result.strongest;
        print_result("strongest", fmt::format("{}: {} against {}, agreement {:.6f}",
                                              o.name(o.distances().of_pair(left).original),
                                              pair_text(o, left), pair_text(o, right), agreement));
    }
    if (!result.selection.empty()) {
        print_result("selection", selection_text(result.selection));
    }
    if (!result.exact) {
        print_result("undecided",
                     result.unbounded.empty()
                         ? fmt::format("{}, closer than their bounds",
                                       counted(result.left_open.configurations, "configuration"))
                         : fmt::format("{}: no error bound is known for {}",
                                       counted(result.left_open.configurations, "configuration"),
                                       fmt::join(result.unbounded, " and ")));
    } else if (o.provenance.database) {
        print_result("refined",
                     fmt::format("{} distances in float64; {} {} closer than their bounds",
                                 fmt::join(result.refined, " + "),
                                 counted(result.undecided, "configuration"),
                                 result.undecided == 1 ? "was" : "were"));
    }
}

void print_summary(const ScanCommandOptions& options, const Outcome& o) {
    print_results(source_lines(o.provenance, o.materials));
    print_approximations(o);
    std::vector<std::string> metrics;
    for (const auto& column : o.distances().table.metrics) {
        metrics.push_back(column.metric);
    }
    print_result("metrics", fmt::format("{}", fmt::join(metrics, ", ")));
    print_decisions(o);
    print_line("");
    print_ranks(o);
    print_comparisons(o);
    print_results(engine_lines(o.provenance));
    const auto& s = o.result.seconds;
    print_result(
        "seconds",
        fmt::format("{:.2f}: device {:.2f}, distances {:.2f}, refine {:.2f}, count {:.3f}, "
                    "list {:.2f}, select {:.3f}, render {:.2f}, write {:.2f}",
                    o.total_seconds(), o.provenance.seconds.opening,
                    o.provenance.seconds.without_opening(), s.refine, s.count, s.list, s.select,
                    o.render_seconds, o.write_seconds));
    print_result("results", options.out);
}

/// What is of note in the labels.
void warn_of_labels(Outcome& o) {
    const auto& all = o.approximations();
    if (!all.unrelated.empty()) {
        warn(o.provenance, fmt::format("no material of {} is called like one of {}",
                                       fmt::join(all.unrelated, ", "), all.reference));
    }
    if (o.result.counts.configurations == 0) {
        warn(o.provenance, "no configurations: no original has two approximations");
    }
}

/// What renders the spheres of the page: a device that was tried, or why there is none.
struct SphereDevice {
    std::optional<device::ContextOptions> context;
    std::string why_not;
};

/// In a handler: why there are no spheres, where the device or memory for it is lacking, of which
/// the scan itself may need none. Throws again whatever else it is.
std::string why_no_spheres() {
    try {
        throw;
    } catch (const Error& error) {
        if (error.fault() != Fault::device && error.fault() != Fault::resource) {
            throw;
        }
        return fmt::format("There are no spheres: {}.", as_utf8(error.what()));
    } catch (const std::bad_alloc&) {
        return "There are no spheres: there was not enough memory to render them.";
    }
}

/// To be called before there are other threads (tried_device.h).
SphereDevice sphere_device(const ScanCommandOptions& options, const pipeline::Control& control) {
    if (options.spheres == 0) {
        return {std::nullopt, "There are no spheres, as --spheres 0 asked for."};
    }
    if (!options.distances.distances.empty()) {
        return {std::nullopt, "There are no spheres: distances were read from a table."};
    }
    if (options.distances.device == engine::kHost) {
        return {std::nullopt,
                "There are no spheres: --device host uses no Vulkan, which renders them."};
    }
    if (options.distances.device.empty() && memory_is_limited()) {
        // It may crash there after all, and nobody asked for it.
        return {std::nullopt,
                "There are no spheres: a Vulkan driver may crash within limited memory (ulimit -v, "
                "-d); raise the limit, or name a device with --device."};
    }
    try {
        return {tried_device(options.distances.device, control), ""};
    } catch (...) {
        return {std::nullopt, why_no_spheres()};
    }
}

/// Renders the spheres of the page. A device that fails costs the spheres, not the scan.
void render(const ScanCommandOptions& options, const engine::Database& database,
            const SphereDevice& device, const pipeline::Control& control, Outcome& o) {
    o.spheres.why_not = device.why_not;
    if (!device.context) {
        return;
    }
    Stopwatch watch;
    const auto shown = originals_on_page(o.distances());
    std::vector<std::size_t> materials;
    for (const auto place :
         std::span(shown).first(std::min<std::size_t>(options.spheres, shown.size()))) {
        const auto& range = o.distances().ranges[place];
        materials.push_back(range.original);
        for (auto i = range.begin; i < range.end; ++i) {
            materials.push_back(o.approximations().list[i].approximation);
        }
    }
    const pipeline::SphereView view = {.sphere = {.size = kPageSpherePixels}};
    try {
        pipeline::render_spheres(
            database, materials, view, *device.context,
            [&](const engine::SphereImage& sphere, const pipeline::Image& linear) {
                o.spheres.png[static_cast<std::uint32_t>(materials[sphere.material])] =
                    png_file(pipeline::displayed(linear, view));
            },
            control);
    } catch (...) {
        o.spheres.png.clear();
        o.spheres.why_not = why_no_spheres();
    }
    o.render_seconds = watch.lap();
}

}  // namespace

int run_reference_scan(const ScanCommandOptions& options) {
    const auto threads = limit_threads(options.distances.threads);
    TerminalControl terminal(options.quiet);
    const auto control = terminal.control();
    Outcome o;
    Stopwatch writing;
    OutputDirectory out(
        options.out, options.force,
        {{.name = "approximations.csv",
          .write = [&](int file) { scan::write_approximations(file, o.distances()); },
          .is_read_again = true},
         {.name = "disagreements.csv",
          .write =
              [&](int file) {
                  scan::write_disagreements(file, o.distances().columns(), o.result.disagreements,
                                            control.stage("writing"));
              }},
         {.name = "selection.csv",
          .write =
              [&](int file) {
                  scan::write_selection(file, o.distances().columns(), o.result.selection);
              },
          .is_read_again = true},
         {.name = "approximations.html",
          .write =
              [&](int file) {
                  scan::write_all(
                      file, approximations_page(o.provenance, o.materials, o.result, o.spheres));
              }},
         {.name = "summary.json",
          .write =
              [&](int file) {
                  o.files = texts_json(out.hashes());
                  o.write_seconds = writing.lap();
                  scan::write_all(file, summary_json(options, o));
              }}},
        {options.distances.distances});
    const auto device = sphere_device(options, control);
    scan::Approximations approximations;
    auto needs = kMetrics;
    needs.refines = !options.fast;
    auto obtained = obtain_listed_distances(
        options.distances, needs,
        [&](std::span<const std::string> names) {
            try {
                approximations = scan::find_approximations(names, options.reference);
            } catch (const Error& error) {
                throw Error(error.fault(), fmt::format("--reference: {}", error.what()));
            }
            return scan::pairs_of(approximations);
        },
        control);
    o.provenance = std::move(obtained.distances.provenance);
    o.materials = obtained.distances.table.names.size();
    auto of_pipeline = options.of_pipeline();
    of_pipeline.engines = obtained.engines.get();
    o.result =
        pipeline::scan_reference(std::move(obtained.distances.table), std::move(approximations),
                                 obtained.database.get(), obtained.metrics, of_pipeline, control);
    if (obtained.database) {
        render(options, *obtained.database, device, control, o);
    } else {
        o.spheres.why_not = device.why_not;
    }
    warn_of_labels(o);
    warn_if_all_are_zero(o.provenance, o.distances().table.metrics);
    writing.lap();
    out.finish();
    terminal.clear();
    if (!options.quiet) {
        print_summary(options, o);
    }
    return kSuccess;
}

}  // namespace merl::app
