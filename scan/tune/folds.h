#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scan/score/judgements.h"

namespace merl::scan {

/// What is left out when a fit is tested on judgements that it has not seen.
enum class FoldKind {
    references,  ///< judgements with some references; their alternatives are in others
    materials,   ///< whole materials, whatever they were in a judgement
};

/// "references" or "materials".
std::string name_of(FoldKind kind);

/// Judgements to fit on, and others to test that on.
struct Fold {
    FoldKind kind;
    std::vector<bool> left_out;  ///< [material]

    /// Whether a judgement with these materials is a test: by its reference, which of a judgement
    /// without one is the first of its materials; or where all of its materials are left out.
    bool tests(const JudgedMaterials& materials) const;

    /// Whether it is fitted on. With materials left out, what has some of them is neither.
    bool trains(const JudgedMaterials& materials) const;
};

/// References are dealt to so many folds, each left out once.
inline constexpr std::uint32_t reference_folds = 10;

/// Materials are dealt to so many groups. Each choice of as many groups as a judgement has
/// materials, three or four, is a fold, so that every judgement is a test at least once.
inline constexpr std::uint32_t material_groups = 8;

/// The folds of one kind, by lot: the same for the same seed on every machine. Folds without a vote
/// to fit on, or without a majority to test on, are not there; so there may be none.
std::vector<Fold> make_folds(FoldKind kind, const Judgements& judgements, std::uint64_t seed);

}  // namespace merl::scan
