#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "scan/pairs/four_materials.h"

namespace merl::scan {

/// Why a configuration was shown.
enum class TrialKind : std::uint8_t {
    selection,  ///< a row of selection.csv
    repeat,     ///< a configuration that this judge sees a second time
    sentinel,   ///< one on which both metrics agree strongly
    random,     ///< a disagreement drawn by lot
};

/// "selection", "repeat" ...
std::string_view kind_name(TrialKind kind);

/// The kind of that name; none for any other text.
std::optional<TrialKind> kind_of(std::string_view name);

/// What is wrong with the materials of a trial (four_materials.h): a sentinel may have an original
/// with itself on one side. Empty: nothing is.
std::string fault_of_trial(const FourMaterials& materials, TrialKind kind);

/// One trial of a judge, as the screen showed it.
struct TrialRow {
    std::uint64_t line;  ///< of the file
    std::uint64_t trial;
    std::uint64_t configuration;
    TrialKind kind;
    FourMaterials shown;
    bool swapped;  ///< the screen's left is the right pair of the configuration
    /// 1 for the left: the smaller change, or more like the original; 2 equal, 3 for the right; 0
    /// no answer.
    std::uint8_t vote;
    std::optional<double> response_ms;
};

/// The votes of one judge.
struct VoteFile {
    std::string file;  ///< what errors call it
    std::string judge;
    std::string kit_hash;
    std::vector<TrialRow> rows;
    std::optional<bool> calibration_failed = {};  ///< none: nothing was checked, or it is CSV
};

/// Reads a judge's file from CSV (csv_reader.h): judge,trial,configuration,kind,left_1,left_2,
/// right_1,right_2,swapped,vote,response_ms,seed,kit_hash (docs/file-formats.md). Every row has the
/// same judge, seed and kit hash; no trial number and no trial is there twice. Throws InputError.
VoteFile parse_votes(std::string_view text, const std::string& file);

}  // namespace merl::scan
