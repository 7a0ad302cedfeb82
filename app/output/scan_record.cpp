#include "app/output/scan_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "app/cli/progress.h"
#include "engine/base/error.h"
#include "engine/base/text.h"
#include "engine/database/bad_files.h"
#include "engine/database/blends_database.h"
#include "engine/database/content_hash.h"
#include "engine/database/merl_file.h"
#include "engine/database/model_database.h"
#include "scan/io/input.h"
#include "scan/io/json_format.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// A text of an object; empty if there is none.
std::string text_of(const ordered_json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

/// The texts of an object in an object, by key; none if there is none.
std::map<std::string, std::string> texts_of(const ordered_json& object, const char* key) {
    std::map<std::string, std::string> texts;
    const auto found = object.find(key);
    if (found != object.end() && found->is_object()) {
        for (const auto& [name, text] : found->items()) {
            if (text.is_string()) {
                texts[from_utf8(name)] = text.get<std::string>();
            }
        }
    }
    return texts;
}

/// The metrics of `votes`, if it wrote the summary: everything it counts is on their disagreements.
std::vector<std::string> judged_metrics(const ordered_json& json) {
    const auto figures = json.find("figures");
    if (figures == json.end() || !figures->is_object() || !figures->contains("metrics")) {
        return {};
    }
    std::vector<std::string> metrics;
    for (const auto& metric : (*figures)["metrics"]) {
        if (metric.is_string()) {
            metrics.push_back(metric.get<std::string>());
        }
    }
    return metrics;
}

/// The grid of a database; none where that is missing or no grid.
std::optional<engine::Grid> grid_of(const ordered_json& database) {
    engine::Grid grid;
    const auto found = database.find("grid");
    if (found == database.end() || !found->is_object()) {
        return std::nullopt;
    }
    for (const auto& [key, side] : {std::pair("theta_h", &grid.theta_h),
                                    {"theta_d", &grid.theta_d},
                                    {"phi_d", &grid.phi_d}}) {
        const auto number = found->find(key);
        if (number == found->end() || !number->is_number_unsigned() ||
            number->get<std::uint64_t>() > engine::kMaxSide) {
            return std::nullopt;
        }
        *side = number->get<std::uint32_t>();
    }
    // Older ones were all read as if they ended at pi.
    if (text_of(*found, "phi_d_range") == engine::range_name(engine::PhiDRange::two_pi)) {
        grid.phi_d_range = engine::PhiDRange::two_pi;
    }
    return grid;
}

RecordedDatabase recorded_database(const ordered_json& json) {
    // Older summaries have the path as it was given, which is the name.
    return {.label = text_of(json, "label"),
            .name = from_utf8(text_of(json, "name")),
            .kind = text_of(json, "kind"),
            .path = from_utf8(text_of(json, json.contains("path") ? "path" : "name")),
            .content_hash = text_of(json, "content_hash")};
}

/// The databases that were joined, or the one that was not.
std::vector<RecordedDatabase> recorded_databases(const ordered_json& database) {
    const auto joined = database.find("databases");
    if (joined == database.end() || !joined->is_array()) {
        return {recorded_database(database)};
    }
    std::vector<RecordedDatabase> databases;
    for (const auto& one : *joined) {
        if (one.is_object()) {
            databases.push_back(recorded_database(one));
        }
    }
    return databases;
}

/// Where phi_d ends, if that is not what the sizes of a grid say.
std::optional<engine::PhiDRange> unusual_range(const std::optional<engine::Grid>& grid) {
    const bool is_usual = !grid || engine::is_over_all_of_phi_d(*grid) ==
                                       (grid->phi_d_range == engine::PhiDRange::two_pi);
    return is_usual ? std::nullopt : std::optional(grid->phi_d_range);
}

/// Whether a summary without hashes of files may be that of a selection.
bool counts_the_same(const ordered_json& json, const scan::SelectionFile& selection) {
    const auto& configurations = selection.configurations;
    const ordered_json metrics = {as_utf8(selection.first_metric),
                                  as_utf8(selection.second_metric)};
    const ordered_json expected = {
        {"configurations", configurations.size()},
        {"agreement_range", {configurations.front().agreement, configurations.back().agreement}}};
    return json.contains("metrics") && json["metrics"] == metrics && json.contains("selection") &&
           json["selection"] == expected;
}

/// What opens a database again. Throws InputError when it is not there.
std::string name_of(const RecordedDatabase& database, const std::string& summary) {
    if (engine::is_model(database.path) || engine::is_blends(database.path)) {
        return database.path;
    }
    // Of the built-in database, which was the only one of its kind, older summaries have no path.
    if (database.kind == engine::built_in_kind) {
        return engine::kBuiltInModel;
    }
    if (database.path.empty()) {
        throw InputError(fmt::format(
            "{} does not say where the database of the scan is ({}); --database names it", summary,
            database.kind));
    }
    std::error_code ignored;
    if (!std::filesystem::exists(database.path, ignored)) {
        throw InputError(
            fmt::format("{}: the database of the scan, which {} names, is not there any more; "
                        "--database says where it is now",
                        database.path, summary));
    }
    // From the same working directory it is called as it was.
    const auto here = std::filesystem::absolute(database.name).lexically_normal();
    return here == database.path ? database.name : database.path;
}

}  // namespace

