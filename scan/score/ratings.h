#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/pairs/listed_distances.h"
#include "scan/pairs/pairs.h"
#include "scan/score/judgements.h"
#include "scan/score/rating_file.h"

namespace merl::scan {

/// An approximation of an original that people rated; both are indices into the materials.
struct RatedApproximation {
    std::uint32_t original;
    std::uint32_t approximation;
    std::uint32_t name;     ///< of the approximation, without its original: into Ratings::names
    double rating;          ///< the mean of its ratings
    std::uint64_t ratings;  ///< how many

    Pair pair() const { return pair_of(original, approximation); }
    bool operator==(const RatedApproximation&) const = default;
};

/// A name in ratings that stands for no material.
struct UnknownRated {
    std::string name;
    std::uint64_t rows;  ///< that name it
    std::string close;   ///< a label or material that there is, but for case or a label; or empty
    bool operator==(const UnknownRated&) const = default;
};

/// The ratings of a file on the materials that there are.
struct Ratings {
    bool higher_is_better;
    std::optional<RatingScale> scale;
    std::vector<RatedApproximation> list;  ///< ascending by original, then approximation
    std::vector<std::string> names;        ///< of approximations, ascending

    std::uint64_t rows = 0;  ///< of the file
    std::uint64_t rows_with_unknown = 0;
    std::vector<UnknownRated> unknown = {};      ///< ascending by name
    std::uint64_t rows_of_originals = 0;         ///< that rate an original itself; left out
    std::vector<std::string> unused_names = {};  ///< names that are mapped and not in the ratings
};

/// How names in ratings become materials.
struct RatingNaming {
    std::string reference = {};  ///< the label of the originals, or empty
    RatingNames names = {};      ///< what stands for something else
};

/// A mean of ratings, rounded to 12 digits: that of 0.1 and 0.7 is then that of 0.3 and 0.5, as it
/// is of the decimals.
double decimal_mean(double sum, std::uint64_t count);

/// The rows of `file` whose materials are all there (`materials`, ascending), with the mean of the
/// ratings of one approximation, rounded to 12 digits where there are several: what is equal as a
/// decimal ties.
///
/// An original "x" is the material "x", or "REFERENCE/x"; its approximation "m" is the material
/// "m", or "m/x". Names are the same byte by byte. The name of an approximation "label/x" is its
/// label, of others it is what the file calls them. Throws Error (usage) where no material has the
/// label REFERENCE, and InputError where a name may be two materials, when no row is left, and
/// where all approximations have the same rating.
Ratings resolve_ratings(const RatingFile& file, const RatingNaming& naming,
                        std::span<const std::string> materials);

/// The pairs of originals and approximations, ascending, each once.
std::vector<Pair> rated_pairs(const Ratings& ratings);

}  // namespace merl::scan
