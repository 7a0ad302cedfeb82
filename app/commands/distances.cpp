#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/interrupt.h"
#include "app/cli/options.h"
#include "app/cli/ranks.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/commands/obtain_distances.h"
#include "app/output/json.h"
#include "app/output/provenance.h"
#include "app/output/tile_folder.h"
#include "app/output/tile_manifest.h"
#include "app/pipeline/distance_tiles.h"
#include "engine/base/error.h"
#include "engine/base/number.h"
#include "engine/base/stopwatch.h"

namespace merl::app {
namespace {

const MetricNeeds kMetrics = {.from_database = "all"};

/// Of the tiles, which this process computes: those whose numbers leave `part` when divided by
/// `parts`.
struct Part {
    std::uint64_t part = 0;
    std::uint64_t parts = 1;

    bool has(std::uint64_t tile) const { return tile % parts == part; }
};

struct Options {
    DistanceOptions distances;
    std::string out;
    std::string part;
    std::uint32_t tile = 0;
    bool quiet = false;
};

/// "3/64" is the third of 64.
std::optional<Part> parse_part(const std::string& text) {
    const auto slash = text.find('/');
    if (slash == std::string::npos) {
        return std::nullopt;
    }
    const auto part = parse_number<std::uint64_t>(text.substr(0, slash));
    const auto parts = parse_number<std::uint64_t>(text.substr(slash + 1));
    return part && parts && *part >= 1 && *part <= *parts
               ? std::optional(Part{.part = *part - 1, .parts = *parts})
               : std::nullopt;
}

CLI::Validator part_of_all() {
    return {[](const std::string& text) {
                return parse_part(text)
                           ? std::string()
                           : fmt::format("expected K/N like 3/64, with K from 1 to N, found \"{}\"",
                                         text);
            },
            ""};
}

/// What this process has done.
struct Work {
    std::uint64_t tiles = 0;
    std::uint64_t bytes = 0;  // of samples
    std::uint64_t peak_bytes = 0;
    double seconds = 0;
};

/// Computes one tile after the other, those that are not there.
class Worker {
  public:
    Worker(const Options& options, const Computation& computation, TileFolder& folder)
        : options_(options), computation_(computation), folder_(folder) {}

    void compute(std::uint64_t tile, const pipeline::Control& control) {
        Stopwatch watch;
        const auto rectangle = folder_.manifest().tiles.at(tile);
        const auto& database = *computation_.opened.database;
        pipeline::DistanceTile computed;
        with_memory_advice([&] {
            computed =
                pipeline::compute_tile(*computation_.opened.engines, database, computation_.metrics,
                                       rectangle, options_.distances.memory, control);
        });
        folder_.write(tile, computed);
        for (const auto& warning : computed.warnings) {
            if (warned_.insert(warning).second) {
                print_warning(warning);
            }
        }
        ++work_.tiles;
        work_.bytes += 3 * sizeof(double) * database.grid().voxels() * rectangle.materials();
        work_.peak_bytes = std::max(work_.peak_bytes, computed.peak_bytes);
        work_.seconds += watch.lap();
    }

    const Work& work() const { return work_; }

