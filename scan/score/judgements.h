#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace merl::scan {

/// Most rows of a file: memory stays below a gigabyte.
inline constexpr std::size_t max_judgement_rows = 10'000'000;

/// Most votes that one row may give one answer: sums of any file that can be read stay in 64 bits.
inline constexpr std::uint64_t max_votes = 1'000'000'000;

/// One row of a file of judgements: which pair of materials is more alike, the left or the right
/// one? Materials are indices into the names of the file. Where a reference was compared with two
/// materials, it is the first of both pairs.
struct NamedVotes {
    std::uint32_t left_1;
    std::uint32_t left_2;
    std::uint32_t right_1;
    std::uint32_t right_2;
    std::uint64_t votes_left;   ///< the left pair is more alike
    std::uint64_t votes_equal;  ///< neither is
    std::uint64_t votes_right;
};

/// What a file of judgements says, whatever its format.
struct JudgementFile {
    std::string file;    ///< what errors call it
    std::string format;  ///< "reference CSV", "configuration CSV" or "Lagunas 2019 JSON"
    std::vector<std::string> names;  ///< distinct, in the order of the file
    std::vector<NamedVotes> rows;
};

/// All votes on one configuration.
struct Judgement {
    std::uint32_t left;   ///< index of a pair of materials (pair_index)
    std::uint32_t right;  ///< greater than `left`
    std::uint64_t votes_left;
    std::uint64_t votes_equal;
    std::uint64_t votes_right;

    std::uint64_t votes() const { return votes_left + votes_equal + votes_right; }
    bool untied() const { return votes_left != votes_right; }
    bool operator==(const Judgement&) const = default;
};

/// A material of a file of judgements that has no distances.
struct UnknownMaterial {
    std::string name;
    std::uint64_t rows;  ///< rows that name it
    bool operator==(const UnknownMaterial&) const = default;
};

/// The judgements of a file on the materials that there are.
struct Judgements {
    /// Ascending by left, then right pair: neither the order of the rows nor the side on which a
    /// pair was shown changes anything.
    std::vector<Judgement> list;

    std::uint32_t materials = 0;  ///< how many there are, which is what pairs are indices for

    std::uint64_t rows = 0;  ///< of the file
    std::uint64_t rows_with_unknown = 0;
    std::uint64_t without_votes = 0;       ///< configurations that nobody voted on; not in the list
    std::vector<UnknownMaterial> unknown;  ///< ascending by name
};

/// The materials of a judgement, each once. Its reference is the one that both pairs have: where
/// there is one, it is the first of three; where there is none, there are four.
struct JudgedMaterials {
    std::array<std::uint32_t, 4> list;
    bool has_reference;

    std::span<const std::uint32_t> all() const { return {list.data(), has_reference ? 3U : 4U}; }
};

/// Takes a judgement's two pairs apart, of so many materials.
JudgedMaterials materials_of(const Judgement& judgement, std::uint32_t materials);

/// The rows of `file` whose materials are all among `materials` (ascending; their index is what
/// pairs count), with the votes of rows on the same configuration added up. Throws
/// InputError when no row or no vote is left.
Judgements resolve_judgements(const JudgementFile& file, std::span<const std::string> materials);

}  // namespace merl::scan
