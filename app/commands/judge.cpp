#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/database_options.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/progress.h"
#include "app/cli/sphere_options.h"
#include "app/cli/terminal.h"
#include "app/cli/tried_device.h"
#include "app/commands/commands.h"
#include "app/output/image_file.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "app/output/scan_record.h"
#include "app/pages/judge_page.h"
#include "app/pages/judge_study.h"
#include "app/pipeline/spheres.h"
#include "app/pipeline/version.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "engine/base/text.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"
#include "scan/pairs/distance_table.h"
#include "scan/pairs/material_labels.h"
#include "scan/reference/approximations_file.h"
#include "scan/select/selection_file.h"
#include "scan/votes/kit_file.h"
#include "scan/votes/kit_plan.h"
#include "scan/votes/reference_kit_plan.h"

namespace merl::app {
namespace {

struct Options {
    std::string selection;
    std::string pairs;
    std::string out = "merl-scan-kit";
    std::string study;
    bool study_template = false;
    std::string post;
    DatabaseOptions database;
    scan::KitPlan plan;
    bool keep_sides = false;
    bool keep_pairs = false;
    bool keep_order = false;
    SphereImageOptions image = {.view = {.sphere = {.size = 400}}};
    bool force = false;
    bool quiet = false;
};

/// The file of all distances of the scan, which sentinels and random disagreements are drawn from:
/// that of --pairs, or the one of this name beside the selection.
struct DistanceFile {
    std::string path;
    std::string text;
};

DistanceFile read_distance_file(const Options& options, const std::string& name,
                                const FoundRecord& found) {
    const auto beside = std::filesystem::path(options.selection).replace_filename(name);
    DistanceFile file{.path = options.pairs.empty() ? beside.string() : options.pairs, .text = {}};
    if (options.pairs.empty() && !std::filesystem::exists(beside)) {
        throw InputError(
            fmt::format("{} is missing: sentinels and random disagreements are drawn from "
                        "all distances; name the file with --pairs, or do without: "
                        "--sentinels 0 --random 0",
                        file.path));
    }
    file.text = scan::read_input(file.path);
    if (options.pairs.empty() && found.record && found.record->files.contains(name) &&
        found.record->files.at(name) != hash_of(file.text)) {
        throw InputError(
            fmt::format("{}: is not the file that {} was written with; scan "
                        "again, or name the right one with --pairs",
                        file.path, found.record->summary));
    }
    return file;
}

/// What judges are shown, and on what they practise.
struct Trials {
    std::vector<scan::KitTrial> list;
    std::vector<scan::FourMaterials> practice;
    std::uint64_t sentinel_pairs = 0;  ///< that sentinels are drawn from
};

bool needs_distances(const scan::KitPlan& plan) {
    return plan.sentinels > 0 || plan.random > 0;
}

/// So many to practise on: the side that does not change is the left one, then the right one, and
/// so on, with materials of other rows of the selection.
std::vector<scan::FourMaterials> practices(const scan::SelectionFile& selection,
                                           scan::FourMaterials first, std::size_t count) {
    const auto& rows = selection.configurations;
    std::vector<scan::FourMaterials> list = {std::move(first)};
    for (std::size_t i = 1; i < count; ++i) {
        // Of an original both sides begin with it.
        const auto& row = rows[rows.size() - 1 - i % rows.size()].materials;
        list.push_back(i % 2 == 0 ? scan::FourMaterials{row[0], row[0], row[0], row[1]}
                                  : scan::FourMaterials{row[2], row[3], row[2], row[2]});
    }
    return list;
}

std::size_t practice_count(const Study& study) {
    return study.settings["practice"]["trials"].get<std::size_t>();
}

/// Which of two pairs is more alike?
Trials pair_trials(const Options& options, const scan::SelectionFile& selection,
                   const FoundRecord& found, const Study& study) {
    std::optional<scan::Distances> distances;
    if (needs_distances(options.plan)) {
        Progress progress("reading", options.quiet);
        const auto file = read_distance_file(options, "pairs.csv", found);
        distances =
            scan::parse_distance_table(file.text, file.path,
                                       std::vector{selection.first_metric, selection.second_metric},
                                       [&](double share) { progress.update(share); })
                .distances(0, 1);
        scan::expect_same_scan(selection, *distances, file.path);
    }
    return {.list = scan::plan_kit(selection, distances ? &*distances : nullptr, options.plan),
            .practice = practices(selection, scan::practice_of(selection), practice_count(study)),
            .sentinel_pairs =
                options.plan.sentinels > 0 ? scan::sentinel_pairs(distances->pairs()) : 0};
}

/// Which of two approximations looks more like the original?
Trials reference_trials(const Options& options, const scan::SelectionFile& selection,
                        const FoundRecord& found, const Study& study) {
    const auto& reference = found.record->reference;
    scan::expect_reference(selection, reference);
    std::vector<scan::ApproximationDistances> approximations;
    if (needs_distances(options.plan)) {
        const auto file = read_distance_file(options, "approximations.csv", found);
        approximations = scan::parse_approximations(file.text, file.path, selection.first_metric,
                                                    selection.second_metric);
        scan::expect_same_scan(selection, approximations, file.path);
    }
    return {.list = scan::plan_reference_kit(selection, approximations, options.plan),
            .practice =
                practices(selection, scan::reference_practice(selection), practice_count(study)),
            .sentinel_pairs = options.plan.sentinels > 0
                                  ? scan::sentinel_approximations(approximations.size())
                                  : 0};
}

/// Where in the database the materials are. Throws InputError when it does not have one, or a name
/// is not UTF-8, which the page could not write back.
std::vector<std::size_t> places_of(const std::vector<std::string>& materials,
                                   const engine::Database& database) {
    std::vector<std::size_t> places;
    for (const auto& name : materials) {
        const auto& all = database.materials();
        const auto place = std::ranges::find(all, name);
        if (place == all.end()) {
            throw InputError(
                fmt::format("the selection has a material \"{}\", which {} has not; "
                            "--database names the database of the scan",
                            name, database.name()));
        }
        try {
            (void)nlohmann::json(name).dump();
        } catch (const nlohmann::json::exception&) {
            throw InputError(
                fmt::format("the name of the material \"{}\" is not UTF-8; a page cannot "
                            "write it into votes: rename the file and scan again",
                            name));
        }
        places.push_back(static_cast<std::size_t>(place - all.begin()));
    }
    return places;
}

scan::KitView kit_view(const pipeline::SphereView& view) {
    return {.size = view.sphere.size,
            .field_of_view = view.sphere.field_of_view,
            .lights = view.sphere.lights,
            .exposure = view.exposure,
            .background = view.background,
            .encoding = pipeline::encoding_name(view.encoding)};
}

/// The kit before its spheres are rendered.
scan::Kit kit_of(const Options& options, const ScannedDatabase& scanned,
                 const scan::SelectionFile& selection, const std::string& selection_hash,
                 const std::string& reference, Trials trials, const Study& study) {
    std::vector<std::string> warnings;
    std::ranges::transform(scanned.warnings(), std::back_inserter(warnings), as_utf8);
    return {.file = {},
            .version = pipeline::kVersion,
            .kit_hash = {},
            .selection_hash = selection_hash,
            .first_metric = as_utf8(selection.first_metric),
            .second_metric = as_utf8(selection.second_metric),
            .reference = reference,
            .database = scanned.description(),
            .warnings = warnings,
            .plan = options.plan,
            .sentinel_pairs = trials.sentinel_pairs,
            // An original has a place of its own.
            .lots = {.sides = !options.keep_sides,
                     .pairs = !options.keep_pairs && reference.empty(),
                     .order = !options.keep_order},
            .view = kit_view(options.image.complete_view()),
            .practice = trials.practice.front(),
            .trials = std::move(trials.list),
            .more_practice = {trials.practice.begin() + 1, trials.practice.end()},
            .study = study.hash.empty() ? "" : study.settings.dump(),
            .study_hash = study.hash,
            .post = options.post};
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

/// What PNG cuts off of the spheres.
std::string clipping_of(const scan::Kit& kit) {
    std::size_t all = 0;
    std::size_t clipped = 0;
    std::pair<double, std::string> most = {0, ""};
    const auto shown = scan::shown_materials(kit);
    for (std::size_t m = 0; m < kit.clipped.size(); ++m) {
        for (const double share : kit.clipped[m]) {
            ++all;
            clipped += share > 0 ? 1 : 0;
            most = std::max(most, {share, shown[m]});
        }
    }
    return clipped_text(clipped, all, most.first, most.second);
}

void print_summary(const Options& options, const engine::Database& database, const scan::Kit& kit,
                   std::size_t materials, const std::string& device, double seconds,
                   std::size_t bytes) {
    const auto count = [&](scan::TrialKind kind) {
        return static_cast<std::uint64_t>(
            std::ranges::count(kit.trials, kind, &scan::KitTrial::kind));
    };
    print_result("database", database_text(database));
    if (!kit.reference.empty()) {
        print_result("question", reference_question(kit.reference));
    }
    print_result("trials",
                 fmt::format("{}: {} of the selection, {}, {}, {}", kit.trials.size(),
                             count(scan::TrialKind::selection),
                             counted(count(scan::TrialKind::repeat), "repeat"),
                             counted(count(scan::TrialKind::sentinel), "sentinel"),
                             counted(count(scan::TrialKind::random), "random disagreement")));
    if (kit.sentinel_pairs > 0) {
        const auto drawn = fmt::group_digits(kit.sentinel_pairs);
        print_result(
            "sentinels",
            fmt::format("{} of {}, {}", count(scan::TrialKind::sentinel), kit.plan.sentinels,
                        kit.reference.empty()
                            ? fmt::format("from the {} closest and the {} farthest of all pairs",
                                          drawn, drawn)
                            : fmt::format("an original itself against one of the {} farthest "
                                          "approximations",
                                          drawn)));
    }
    if (count(scan::TrialKind::random) < kit.plan.random) {
        print_result("random", fmt::format("{} of {}: no more disagreements were found beside the "
                                           "selection",
                                           count(scan::TrialKind::random), kit.plan.random));
    }
    print_result("spheres", fmt::format("{}, {}", counted(materials, "material"),
                                        counted(options.image.lights.size(), "light")));
    print_result("clipped", clipping_of(kit));
    if (!kit.study.empty()) {
        print_result("study", options.study);
    }
    if (!kit.post.empty()) {
        print_result("post", fmt::format("answers are sent to {}", kit.post));
    }
    print_result("device", device);
    print_result("seconds", fmt::format("{:.2f}", seconds));
    print_result("kit",
                 fmt::format("{}: open index.html in a browser ({:.1f} MB); keep kit.json for "
                             "`merl-scan votes`",
                             options.out, static_cast<double>(bytes) / 1e6));
}

/// Whether every row has one material of another label than two of the same name beside it.
bool is_of_originals(const scan::SelectionFile& selection) {
    return std::ranges::all_of(selection.configurations, [](const auto& configuration) {
        const auto& [left_1, left_2, right_1, right_2] = configuration.materials;
        const auto original = scan::labelled(left_1);
        return left_1 == right_1 && !original.label.empty() &&
               original.name == scan::labelled(left_2).name &&
               original.name == scan::labelled(right_2).name;
    });
}

int run(const Options& options) {
    if (options.study_template) {
        print_lines(study_template());
        return kSuccess;
    }
    if (options.selection.empty()) {
        throw Error(Fault::usage, "--selection is required: the selection.csv of a scan");
    }
    std::string html;
    scan::Kit kit;
    OutputDirectory out(
        options.out, options.force,
        {{.name = "index.html", .write = [&](int file) { scan::write_all(file, html); }},
         {.name = "kit.json",
          .write = [&](int file) { scan::write_all(file, scan::kit_text(kit)); }}},
        {options.selection, options.pairs, options.study});
    if (!options.post.empty()) {
        (void)origin_of(options.post);
    }
    Stopwatch watch;
    const auto view = options.image.complete_view();
    const std::string text = scan::read_input(options.selection, scan::max_trials_bytes);
    const auto selection = scan::parse_selection(text, options.selection);
    const auto found =
        find_scan_record(options.selection, "selection.csv", hash_of(text), &selection);
    const std::string reference = found.record ? found.record->reference : "";
    if (!found.record && is_of_originals(selection)) {
        throw InputError(fmt::format(
            "{}: its rows are of originals and two approximations, as scan --reference writes "
            "them, "
            "and {}, which says so; put that summary.json beside it, or judges are asked for pairs",
            options.selection, found.why_not));
    }
    const auto study = options.study.empty()
                           ? default_study(!reference.empty())
                           : parse_study(scan::read_input(options.study, max_study_bytes),
                                         options.study, !reference.empty());
    auto trials = reference.empty() ? pair_trials(options, selection, found, study)
                                    : reference_trials(options, selection, found, study);
    const ScannedDatabase scanned(found, options.selection, options.database, options.quiet);
    std::ranges::for_each(scanned.warnings(), print_warning);
    const auto& database = scanned.database();
    kit = kit_of(options, scanned, selection, hash_of(text), reference, std::move(trials), study);
    const auto shown = scan::shown_materials(kit);
    const auto places = places_of(shown, database);
    Images images(shown.size());
    kit.exposures.resize(shown.size());
    kit.clipped.resize(shown.size());
    const bool by_image = study.settings["spheres"]["exposure"] == "by image";
    std::uint64_t bytes = 0;
    TerminalControl terminal(options.quiet);
    const auto context = tried_device(options.image.device, terminal.control());
    const auto device = pipeline::render_spheres(
        database, places, view, context,
        [&](const engine::SphereImage& sphere, const pipeline::Image& linear) {
            scanned.check(places[sphere.material], sphere.content_hash);
            kit.database.material_hashes[shown[sphere.material]] = sphere.content_hash;
            auto& lights = images[sphere.material];
            auto shown_view = view;
            if (by_image) {
                shown_view.exposure += pipeline::exposure_by_image(sphere.pixels);
            }
            lights.push_back(png_file(pipeline::displayed(
                by_image ? pipeline::exposed(sphere.pixels, shown_view) : linear, shown_view)));
            kit.exposures[sphere.material].push_back(shown_view.exposure);
            kit.clipped[sphere.material].push_back(
                pipeline::clipped_share(sphere.pixels, shown_view.exposure));
            require_page(bytes += lights.back().size());
        },
        terminal.control());
    terminal.clear();
    kit.kit_hash = scan::kit_hash_of(kit, images);
    html = judge_page(kit, study, images);
    out.finish();
    if (!options.quiet) {
        print_summary(options, database, kit, shown.size(), device_text(device), watch.lap(),
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
                    "Configurations on which both metrics agree strongly, or after scan "
                    "--reference the original itself beside a far approximation")
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
    add_selection_option(*command, options->selection,
                         "of a scan; needed unless --study-template is given");
    command
        ->add_option("--study", options->study,
                     "A study file: consent, questions, timing, calibration, what is recorded, and "
                     "all texts")
        ->transform(not_empty());
    command->add_flag("--study-template", options->study_template,
                      "Print a study file with every setting as it is by default, explained, and "
                      "do nothing else");
    command
        ->add_option("--post", options->post,
                     "The address, http or https, that the page sends each judge's file to "
                     "(default: nothing is sent)")
        ->transform(not_empty());
    command
        ->add_option("--pairs", options->pairs,
                     "The pairs.csv of the same scan, or its approximations.csv after "
                     "scan --reference (default: the one beside the selection)")
        ->transform(not_empty());
    add_database_options(
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
        "After scan --reference they see the original between two approximations, and say which\n"
        "of the two looks more like it.\n"
        "\n"
        "Examples:\n"
        "  merl-scan judge --selection results/selection.csv --out kit\n"
        "  merl-scan judge --selection fits/selection.csv --random 20 --out kit\n"
        "  merl-scan judge --study-template > study.json\n"
        "  merl-scan judge --selection results/selection.csv --study study.json --out kit\n"
        "  merl-scan judge --selection results/selection.csv --light 1,1,1 --light -1,1,-0.5 --out "
        "kit");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
