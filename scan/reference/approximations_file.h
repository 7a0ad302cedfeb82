#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace merl::scan {

/// An approximation and its distances from its original under two metrics.
struct ApproximationDistances {
    std::string original;       ///< "label/name", as materials are called
    std::string approximation;  ///< likewise
    double first;
    double second;
    bool operator==(const ApproximationDistances&) const = default;
};

/// Reads approximations.csv of a reference scan (docs/file-formats.md): the columns `original` and
/// `approximation`, and those of the two metrics; others may hold anything. Ascending by original,
/// then approximation, each once. Throws InputError.
std::vector<ApproximationDistances> parse_approximations(std::string_view text,
                                                         const std::string& file,
                                                         const std::string& first_metric,
                                                         const std::string& second_metric);

}  // namespace merl::scan
