#include "app/pipeline/obtain_distances.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "app/cli/guard.h"
#include "app/cli/open_metrics.h"
#include "app/cli/options.h"
#include "app/cli/progress.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/output/describe.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "engine/device/context.h"
#include "engine/distance/distances.h"
#include "scan/io/input.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// The parts of a comma-separated list, in order. Throws Error (usage) when one is empty or occurs
/// twice; `option` is the option's name in that.
std::vector<std::string> split_list(const std::string& list, const std::string& option) {
    std::vector<std::string> parts;
    for (std::size_t begin = 0; begin <= list.size();) {
        const std::size_t end = std::min(list.find(',', begin), list.size());
        const std::string part = list.substr(begin, end - begin);
        if (part.empty()) {
            throw Error(Fault::usage,
                        fmt::format("{}: found an empty name in \"{}\"; expected names separated "
                                    "by commas",
                                    option, list));
        }
        if (std::ranges::find(parts, part) != parts.end()) {
            throw Error(
                Fault::usage,
                fmt::format("{}: found \"{}\" twice; expected different names", option, part));
        }
        parts.push_back(part);
        begin = end + 1;
    }
    return parts;
}

/// `option` is what --database says.
ordered_json database_json(const engine::Database& database, const std::string& option,
                           const engine::DistanceResult& computed) {
    ordered_json path;
    if (!option.empty() && option != kBuiltIn) {
        path = as_utf8(std::filesystem::absolute(option).lexically_normal().string());
    }
    ordered_json hashes = ordered_json::object();
    ordered_json negative = ordered_json::object();
    ordered_json negative_above = ordered_json::object();
    for (std::size_t m = 0; m < database.materials().size(); ++m) {
        const std::string name = as_utf8(database.materials()[m]);
        negative[name] = computed.counts[m].negative;
        negative_above[name] = computed.counts[m].negative_above_horizon;
        hashes[name] = computed.material_hashes[m];
    }
    const auto& grid = database.grid();
    return {
        {"database",
         {{"name", as_utf8(database.name())},
          {"kind", database.kind()},
          {"path", path},
          {"content_hash", computed.content_hash},
          {"grid", {{"theta_h", grid.theta_h}, {"theta_d", grid.theta_d}, {"phi_d", grid.phi_d}}},
          {"material_hashes", hashes}}},
        {"samples_per_material", grid.voxels()},
        {"samples_above_horizon", computed.voxels},
        {"negative_samples", negative},
        {"negative_samples_above_horizon", negative_above}};
}

/// The names of the metrics whose pairs the host computed itself.
std::vector<std::string> names_on_host(const engine::SlabPlan& plan,
                                       std::span<const engine::Metric* const> metrics) {
    std::vector<std::string> names;
    for (const auto* metric : metrics) {
        if (plan.on_host(*metric)) {
            names.push_back(as_utf8(metric->name));
        }
    }
    return names;
}

ordered_json device_json(const device::Context& context, const std::vector<std::string>& on_host,
                         const engine::DistanceResult& computed) {
    const auto& s = computed.seconds;
    return {{"device",
             {{"name", context.info().name},
              {"kind", context.info().kind},
              {"driver", context.info().driver},
              {"vulkan", context.info().vulkan},
              {"on_host", on_host},
              {"peak_bytes", context.peak_allocated_bytes() + computed.host_bytes},
              {"slabs", computed.plan.slabs}}},
            {"distance_seconds",
             {{"kernels", s.kernels},
              {"reading", s.reading},
              {"device_transform", s.transform},
              {"difference", s.difference},
              {"waiting", s.waiting},
              {"adding", s.adding}}}};
}

void require_metrics(std::size_t found, const MetricNeeds& needs) {
    if (found >= needs.least && found <= needs.most) {
        return;
    }
    const auto expected = needs.least == needs.most ? fmt::format("{} metrics", needs.least)
                          : found < needs.least     ? fmt::format("{} metrics or more", needs.least)
                                                : fmt::format("{} metrics or fewer", needs.most);
    throw Error(Fault::usage, fmt::format("--metrics: found {}; expected {}, like cwcbrt,pawcielab",
                                          found, expected));
}

ordered_json metric_json(const engine::Metric& metric) {
    const auto& header = metric.header;
    ordered_json parameters = ordered_json::object();
    for (std::size_t p = 0; p < header.parameters.size(); ++p) {
        parameters[header.parameters[p].name] = metric.parameters[p];
    }
    return {{"name", as_utf8(metric.name)},       {"title", as_utf8(header.title)},
            {"formula", as_utf8(header.formula)}, {"source", as_utf8(header.source)},
            {"note", as_utf8(header.note)},       {"parameters", parameters}};
}

