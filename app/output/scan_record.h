#pragma once

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/cli/database_options.h"
#include "engine/base/error.h"
#include "engine/database/database.h"
#include "scan/select/selection_file.h"
#include "scan/votes/kit_file.h"

namespace merl::app {

// What comes after a scan (judge, render, votes, score) uses the database of that scan: the
// summary.json beside a file of results says which it was and what was in it.

/// A database that was scanned; empty texts are not known.
struct RecordedDatabase {
    std::string label;  // where databases were joined
    std::string name;
    std::string kind;
    std::string path;
    std::string content_hash;
};

/// What summary.json says of where its results are from.
struct ScanRecord {
    std::string summary;  // the file, as errors call it
    nlohmann::ordered_json source = nlohmann::ordered_json::object();  // `database`, or `distances`
    std::string kind;  // of the whole; empty where distances were read from a table
    std::vector<RecordedDatabase> databases;  // of which it is made: one, or those that were joined
    std::optional<engine::Grid> grid;
    std::optional<engine::PhiDRange> phi_d_range;  // of MERL files, if not what their sizes say
    std::vector<engine::BadMaterial> skipped;      // what was left out of the scan
    std::string content_hash;
    std::map<std::string, std::string> material_hashes;  // by name; older summaries have none
    std::map<std::string, std::string> files;  // hashes of the other results; older have none
    std::string reference;                 // the label of the originals of a reference scan; UTF-8
    std::vector<std::string> selected_by;  // of judgements: whose disagreements they are on; UTF-8

    bool has_database() const { return !kind.empty(); }

    /// The names of the built-in databases that were scanned, in UTF-8; otherwise empty.
    std::string stand_in() const;
};

/// What judges were asked of a selection whose originals have this label.
std::string reference_question(const std::string& reference);

/// The record of a file of results, or why there is none.
struct FoundRecord {
    std::optional<ScanRecord> record;
    std::string why_not = {};         // "results/summary.json is missing"
    bool is_of_another_file = false;  // of results that were edited, or lie beside others
};

/// Looks into the summary.json beside a file of results of this name (as summaries call it) and
/// this content hash: there is a record only if it is of that very file. `selection` is that file's
/// content if it is a selection; with it summaries without hashes are told by what they count.
/// Throws InputError when a newer version wrote the summary.
FoundRecord find_scan_record(const std::string& file, const std::string& name,
                             const std::string& hash, const scan::SelectionFile* selection);

/// What a summary says, or something else that has its `database`; errors call it `summary`.
ScanRecord record_of(const nlohmann::ordered_json& json, const std::string& summary);

/// What opens the database of a record again: the same databases under the same labels, on the same
/// grid, and of their materials those that were scanned. Throws InputError when one is not there
/// any more, or there was none.
engine::DatabaseChoice recorded_choice(const ScanRecord& record);

/// The same for other databases, which are named: the grid alone, where they leave it open.
engine::DatabaseChoice recorded_grid(const ScanRecord& record);

/// A database for the materials of a selection, and whether it is what was scanned.
class ScannedDatabase {
  public:
    /// Opens what the options name, or without --database that of the record. Where an older record
    /// has no hashes of materials, the whole is read and compared. Throws InputError when there is
    /// neither, or the content is another, and what opening a database throws; Interrupted. Shows
    /// progress unless `quiet`.
    ScannedDatabase(const FoundRecord& found, const std::string& selection, DatabaseOptions options,
                    bool quiet);

    const engine::Database& database() const { return *database_; }

    /// Takes the hash of what was read of a material (SphereImage::content_hash). Throws
    /// InputError unless that is what was scanned, as far as the record knows.
    void check(std::size_t material, const std::string& content_hash) const;

    /// Whether there is a record to check against.
    bool checked() const { return checked_; }

    /// What the user should know.
    const std::vector<std::string>& warnings() const { return warnings_; }

    /// What a kit says of it, but for the hashes of what it shows.
    scan::KitDatabase description() const;

  private:
    std::optional<ScanRecord> record_;
    std::unique_ptr<engine::Database> database_;
    bool checked_ = false;
    std::vector<std::string> warnings_;
};

}  // namespace merl::app
