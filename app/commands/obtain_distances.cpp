#include "app/commands/obtain_distances.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "app/cli/guard.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/cli/tried_device.h"
#include "app/commands/tiled_distances.h"
#include "app/output/json.h"
#include "app/output/tile_folder.h"
#include "app/pipeline/metrics.h"
#include "engine/base/error.h"
#include "engine/database/bad_files.h"
#include "engine/device/buffer.h"

namespace merl::app {
namespace {

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

/// Compiles each user's metric and tries it on the device, in a process of its own, so that none
/// can hang or crash the program.
void try_metrics(std::span<const engine::Metric* const> metrics, engine::Engines& engines) {
    constexpr double kSeconds = 60;
    constexpr std::uint64_t kBytes = 4ULL << 30U;
    for (const auto* metric : metrics) {
        if (!metric->has_twin()) {
            const auto device = engines.device_for(metrics);
            ask_guarded(fmt::format("{}: compiling and trying it", metric->file), kSeconds, kBytes,
                        {device ? std::to_string(device->index) : engines.options().device,
                         engine::text_of(*metric)});
        }
    }
}

/// `compute_them(engines, database, metrics)` makes the distances.
template <typename Distances>
Obtained<Distances> compute(const DistanceOptions& options, const MetricNeeds& needs,
                            const pipeline::Control& control, const auto& compute_them) {
    auto [opened, metrics, left_out] = open_computation(options, needs, control);
    Obtained<Distances> result;
    result.opened = std::move(opened.metrics);  // which stay where `metrics` says
    result.metrics = std::move(metrics);
    result.database = std::move(opened.database);
    result.engines = std::move(opened.engines);
    with_memory_advice([&] {
        result.distances = compute_them(*result.engines, *result.database, result.metrics);
    });
    result.distances.provenance.left_out = std::move(left_out);
    return result;
}

/// `read_them(columns)` reads the distances, all columns where none is named.
template <typename Distances>
Obtained<Distances> read(const DistanceOptions& options, const MetricNeeds& needs,
                         const auto& read_them) {
    const std::string metrics = options.metrics.value_or("all");
    const auto columns =
        metrics == "all" ? std::vector<std::string>() : split_list(metrics, "--metrics");
    if (!columns.empty()) {
        require_metrics(columns.size(), needs);
    }
    Obtained<Distances> result;
    result.distances = read_them(columns);
    require_metrics(result.distances.table.metrics.size(), needs);
    return result;
}

/// `take_them(folder, columns)` reads the distances from a folder of tiles.
template <typename Distances>
Obtained<Distances> take(const DistanceOptions& options, const MetricNeeds& needs,
                         const pipeline::Control& control, const auto& take_them) {
    const TileFolder folder(options.distances);
    const auto columns = tile_columns(folder, options, needs);
    require_metrics(columns.size(), needs);
    Obtained<Distances> result;
    result.distances = take_them(folder, columns);
    if (needs.refines) {
        auto source = reopen_source(folder, result.distances.provenance, options, control);
        result.database = std::move(source.database);
        result.opened = std::move(source.metrics);
        for (const auto& metric : result.opened) {
            result.metrics.push_back(&metric);
        }
    }
    return result;
}

template <typename Distances>
Obtained<Distances> obtain(const DistanceOptions& options, const MetricNeeds& needs,
                           const pipeline::Control& control, const auto& compute_them,
                           const auto& read_them, const auto& take_them) {
    auto result =
        options.distances.empty() ? compute<Distances>(options, needs, control, compute_them)
        : is_tile_folder(options.distances) ? take<Distances>(options, needs, control, take_them)
                                            : read<Distances>(options, needs, read_them);
    std::ranges::for_each(result.distances.provenance.warnings, print_warning);
    return result;
}

}  // namespace

std::array<CLI::Option*, 2> add_computing_options(CLI::App& command, DistanceOptions& options) {
    auto* device =
        command.add_option("--device", options.device,
                           "host (this processor), or a Vulkan device by number or part of its "
                           "name (default: a GPU that passed a trial and is faster, else the "
                           "host)");
    auto* memory =
        command
            .add_option("--memory", options.memory,
                        "Bound on the memory of what is read and computed, like 512M or 2G")
            ->transform(byte_count())
            ->default_str("1G");
    command.add_option("--threads", options.threads, "Processor threads (default: all)")
        ->transform(whole_number(1, 4096));
    return {device, memory};
}

CLI::Option* add_distance_options(CLI::App& command, DistanceOptions& options,
                                  const MetricNeeds& needs) {
    auto computed_only = add_database_options(command, options.database);
    auto* distances =
        command
            .add_option(
                "--distances", options.distances,
                "Distances to use instead: a CSV file with material_1,material_2 and a column per "
                "metric, or what `merl-scan distances` wrote")
            ->transform(not_empty());
    command.add_option("--metrics", options.metrics,
                       fmt::format("Metrics, separated by commas, or all (default: {}); with "
                                   "--distances of its columns (default: all)",
                                   needs.from_database));
    const auto [device, memory] = add_computing_options(command, options);
    computed_only.insert(computed_only.end(), {device, memory});
    command.parse_complete_callback([distances, computed_only, &options] {
        if (distances->count() == 0 || is_tile_folder(options.distances)) {
            return;  // tiles are refined from their database
        }
        for (const auto* other : computed_only) {
            if (other->count() > 0) {
                throw CLI::ExcludesError(distances->get_name(), other->get_name());
            }
        }
    });
    return distances;
}

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

Computation open_computation(const DistanceOptions& options, const MetricNeeds& needs,
                             const pipeline::Control& control) {
    const auto texts = split_list(options.metrics.value_or(needs.from_database), "--metrics");
    auto metrics = pipeline::open_metrics(texts);
    require_metrics(metrics.size(), needs);
    Computation result;
    result.opened = open_for_distances(options, std::move(metrics), control);
    result.left_out =
        pipeline::leave_out_empty(result.opened.metrics, texts, result.opened.database->grid());
    for (const auto& metric : result.opened.metrics) {
        result.metrics.push_back(&metric);
    }
    return result;
}

OpenedDatabase open_for_distances(const DistanceOptions& options,
                                  std::vector<engine::Metric> metrics,
                                  const pipeline::Control& control) {
    OpenedDatabase result;
    result.metrics = std::move(metrics);
    result.database = open_database(options.database);  // which has no threads of its own
    std::vector<const engine::Metric*> pointers;
    for (const auto& metric : result.metrics) {
        pointers.push_back(&metric);
    }
    result.engines = tried_engines(options.device, pointers, control);
    try_metrics(pointers, *result.engines);
    return result;
}

void with_memory_advice(const std::function<void()>& compute) {
    try {
        compute();
    } catch (const MemoryError& error) {
        throw MemoryError(fmt::format("--memory: {}", error.what()));
    } catch (const device::AllocationError& error) {
        throw device::AllocationError(
            fmt::format("{}; a smaller --memory makes smaller slabs", error.what()));
    }
}

nlohmann::ordered_json computing_options_json(const DistanceOptions& options) {
    nlohmann::ordered_json json = {
        {"device", options.device}, {"memory_bytes", options.memory}, {"threads", options.threads}};
    const auto& [materials, exclude] = options.database.materials;
    for (const auto& [key, patterns] :
         {std::pair("materials", &materials), {"exclude", &exclude}}) {
        if (!patterns->empty()) {
            json[key] = texts_json(*patterns);
        }
    }
    if (!options.database.grid.empty()) {
        json["grid"] = options.database.grid;
    }
    if (options.database.phi_d_range) {
        json["phi_d_range"] = engine::range_name(*options.database.phi_d_range);
    }
    if (options.database.skip_bad) {
        json["skip_bad"] = true;
    }
    return json;
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
                                   const pipeline::Control& control) {
    return obtain<pipeline::PairDistances>(
        options, needs, control,
        [&](engine::Engines& engines, const engine::Database& database, const auto& metrics) {
            return pipeline::compute_pair_distances(engines, database, metrics, options.memory,
                                                    control);
        },
        [&](const auto& columns) {
            return pipeline::read_pair_distances(options.distances, columns, control);
        },
        [&](const TileFolder& folder, const auto& columns) {
            return folder.read(columns, control);
        });
}

ObtainedListedDistances obtain_listed_distances(const DistanceOptions& options,
                                                const MetricNeeds& needs, const PairsOf& pairs_of,
                                                const pipeline::Control& control) {
    return obtain<pipeline::ListedPairDistances>(
        options, needs, control,
        [&](engine::Engines& engines, const engine::Database& database, const auto& metrics) {
            return pipeline::compute_listed_distances(engines, database, metrics,
                                                      pairs_of(database.materials()),
                                                      options.memory, control);
        },
        [&](const auto& columns) {
            auto all = pipeline::read_listed_distances(options.distances, columns, control);
            const auto pairs = pairs_of(all.table.names);
            return pipeline::pick_distances(std::move(all), pairs);
        },
        [&](const TileFolder& folder, const auto& columns) {
            return folder.read_listed(columns, pairs_of(folder.manifest().materials()), control);
        });
}

void warn(pipeline::Provenance& provenance, const std::string& text) {
    print_warning(text);
    provenance.warnings.push_back(text);
}

void warn_if_all_are_zero(pipeline::Provenance& provenance, const std::string& metric,
                          std::span<const double> values) {
    if (std::ranges::all_of(values, [](double distance) { return distance == 0; })) {
        warn(provenance, fmt::format("all distances under {} are 0", metric));
    }
}

void warn_if_all_are_zero(pipeline::Provenance& provenance,
                          std::span<const scan::MetricColumn> columns) {
    for (const auto& column : columns) {
        warn_if_all_are_zero(provenance, column.metric, column.values);
    }
}

}  // namespace merl::app
