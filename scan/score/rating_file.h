#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace merl::scan {

/// So large a rating may be, or small: sums of them stay finite.
inline constexpr double max_rating = 1e100;

/// What ratings can be, as far as it is stated.
struct RatingScale {
    double low;
    double high;
};

/// One row: how well, or how badly, an approximation looks like its original. Names are indices
/// into those of the file.
struct NamedRating {
    std::uint32_t original;
    std::uint32_t approximation;
    double rating;
};

/// What a file of ratings says, whatever its format.
struct RatingFile {
    std::string file;    ///< what errors call it
    std::string format;  ///< "ratings CSV", "differences CSV" or "Lavoué 2021"
    bool higher_is_better;
    std::optional<RatingScale> scale;  ///< that all ratings are within
    std::vector<std::string> names;    ///< distinct, in the order of the file
    std::vector<NamedRating> rows;
};

/// Reads ratings from CSV (csv_reader.h) with the columns `original`, `approximation`, and `rating`
/// (the higher, the more alike) or `difference` (the higher, the less alike); or, of Lavoué et al.
/// 2021, `BRDF`, `METHOD` and `DISTANCE`, a difference from 0 to 1. In any order; other columns may
/// hold anything. Ratings are finite, and within `scale` where one is stated. `file` is what errors
/// call the text. `progress` is called now and then with the share that is read; what it throws
/// comes out. Throws InputError.
RatingFile parse_ratings(std::string_view text, const std::string& file,
                         std::optional<RatingScale> scale = std::nullopt,
                         const std::function<void(double share)>& progress = {});

/// What names in ratings stand for.
using RatingNames = std::map<std::string, std::string, std::less<>>;

/// Reads them from CSV with the columns `name_in_ratings` and `name`. The same name may be there
/// again where it stands for the same. Throws InputError.
RatingNames parse_rating_names(std::string_view text, const std::string& file);

}  // namespace merl::scan
