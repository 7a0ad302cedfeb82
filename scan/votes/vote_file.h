#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace merl::scan {

/// Most rows of one judge's file; no judge sees a thousandth of them.
inline constexpr std::size_t max_trials = 100'000;

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

/// The materials of a configuration: the left pair, then the right one.
using FourMaterials = std::array<std::string, 4>;

/// Whether both have the same pairs on the same sides, in whatever order within each pair.
bool same_sides(const FourMaterials& one, const FourMaterials& other);

/// The same configuration with its sides exchanged.
FourMaterials swapped_sides(const FourMaterials& materials);

/// Throws nothing and returns what is wrong with the materials of a configuration: one without a
/// name, a pair of one material, the same pair on both sides. Empty: nothing is.
std::string fault_of(const FourMaterials& materials);

/// One trial of a judge, as the screen showed it.
struct TrialRow {
    std::uint64_t line;  ///< of the file
    std::uint64_t trial;
    std::uint64_t configuration;
    TrialKind kind;
    FourMaterials shown;
    bool swapped;       ///< the screen's left is the right pair of the configuration
    std::uint8_t vote;  ///< 1 smaller change on the left, 2 equal, 3 on the right; 0 no answer
    std::optional<double> response_ms;
};

/// The votes of one judge.
struct VoteFile {
    std::string file;  ///< what errors call it
    std::string judge;
    std::string kit_hash;
    std::vector<TrialRow> rows;
};

/// Reads a judge's file from CSV (csv_reader.h): judge,trial,configuration,kind,left_1,left_2,
/// right_1,right_2,swapped,vote,response_ms,seed,kit_hash (docs/file-formats.md). Every row has the
/// same judge, seed and kit hash; no trial number and no trial is there twice. Throws InputError.
VoteFile parse_votes(std::string_view text, const std::string& file);

}  // namespace merl::scan
