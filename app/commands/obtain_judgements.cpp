#include "app/commands/obtain_judgements.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>

#include "app/cli/options.h"
#include "app/output/json.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/text.h"
#include "engine/database/model_database.h"
#include "engine/database/open_database.h"
#include "scan/io/input.h"
#include "scan/score/lagunas.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// Whether the options say which materials there are.
bool names_materials(const DistanceOptions& options) {
    return !options.database.databases.empty() || !options.distances.empty();
}

/// Whether the options choose some of the materials, and all that are left are as they were judged.
bool is_part_of_scan(const DistanceOptions& options, const ScanRecord& scanned,
                     const pipeline::DatabaseProvenance& database) {
    return !options.database.materials.is_all() &&
           std::ranges::all_of(database.materials, [&](const auto& material) {
               const auto found = scanned.material_hashes.find(material.name);
               return found != scanned.material_hashes.end() &&
                      found->second == material.content_hash;
           });
}

Lines unknown_lines(const scan::Judgements& judgements) {
    constexpr std::size_t named = 5;
    std::string names;
    for (std::size_t i = 0; i < std::min(named, judgements.unknown.size()); ++i) {
        names += (i == 0 ? "" : ", ") + judgements.unknown[i].name;
    }
    if (judgements.unknown.empty()) {
        return {};
    }
    return {{"unknown",
             fmt::format("{}, in {} of {}: {}{}", counted(judgements.unknown.size(), "material"),
                         fmt::group_digits(judgements.rows_with_unknown),
                         counted(judgements.rows, "row"), names,
                         judgements.unknown.size() > named ? " … (summary.json)" : "")}};
}

/// Sums over the configurations.
struct Counts {
    explicit Counts(const scan::Judgements& judgements) {
        for (const auto& judgement : judgements.list) {
            untied += judgement.untied() ? 1 : 0;
            votes += judgement.votes();
            equal_votes += judgement.votes_equal;
        }
    }

    std::uint64_t untied = 0;
    std::uint64_t votes = 0;
    std::uint64_t equal_votes = 0;
};

}  // namespace

CLI::Option* add_judgements_option(CLI::App& command, std::string& judgements) {
    return command
        .add_option("--judgements", judgements,
                    "What people said: a CSV file with the columns reference,a,b,votes_a,votes_b "
                    "or left_1,left_2,right_1,right_2,votes_left,votes_equal,votes_right, or the "
                    "JSON of Lagunas et al. 2019")
        ->transform(not_empty());
}

bool ObtainedJudgements::are_selected_by(const std::string& metric) const {
    return scanned &&
           std::ranges::find(scanned->selected_by, as_utf8(metric)) != scanned->selected_by.end();
}

const engine::FittedTo* ObtainedJudgements::fitted_to(
    const pipeline::MetricProvenance& metric) const {
    const auto found = std::ranges::find(metric.fitted, sha256, &engine::FittedTo::sha256);
    return found == metric.fitted.end() ? nullptr : &*found;
}

ObtainedJudgements obtain_judgements(const std::string& file, const DistanceOptions& options,
                                     const pipeline::Control& control) {
    ObtainedJudgements result;
    const std::string text = scan::read_input(file);
    result.content_hash = hash_of(text);
    result.sha256 = sha256_of(text);
    // The published indices are those of the 100 MERL materials, whatever the database has of them.
    const auto merl = scan::lagunas_order(engine::merl_materials());
    result.file = scan::parse_judgements(text, file, merl, control.stage("reading judgements"));
    const std::string kept = "judgements_kept.csv";
    const bool is_kept = std::filesystem::path(file).filename() == kept;
    auto found =
        find_scan_record(file, is_kept ? kept : "judgements.csv", result.content_hash, nullptr);
    result.scanned = std::move(found.record);
    if (found.is_of_another_file && !names_materials(options)) {
        throw InputError(fmt::format(
            "{}, so nothing says which database {} is of; --database names it: a directory, or {}",
            found.why_not, file, engine::kBuiltIn));
    }
    return result;
}

DistanceOptions with_judged_database(DistanceOptions options,
                                     const ObtainedJudgements& judgements) {
    if (judgements.scanned && !names_materials(options)) {
        if (judgements.scanned->source.contains("distances")) {
            throw InputError(fmt::format(
                "{}: the judged selection is of distances from a table, which says nothing of a "
                "database; --database names one, and for score --distances the table",
                judgements.scanned->summary));
        }
        options.database.otherwise = recorded_choice(*judgements.scanned);
    } else if (judgements.scanned) {
        options.database.otherwise = recorded_grid(*judgements.scanned);
    }
    return options;
}

std::vector<std::string> compare_with_judged(const ObtainedJudgements& judgements,
                                             const DistanceOptions& options,
                                             const pipeline::DatabaseProvenance* database) {
    const auto& scanned = judgements.scanned;
    std::vector<std::string> warnings;
    if (!scanned && !names_materials(options)) {
        warnings.push_back(
            fmt::format("{} does not say which materials were judged: distances are those of the "
                        "built-in stand-in; --database names another, or {}",
                        judgements.file.file, engine::kBuiltIn));
    }
    if (!scanned || !scanned->has_database() || database == nullptr ||
        database->content_hash == scanned->content_hash ||
        is_part_of_scan(options, *scanned, *database)) {
        return warnings;
    }
    if (options.database.databases.empty()) {
        throw InputError(fmt::format(
            "{}: the content is not what was scanned and judged, as {} says; --database names a "
            "database to use all the same",
            database->name, scanned->summary));
    }
    warnings.push_back(
        fmt::format("{} has other content than the database that was judged, as {} says",
                    database->name, scanned->summary));
    return warnings;
}

ordered_json judgements_json(const ObtainedJudgements& judgements,
                             const scan::Judgements& resolved) {
    const Counts counts(resolved);
    ordered_json unknown = ordered_json::object();
    for (const auto& [name, rows] : resolved.unknown) {
        unknown[as_utf8(name)] = rows;
    }
    return {{"file", as_utf8(judgements.file.file)},
            {"format", judgements.file.format},
            {"content_hash", judgements.content_hash},
            {"sha256", judgements.sha256},
            {"rows", resolved.rows},
            {"rows_with_unknown_materials", resolved.rows_with_unknown},
            {"unknown_materials", unknown},
            {"configurations", resolved.list.size()},
            {"without_votes", resolved.without_votes},
            {"untied", counts.untied},
            {"votes", counts.votes},
            {"equal_votes", counts.equal_votes},
            {"selected_by", judgements.scanned ? ordered_json(judgements.scanned->selected_by)
                                               : ordered_json::array()}};
}

std::string judgements_text(const scan::Judgements& judgements) {
    const Counts counts(judgements);
    return fmt::format(
        "{}, {} with a majority; {}{}", counted(judgements.list.size(), "configuration"),
        fmt::group_digits(counts.untied), counted(counts.votes, "vote"),
        counts.equal_votes == 0
            ? ""
            : fmt::format(", {} of them equal", fmt::group_digits(counts.equal_votes)));
}

Lines judgements_lines(const ObtainedJudgements& judgements, const scan::Judgements& resolved) {
    Lines lines = {
        {"judgements", fmt::format("{}, {}", judgements.file.file, judgements.file.format)},
        {"", judgements_text(resolved)}};
    if (resolved.without_votes > 0) {
        lines.emplace_back(
            "", counted(resolved.without_votes, "configuration") + " without a vote left out");
    }
    for (auto& line : unknown_lines(resolved)) {
        lines.push_back(std::move(line));
    }
    return lines;
}

}  // namespace merl::app
