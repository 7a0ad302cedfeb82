#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/guard.h"
#include "app/cli/options.h"
#include "app/cli/progress.h"
#include "app/cli/sphere_options.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/output/image_file.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "app/output/scan_record.h"
#include "app/pages/judge_page.h"
#include "app/pipeline/spheres.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "engine/device/context.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"
#include "scan/pairs/distance_table.h"
#include "scan/select/selection_file.h"
#include "scan/votes/kit.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

struct Options {
    std::string selection;
    std::string pairs;
    std::string out = "merl-scan-kit";
    std::string database;
    scan::KitPlan plan;
    bool keep_sides = false;
    bool keep_pairs = false;
    bool keep_order = false;
    SphereImageOptions image = {.view = {.sphere = {.size = 400}}};
    bool force = false;
    bool quiet = false;
};

/// The distances of every pair, which sentinels and random disagreements are drawn from.
std::optional<scan::Distances> read_distances(const Options& options,
                                              const scan::SelectionFile& selection,
                                              const FoundRecord& found) {
    if (options.plan.sentinels == 0 && options.plan.random == 0) {
        return std::nullopt;
    }
    const auto beside = std::filesystem::path(options.selection).replace_filename("pairs.csv");
    const std::string file = options.pairs.empty() ? beside.string() : options.pairs;
    if (options.pairs.empty() && !std::filesystem::exists(beside)) {
        throw InputError(
            fmt::format("{} is missing: sentinels and random disagreements are drawn from "
                        "all distances; name the file with --pairs, or do without: "
                        "--sentinels 0 --random 0",
                        file));
    }
    const std::vector<std::string> metrics = {selection.first_metric, selection.second_metric};
    Progress progress("reading", options.quiet);
    const std::string text = scan::read_input(file);
    if (options.pairs.empty() && found.record && found.record->files.contains("pairs.csv") &&
        found.record->files.at("pairs.csv") != hash_of(text)) {
        throw InputError(
            fmt::format("{}: is not the file that {} was written with; scan "
                        "again, or name the right one with --pairs",
                        file, found.record->summary));
    }
    const auto table = scan::parse_distance_table(text, file, metrics,
                                                  [&](double share) { progress.update(share); });
    auto distances = table.distances(0, 1);
    scan::expect_same_scan(selection, distances, file);
    return distances;
}

/// The materials that a kit shows, each once, and where they are in the database.
class ShownMaterials {
  public:
    explicit ShownMaterials(const engine::Database& database) : database_(database) {}

    /// The number of a material in the kit. Throws Error (input) when the database does not have
    /// it, or its name is not UTF-8, which the page could not write back.
    std::size_t number(const std::string& name) {
        const auto found = std::ranges::find(names_, name);
        if (found != names_.end()) {
            return static_cast<std::size_t>(found - names_.begin());
        }
        const auto& all = database_.materials();
        const auto place = std::ranges::find(all, name);
        if (place == all.end()) {
            throw InputError(
                fmt::format("the selection has a material \"{}\", which {} has not; "
                            "--database names the database of the scan",
                            name, database_.name()));
        }
        try {
            (void)ordered_json(name).dump();
        } catch (const ordered_json::exception&) {
            throw InputError(
                fmt::format("the name of the material \"{}\" is not UTF-8; a page cannot "
                            "write it into votes: rename the file and scan again",
                            name));
        }
        names_.push_back(name);
        places_.push_back(static_cast<std::size_t>(place - all.begin()));
        return names_.size() - 1;
    }

    const std::vector<std::string>& names() const { return names_; }
    const std::vector<std::size_t>& places() const { return places_; }

  private:
    const engine::Database& database_;
    std::vector<std::string> names_;
    std::vector<std::size_t> places_;
};

ordered_json trial_json(const scan::PlannedTrial& trial) {
    const auto& m = trial.materials;
    ordered_json json = {{"configuration", trial.configuration},
                         {"kind", scan::kind_name(trial.kind)},
                         {"left", {m[0], m[1]}},
                         {"right", {m[2], m[3]}}};
    if (trial.expected != 0) {
        json["expected"] = trial.expected;
    }
    json["agreement"] = trial.agreement ? ordered_json(*trial.agreement) : ordered_json();
    return json;
}

/// One side changes, the other does not: nobody can be wrong about what is meant.
scan::FourMaterials practice_of(const scan::SelectionFile& selection) {
    const auto& last = selection.configurations.back().materials;
    return {last[0], last[0], last[0], last[1]};
}