ScanRecord record_of(const ordered_json& json, const std::string& summary) {
    ScanRecord record;
    record.summary = summary;
    record.files = texts_of(json, "files");
    record.selected_by = judged_metrics(json);
    if (const auto reference = json.find("reference");
        reference != json.end() && reference->is_object()) {
        record.reference = text_of(*reference, "label");
    }
    for (const char* const key : {"database", "distances"}) {
        if (json.contains(key) && json[key].is_object()) {
            record.source[key] = json[key];
        }
    }
    if (record.source.contains("database")) {
        const auto& database = record.source["database"];
        record.kind = text_of(database, "kind");
        record.content_hash = text_of(database, "content_hash");
        record.material_hashes = texts_of(database, "material_hashes");
        record.grid = grid_of(database);
        record.databases = recorded_databases(database);
        record.phi_d_range = unusual_range(record.grid);
        for (const auto& [material, reason] : texts_of(database, "skipped")) {
            record.skipped.push_back({material, from_utf8(reason)});
        }
    }
    return record;
}

FoundRecord find_scan_record(const std::string& file, const std::string& name,
                             const std::string& hash, const scan::SelectionFile* selection) {
    const auto path = std::filesystem::path(file).replace_filename("summary.json");
    const std::string summary = path.string();
    if (!std::filesystem::exists(path)) {
        return {std::nullopt,
                fmt::format("{} is missing{}", summary, scan::stopped_run_beside(summary))};
    }
    std::string text;
    try {
        text = scan::read_input(summary);
    } catch (const InputError& error) {
        return {std::nullopt, error.what()};
    }
    const auto json = ordered_json::parse(text, nullptr, false);
    if (!json.is_object() || !json.contains("program")) {
        return {std::nullopt, fmt::format("{} is no summary of merl-scan", summary)};
    }
    scan::expect_known_format(json, summary);
    auto record = record_of(json, summary);
    const auto known = record.files.find(name);
    const bool is_of_file =
        known != record.files.end()
            ? known->second == hash
            : record.files.empty() && selection != nullptr && counts_the_same(json, *selection);
    if (!is_of_file) {
        return {std::nullopt,
                fmt::format("{} is not of this {}, which is another or was edited", summary, name),
                true};
    }
    return {std::move(record), ""};
}

std::string reference_question(const std::string& reference) {
    return fmt::format("which approximation looks more like the original, of \"{}\"?", reference);
}

std::string ScanRecord::stand_in() const {
    std::string names;
    for (const auto& database : databases) {
        if (database.kind == engine::built_in_kind) {
            names += (names.empty() ? "" : "; ") + as_utf8(database.name);
        }
    }
    return names;
}

