#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/commands/obtain_distances.h"
#include "app/output/provenance.h"
#include "app/output/scan_record.h"
#include "app/pipeline/control.h"
#include "app/pipeline/pair_distances.h"
#include "scan/score/judgement_file.h"
#include "scan/score/judgements.h"

namespace merl::app {

/// Adds --judgements. Returns it.
CLI::Option* add_judgements_option(CLI::App& command, std::string& judgements);

/// What people said, and of which materials.
struct ObtainedJudgements {
    scan::JudgementFile file;
    std::string content_hash;
    std::string sha256;                 // the same file, as metrics name what they were fitted to
    std::optional<ScanRecord> scanned;  // what the judgements are on, if they are those of `votes`

    /// Whether a metric is one of those whose disagreements were judged.
    bool are_selected_by(const std::string& metric) const;

    /// What a metric says of these judgements, if its parameters were fitted to this very file.
    const engine::FittedTo* fitted_to(const pipeline::MetricProvenance& metric) const;
};

/// Reads a file of judgements, and finds out what was judged: those of `votes` that were edited may
/// be of any database. The stage is "reading judgements". Throws InputError for a file that cannot
/// be used, and where nothing says which database was judged unless `options` name one;
/// Interrupted.
ObtainedJudgements obtain_judgements(const std::string& file, const DistanceOptions& options,
                                     const pipeline::Control& control);

/// Where distances come from: what the options say, otherwise the database whose spheres were
/// judged, if that is known. Throws InputError where that is not a database.
DistanceOptions with_judged_database(DistanceOptions options, const ObtainedJudgements& judgements);

/// What the user should know of a database beside what was judged: distances of other materials are
/// an InputError, and a warning where `options`, as the user gave them, name the database; those of
/// the stand-in are a warning for judgements that nobody has said it of. Null for distances from a
/// table.
std::vector<std::string> compare_with_judged(const ObtainedJudgements& judgements,
                                             const DistanceOptions& options,
                                             const pipeline::DatabaseProvenance* database);

/// The file, and what of it is on the materials that there are.
nlohmann::ordered_json judgements_json(const ObtainedJudgements& judgements,
                                       const scan::Judgements& resolved);

/// "22,801 configurations, 21,406 with a majority; 92,892 votes".
std::string judgements_text(const scan::Judgements& judgements);

/// The same with the file, and what of it is left out, as lines of a summary.
Lines judgements_lines(const ObtainedJudgements& judgements, const scan::Judgements& resolved);

}  // namespace merl::app
