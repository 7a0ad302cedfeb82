#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/select/selection_file.h"
#include "scan/votes/kit_file.h"
#include "scan/votes/vote_file.h"

namespace merl::scan {

/// A configuration that judges were asked about.
struct JudgedConfiguration {
    std::uint64_t number;  ///< rank in the selection, or what the kit calls it
    TrialKind kind;        ///< selection, sentinel or random
    FourMaterials materials;
    std::optional<double> agreement;
    std::uint8_t expected;  ///< of a sentinel: 1 or 3; 0 where it is not known
};

/// What one judge did in one trial.
struct Ballot {
    std::uint32_t configuration;  ///< index in Votes::configurations
    bool repeat;                  ///< the judge's second look at it
    bool swapped;
    std::uint8_t shown;  ///< 1, 2 or 3 as on the screen, 0 not answered
    std::optional<double> response_ms;

    /// The vote with the screen's sides undone: 1 the first metric's side, 2 equal, 3 the second's,
    /// 0 not answered.
    std::uint8_t side() const {
        return swapped && shown != 0 ? static_cast<std::uint8_t>(4 - shown) : shown;
    }
};

/// One judge, whose rows are those of one file.
struct Judge {
    std::string name;
    std::string file;
    /// Every trial of the experiment, in the order shown, those without a row last.
    std::vector<Ballot> ballots;
    std::optional<bool> calibration_failed = {};  ///< none: the screen was not calibrated
};

/// The votes of all judges on one selection.
struct Votes {
    std::string first_metric;
    std::string second_metric;
    /// The label of the originals where judges compared approximations with them (Kit::reference);
    /// otherwise empty.
    std::string reference = {};
    std::string kit_hash;
    bool with_kit;                                    ///< kit.json was there to check against
    std::vector<JudgedConfiguration> configurations;  ///< the selection's, then by number
    std::vector<Judge> judges;                        ///< in the order of the files
    std::uint64_t trials;                             ///< of each judge
    std::vector<std::string> warnings = {};           ///< saves not counted, one line each
    std::optional<double> seconds_to_see = {};        ///< Kit::seconds_to_see
};

/// What was scanned, as the summary of a scan has it.
struct ScannedMaterials {
    std::string file;                           ///< the summary, as errors call it
    std::string kind;                           ///< of the database
    std::map<std::string, std::string> hashes;  ///< by material; older summaries have none
};

/// Throws InputError when the kit shows other materials than those that were scanned. Returns why
/// that cannot be told; empty if it was.
std::string compare_with_scan(const Kit& kit, const ScannedMaterials& scanned);

/// Puts the judges' files together and checks them: every file has the same kit hash (that of the
/// kit, if there is one), and of several saves of a judge (judge_name.h) the fullest, which has all
/// answers of the others, counts; every row shows the pairs of its configuration on the
/// sides that `swapped` says, and is a trial of the kit. Trials of the kit without a row count as
/// not answered; without a kit these are those of the selection and whatever another judge has.
///
/// `selection_hash` is the hash of selection.csv, which a kit must have been made from. Throws
/// InputError that names file and line.
Votes gather_votes(const SelectionFile& selection, const std::string& selection_hash,
                   const Kit* kit, std::span<const VoteFile> files);

}  // namespace merl::scan