  private:
    const Options& options_;
    const Computation& computation_;
    TileFolder& folder_;
    Work work_;
    std::set<std::string> warned_;
};

/// Follows all tiles on one line: those before this one are done or given out.
pipeline::Control control_of_tile(const pipeline::Control& all, std::uint64_t tile,
                                  std::uint64_t tiles) {
    return {.progress =
                [&all, tile, tiles](std::string_view /*stage*/, double share) {
                    all.update("tiles",
                               (static_cast<double>(tile) + share) / static_cast<double>(tiles));
                },
            .stop = all.stop};
}

/// What all processes of this run have done, on average.
Lines work_lines(const Work& own, Ranks& ranks) {
    const auto tiles = ranks.sum(own.tiles);
    const auto bytes = ranks.sum(own.bytes);
    const auto milliseconds = ranks.sum(static_cast<std::uint64_t>(1000 * own.seconds));
    if (tiles == 0) {
        return {};
    }
    const auto count = static_cast<double>(tiles);
    constexpr double kMebi = 1 << 20U;
    return {
        {"computed", fmt::format("{} by {}", counted(tiles, "tile"),
                                 ranks.count() == 1 ? std::string("one process")
                                                    : fmt::format("{} processes", ranks.count()))},
        {"each tile",
         fmt::format("{:.2f} s, {:.1f} MiB of samples read, on average; at most {:.1f} MiB of "
                     "memory",
                     static_cast<double>(milliseconds) / 1000 / count,
                     static_cast<double>(bytes) / kMebi / count,
                     static_cast<double>(own.peak_bytes) / kMebi)}};
}

int run(const Options& options) {
    const auto threads = limit_threads(options.distances.threads);
    TerminalControl terminal(options.quiet);
    const auto opening = terminal.control();
    const auto computation = open_computation(options.distances, kMetrics, opening);
    const auto& database = *computation.opened.database;
    pipeline::require_pairs(database);

    Ranks ranks;  // after what starts processes
    say_when_interrupted("tiles that are finished stay, and the same command computes the others");
    if (ranks.count() > 1 && !options.part.empty()) {
        throw Error(Fault::usage,
                    "--part is for processes that do not know of each other; MPI has "
                    "started several that do");
    }
    TerminalControl of_tiles(options.quiet || ranks.rank() > 0);
    const auto control = of_tiles.control();
    const auto meanwhile = [] { throw_if_interrupted(); };
    auto provenance =
        pipeline::provenance_before(*computation.opened.engines, database, computation.metrics);
    provenance.left_out = computation.left_out;
    TileFolder folder(options.out, manifest_of(provenance, computation.metrics, options.tile));
    const bool speaks = ranks.rank() == 0 && !options.quiet;
    if (ranks.rank() == 0) {
        std::ranges::for_each(provenance.warnings, print_warning);
        folder.sweep();
    }
    const auto tiles = folder.manifest().tiles.count();
    if (speaks) {
        const auto there = folder.count(control);
        of_tiles.clear();
        print_results(source_lines(provenance, database.materials().size()));
        print_result("tiles",
                     fmt::format("{} of {} are there, {} to compute", there, tiles, tiles - there));
        flush_output();
    }
    ranks.wait(meanwhile);  // so that the first has counted before there are more

    const auto part = options.part.empty() ? Part() : *parse_part(options.part);
    Worker worker(options, computation, folder);
    while (const auto tile = ranks.next(tiles, meanwhile)) {
        control.update("tiles", static_cast<double>(*tile) / static_cast<double>(tiles));
        if (part.has(*tile) && !folder.has(*tile)) {
            worker.compute(*tile, control_of_tile(control, *tile, tiles));
        }
    }
    ranks.wait(meanwhile);
    const auto lines = work_lines(worker.work(), ranks);
    if (ranks.rank() == 0) {
        folder.sweep();
    }
    const auto missing = speaks ? tiles - folder.count(control) : 0;
    of_tiles.clear();
    if (speaks) {
        print_results(lines);
        print_results(engine_lines(provenance));
        print_result("results",
                     missing == 0 ? fmt::format("{0}: merl-scan scan --distances {0}", options.out)
                                  : fmt::format("{}: {} of {} tiles are missing", options.out,
                                                missing, tiles));
    }
    return kSuccess;
}

}  // namespace

void add_distances(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "distances",
        "All pair distances in tiles that any number of processes and machines compute");
    add_database_options(*command, options->distances.database);
    command->add_option("--metrics", options->distances.metrics,
                        "Metrics, separated by commas, or all (default: all)");
    add_computing_options(*command, options->distances);
    command
        ->add_option("--out", options->out,
                     "The folder of the tiles, which all processes share; it may be there already")
        ->transform(not_empty())
        ->required();
    command
        ->add_option("--part", options->part,
                     "Compute only part K of N, without MPI: parts may run in any order, at once "
                     "and twice, with the same --tile in all")
        ->transform(part_of_all());
    constexpr std::uint32_t kMost = 65536;
    command
        ->add_option("--tile", options->tile,
                     "Materials along a side of a tile, as the first process says (default: an "
                     "eighth of the materials, 8 to 256)")
        ->transform(whole_number(1, kMost));
    add_quiet_option(*command, options->quiet);
    command->footer(
        std::string(
            "Writes manifest.json, and for each tile a .npy file, which NumPy reads, and a .json\n"
            "(docs/file-formats.md). A tile that is there is not computed again: after a kill, or\n"
            "a signal (SIGINT, SIGTERM, SIGUSR1), the same command does the rest. Then scan,\n"
            "compare and score take the folder as --distances. See docs/many-machines.md.\n"
            "\n") +
        kMetricsHelp + "\n" + kDatabaseHelp +
        "\n"
        "Examples:\n"
        "  merl-scan distances --database ~/merl/brdfs --out work\n"
        "  mpirun -n 64 merl-scan distances --database ~/merl/brdfs --metrics all --out work\n"
        "  merl-scan distances --database ~/merl/brdfs --out work --part 3/64\n"
        "  merl-scan scan --distances work --out results");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