ObtainedDistances compute(const DistanceOptions& options, const MetricNeeds& needs, bool quiet) {
    ObtainedDistances result;
    result.opened = open_metrics(
        split_list(options.metrics.value_or(needs.from_database), "--metrics"), options.device);
    for (const auto& metric : result.opened) {
        result.metrics.push_back(&metric);
    }
    require_metrics(result.metrics.size(), needs);
    result.database = open_database(options.database);
    const auto& database = *result.database;
    Stopwatch watch;
    try_device_where_limited(options.device);
    device::Context context({.device = options.device});
    result.device_seconds = watch.lap();
    Progress progress("distances", quiet);
    auto computed =
        engine::compute_distances(context, database, result.metrics,
                                  {.memory_bytes = options.memory,
                                   .progress = [&](double share) { progress.update(share); }});
    result.distance_seconds = watch.lap();
    result.table.names = database.materials();
    for (std::size_t m = 0; m < result.metrics.size(); ++m) {
        result.described_metrics.push_back(metric_json(*result.metrics[m]));
        result.table.metrics.push_back({result.metrics[m]->name,
                                        std::move(computed.distances[m].values),
                                        std::move(computed.distances[m].bounds)});
    }
    result.source = database_json(database, options.database, computed);
    result.warnings = std::move(computed.warnings);
    const auto on_host = names_on_host(computed.plan, result.metrics);
    result.device = device_json(context, on_host, computed);
    result.source_lines = {{"database", fmt::format("{}, {}", database.name(), database.kind())},
                           {"materials", fmt::format("{}, of {} samples each",
                                                     fmt::group_digits(result.table.materials()),
                                                     fmt::group_digits(database.grid().voxels()))}};
    result.device_lines = {{"device", fmt::format("{} ({}), {}", context.info().name,
                                                  context.info().kind, context.info().driver)}};
    if (!on_host.empty()) {
        result.device_lines.emplace_back(
            "on the host",
            fmt::format("{} of {} metrics, without shaders: the device is this processor",
                        on_host.size(), result.metrics.size()));
    }
    return result;
}

ObtainedDistances read(const DistanceOptions& options, const MetricNeeds& needs, bool quiet) {
    ObtainedDistances result;
    Stopwatch watch;
    const std::string metrics = options.metrics.value_or("all");
    const auto columns =
        metrics == "all" ? std::vector<std::string>() : split_list(metrics, "--metrics");
    if (!columns.empty()) {
        require_metrics(columns.size(), needs);
    }
    Progress progress("reading", quiet);
    const std::string text = scan::read_input(options.distances);
    result.table = scan::parse_distance_table(text, options.distances, columns,
                                              [&](double share) { progress.update(share); });
    require_metrics(result.table.metrics.size(), needs);
    for (const auto& column : result.table.metrics) {
        result.described_metrics.push_back({{"name", as_utf8(column.metric)}});
    }
    result.distance_seconds = watch.lap();
    result.source = {
        {"distances", {{"file", as_utf8(options.distances)}, {"content_hash", hash_of(text)}}}};
    result.source_lines = {
        {"distances", options.distances + ", taken as exact"},
        {"materials", fmt::format("{}", fmt::group_digits(result.table.materials()))}};
    return result;
}

}  // namespace

CLI::Option* add_distance_options(CLI::App& command, DistanceOptions& options,
                                  const MetricNeeds& needs) {
    auto* database =
        command
            .add_option("--database", options.database,
                        "A directory of MERL .binary files (default: built-in, the stand-in "
                        "database)")
            ->transform(not_empty());
    auto* distances =
        command
            .add_option(
                "--distances", options.distances,
                "A CSV file of distances to use instead: material_a,material_b and a column "
                "per metric")
            ->transform(not_empty());
    command.add_option("--metrics", options.metrics,
                       fmt::format("Metrics, separated by commas, or all (default: {}); with "
                                   "--distances its columns (default: all)",
                                   needs.from_database));
    auto* device =
        command.add_option("--device", options.device,
                           "A Vulkan device by number or part of its name (default: the best)");
    auto* memory =
        command
            .add_option("--memory", options.memory,
                        "Bound on the memory of what is read and computed, like 512M or 2G")
            ->transform(byte_count())
            ->default_str("1G");
    command.add_option("--threads", options.threads, "Processor threads (default: all)")
        ->transform(whole_number(1, 4096));
    for (auto* other : {database, device, memory}) {
        distances->excludes(other);
    }
    return distances;
}

std::unique_ptr<tbb::global_control> limit_threads(unsigned threads) {
    if (threads == 0) {
        return nullptr;
    }
    // lavapipe computes on threads of its own; whoever bounds ours means those too.
    ::setenv("LP_NUM_THREADS", std::to_string(threads).c_str(), 0);
    return std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                 threads);
}

ObtainedDistances obtain_distances(const DistanceOptions& options, const MetricNeeds& needs,
                                   bool quiet) {
    auto result =
        options.distances.empty() ? compute(options, needs, quiet) : read(options, needs, quiet);
    std::ranges::for_each(result.warnings, print_warning);
    return result;
}

void warn(ObtainedDistances& obtained, const std::string& text) {
    print_warning(text);
    obtained.warnings.push_back(text);
}

void warn_if_all_are_zero(ObtainedDistances& obtained, const std::string& metric,
                          std::span<const double> distances) {
    if (std::ranges::all_of(distances, [](double distance) { return distance == 0; })) {
        warn(obtained, fmt::format("all distances under {} are 0", metric));
    }
}

void warn_if_all_are_zero(ObtainedDistances& obtained) {
    for (const auto& column : obtained.table.metrics) {
        warn_if_all_are_zero(obtained, column.metric, column.values);
    }
}

}  // namespace merl::app