ordered_json kit_json(const Options& options, const ScannedDatabase& scanned,
                      const scan::SelectionFile& selection, const std::string& selection_hash,
                      const std::vector<scan::PlannedTrial>& trials) {
    ordered_json list = ordered_json::array();
    for (const auto& trial : trials) {
        list.push_back(trial_json(trial));
    }
    const auto practice = practice_of(selection);
    ordered_json chosen = {{"repeats_percent", options.plan.repeats},
                           {"sentinels", options.plan.sentinels},
                           {"random", options.plan.random},
                           {"randomise",
                            {{"sides", !options.keep_sides},
                             {"pairs", !options.keep_pairs},
                             {"order", !options.keep_order}}}};
    chosen.update(view_json(options.image.complete_view()));
    ordered_json json = program_json();
    json.update(ordered_json{
        {"kit_hash", ""},
        {"seed", options.plan.seed},
        {"selection_hash", selection_hash},
        {"metrics", {as_utf8(selection.first_metric), as_utf8(selection.second_metric)}},
        {"database", scanned.description()},
        {"warnings", texts_json(scanned.warnings())},
        {"options", chosen},
        {"practice", {{"left", {practice[0], practice[1]}}, {"right", {practice[2], practice[3]}}}},
        {"trials", list}});
    return json;
}

/// What the page needs of the kit: materials by number, no metric, no expectation.
ordered_json page_json(const ordered_json& kit, ShownMaterials& shown) {
    const auto numbers = [&](const ordered_json& pair) -> ordered_json {
        return {shown.number(pair[0].get<std::string>()), shown.number(pair[1].get<std::string>())};
    };
    ordered_json trials = ordered_json::array();
    for (const auto& trial : kit["trials"]) {
        trials.push_back({{"configuration", trial["configuration"]},
                          {"kind", trial["kind"]},
                          {"left", numbers(trial["left"])},
                          {"right", numbers(trial["right"])}});
    }
    const auto& practice = kit["practice"];
    return {
        {"kit_hash", ""},
        {"seed", kit["seed"]},
        {"randomise", kit["options"]["randomise"]},
        {"background", kit["options"]["background"]},
        {"practice", {{"left", numbers(practice["left"])}, {"right", numbers(practice["right"])}}},
        {"trials", trials},
        {"materials", shown.names()}};
}

/// PNG files, [material][light].
using Images = std::vector<std::vector<std::string>>;

/// Throws Error (usage) when the images of the page have too many bytes.
void require_page(std::uint64_t bytes) {
    constexpr std::uint64_t kMost = std::uint64_t{256} << 20U;
    if (bytes > kMost) {
        throw Error(Fault::usage,
                    fmt::format("the spheres have more than {} MiB, which no browser takes in one "
                                "page; choose a smaller --size, or fewer lights or configurations",
                                kMost >> 20U));
    }
}

std::string kit_hash(const ordered_json& kit, const Images& images) {
    std::string all = kit.dump();
    for (const auto& lights : images) {
        for (const auto& image : lights) {
            all += image;
        }
    }
    return hash_of(all);
}

void print_summary(const Options& options, const engine::Database& database,
                   const std::vector<scan::PlannedTrial>& trials, const ShownMaterials& shown,
                   const std::string& device, double seconds, std::size_t bytes) {
    const auto count = [&](scan::TrialKind kind) {
        return static_cast<std::uint64_t>(
            std::ranges::count(trials, kind, &scan::PlannedTrial::kind));
    };
    print_result("database", fmt::format("{}, {}", database.name(), database.kind()));
    print_result("trials",
                 fmt::format("{}: {} of the selection, {}, {}, {}", trials.size(),
                             count(scan::TrialKind::selection),
                             counted(count(scan::TrialKind::repeat), "repeat"),
                             counted(count(scan::TrialKind::sentinel), "sentinel"),
                             counted(count(scan::TrialKind::random), "random disagreement")));
    print_result("spheres", fmt::format("{}, {}", counted(shown.names().size(), "material"),
                                        counted(options.image.lights.size(), "light")));
    print_result("device", device);
    print_result("seconds", fmt::format("{:.2f}", seconds));
    print_result("kit",
                 fmt::format("{}: open index.html in a browser ({:.1f} MB); keep kit.json for "
                             "`merl-scan votes`",
                             options.out, static_cast<double>(bytes) / 1e6));
}