engine::DatabaseChoice recorded_choice(const ScanRecord& record) {
    if (!record.has_database() || record.databases.empty()) {
        throw InputError(
            record.source.contains("distances")
                ? fmt::format("{}: the scan was of distances from a table, {}, not of a database; "
                              "--database names that of the materials",
                              record.summary, text_of(record.source["distances"], "file"))
                : fmt::format("{} does not say which database was scanned; --database names it",
                              record.summary));
    }
    engine::DatabaseChoice choice;
    choice.grid = record.grid;
    choice.phi_d_range = record.phi_d_range;
    choice.skipped = record.skipped;
    for (const auto& database : record.databases) {
        choice.databases.push_back({database.label, name_of(database, record.summary)});
    }
    if (!record.material_hashes.empty()) {
        choice.exactly.emplace();
        for (const auto& [material, hash] : record.material_hashes) {
            choice.exactly->push_back(material);
        }
    }
    return choice;
}

engine::DatabaseChoice recorded_grid(const ScanRecord& record) {
    return {.evaluated_on = record.grid.value_or(engine::Grid{}),
            .phi_d_range = record.phi_d_range};
}

ScannedDatabase::ScannedDatabase(const FoundRecord& found, const std::string& selection,
                                 DatabaseOptions options, bool quiet)
    : record_(found.record) {
    if (!record_ && options.databases.empty()) {
        throw InputError(
            fmt::format("{}, so nothing says which database {} is of; --database names it: a "
                        "directory, or {}",
                        found.why_not, selection, engine::kBuiltIn));
    }
    if (options.databases.empty()) {
        options.otherwise = recorded_choice(*record_);
    } else if (record_) {
        options.otherwise = recorded_grid(*record_);
    }
    database_ = open_database(options);
    warnings_ = engine::skipped_lines(*database_);
    if (!record_) {
        warnings_.push_back(fmt::format("{}: whether {} is what was scanned was not checked",
                                        found.why_not, database_->name()));
        return;
    }
    if (!record_->has_database()) {
        warnings_.push_back(
            fmt::format("{} names no database: whether {} is what was scanned was "
                        "not checked",
                        record_->summary, database_->name()));
        return;
    }
    checked_ = true;
    if (!record_->material_hashes.empty()) {
        return;
    }
    Progress progress("checking", quiet);
    if (engine::content_hash_of(*database_, [&](double share) { progress.update(share); }) !=
        record_->content_hash) {
        throw InputError(fmt::format("{}: the content is not what was scanned, which {} names: {}",
                                     database_->name(), record_->summary,
                                     text_of(record_->source["database"], "name")));
    }
}

void ScannedDatabase::check(std::size_t material, const std::string& content_hash) const {
    if (!checked_ || record_->material_hashes.empty()) {
        return;
    }
    const auto& name = database_->materials().at(material);
    const auto scanned = record_->material_hashes.find(name);
    if (scanned == record_->material_hashes.end()) {
        throw InputError(fmt::format("{} has a material \"{}\", which was not scanned, as {} says",
                                     database_->name(), name, record_->summary));
    }
    if (scanned->second != content_hash) {
        throw InputError(
            fmt::format("the samples of \"{}\" in {} are not those that were scanned: their "
                        "content hash is {}, that of the scan, in {}, is {}; give the database of "
                        "the scan with --database, or scan again",
                        name, database_->name(), content_hash, record_->summary, scanned->second));
    }
}

scan::KitDatabase ScannedDatabase::description() const {
    scan::KitDatabase kit = {
        .name = as_utf8(database_->name()),
        .kind = database_->kind(),
        .content_hash = checked_ ? std::optional(record_->content_hash) : std::nullopt,
        .checked = checked_};
    for (const auto& [material, reason] : database_->skipped()) {
        kit.skipped[as_utf8(material)] = as_utf8(reason);
    }
    for (const auto& part : database_->parts()) {
        auto& one = kit.databases.emplace_back(
            scan::KitPart{part.label, as_utf8(part.name), part.kind, std::nullopt});
        if (checked_) {
            const auto scanned =
                std::ranges::find(record_->databases, part.label, &RecordedDatabase::label);
            if (scanned != record_->databases.end() && !scanned->content_hash.empty()) {
                one.content_hash = scanned->content_hash;
            }
        }
    }
    return kit;
}

}  // namespace merl::app