int run(const Options& options) {
    std::string html;
    ordered_json kit;
    OutputDirectory out(
        options.out, options.force,
        {{.name = "index.html", .write = [&](int file) { scan::write_all(file, html); }},
         {.name = "kit.json",
          .write = [&](int file) { scan::write_all(file, kit.dump(2) + "\n"); }}},
        {options.selection, options.pairs});
    Stopwatch watch;
    const auto view = options.image.complete_view();
    const std::string text = scan::read_input(options.selection, scan::max_trials_bytes);
    const auto selection = scan::parse_selection(text, options.selection);
    const auto found =
        find_scan_record(options.selection, "selection.csv", hash_of(text), &selection);
    const auto distances = read_distances(options, selection, found);
    const auto trials = scan::plan_kit(selection, distances ? &*distances : nullptr, options.plan);
    const ScannedDatabase scanned(found, options.selection, options.database, options.quiet);
    std::ranges::for_each(scanned.warnings(), print_warning);
    const auto& database = scanned.database();
    ShownMaterials shown(database);
    for (const auto& trial : trials) {
        std::ranges::for_each(trial.materials, [&](const auto& name) { shown.number(name); });
    }
    kit = kit_json(options, scanned, selection, hash_of(text), trials);
    auto page = page_json(kit, shown);
    Images images(shown.names().size());
    auto& hashes = kit["database"]["material_hashes"] = ordered_json::object();
    std::uint64_t bytes = 0;
    TerminalControl terminal(options.quiet);
    try_device_where_limited(
        [&] { const device::Context context({.device = options.image.device}); });
    const auto device = pipeline::render_spheres(
        database, shown.places(), view, options.image.device,
        [&](const engine::SphereImage& sphere, const pipeline::Image& linear) {
            scanned.check(shown.places()[sphere.material], sphere.content_hash);
            hashes[shown.names()[sphere.material]] = sphere.content_hash;
            auto& lights = images[sphere.material];
            lights.push_back(png_file(pipeline::displayed(linear, view)));
            require_page(bytes += lights.back().size());
        },
        terminal.control());
    terminal.clear();
    kit["kit_hash"] = page["kit_hash"] = kit_hash(kit, images);
    html = judge_page(page, images);
    out.finish();
    if (!options.quiet) {
        print_summary(options, database, trials, shown, device_text(device), watch.lap(),
                      html.size());
    }
    return kSuccess;
}

void add_plan_options(CLI::App& command, Options& options) {
    constexpr std::uint64_t kExactInJavaScript = (1ULL << 53U) - 1;
    command.add_option("--seed", options.plan.seed, "Decides everything that is drawn by lot")
        ->transform(whole_number(0, kExactInJavaScript))
        ->capture_default_str();
    command
        .add_option("--repeats", options.plan.repeats,
                    "Share of the selection that each judge sees twice, in percent")
        ->transform(number(0, 100))
        ->capture_default_str();
    command
        .add_option("--sentinels", options.plan.sentinels,
                    "Configurations on which both metrics agree strongly")
        ->transform(whole_number(0, 1000))
        ->capture_default_str();
    command
        .add_option("--random", options.plan.random,
                    "Disagreements drawn from all, beside the extreme ones of the selection")
        ->transform(whole_number(0, 1000))
        ->capture_default_str();
    command.add_flag("--keep-sides", options.keep_sides,
                     "Do not exchange left and right by lot for each judge");
    command.add_flag("--keep-pairs", options.keep_pairs,
                     "Do not exchange the two materials of a side by lot");
    command.add_flag("--keep-order", options.keep_order,
                     "Show everybody the selection in its order, then sentinels, random "
                     "disagreements and repeats");
}

}  // namespace

void add_judge(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "judge", "A kit for judges: one page that shows the selection and keeps the votes");
    command->add_option("--selection", options->selection, "The selection.csv of a scan")
        ->transform(not_empty())
        ->required();
    command
        ->add_option("--pairs", options->pairs,
                     "The pairs.csv of the same scan (default: the one beside the selection)")
        ->transform(not_empty());
    add_database_option(
        *command, options->database,
        "where what was scanned is (default: what summary.json beside the selection "
        "says)");
    add_output_options(*command, options->out, options->force);
    add_plan_options(*command, *options);
    add_sphere_options(*command, options->image);
    add_quiet_option(*command, options->quiet);
    command->footer(
        "Writes index.html, which needs no server and no network, and kit.json. Judges open the "
        "page\n"
        "in any browser, in English or Swedish, and save their votes from it "
        "(docs/experiment.md).\n"
        "With several lights each side has a sphere for each. What is shown must be what was\n"
        "scanned: summary.json beside the selection names the database and has its hashes.\n"
        "\n"
        "Examples:\n"
        "  merl-scan judge --selection results/selection.csv --out kit\n"
        "  merl-scan judge --selection results/selection.csv --light 1,1,1 --light -1,1,-0.5 --out "
        "kit");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
