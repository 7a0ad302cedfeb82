#pragma once

#include <string>
#include <vector>

#include "scan/tune/tune.h"

namespace merl::scan {

// The tables of `tune` (docs/file-formats.md), written to a file descriptor. They throw
// std::system_error.

/// A row for each prediction of each part: on what was fitted, and on what was not.
void write_tuning(int file, const Tuning& tuning);

/// A row for each fitted parameter.
void write_parameters(int file, const Tuning& tuning);

/// A row for each fold; `materials` are their names.
void write_folds(int file, const Tuning& tuning, const std::vector<std::string>& materials);

/// The least and the greatest value that the fits of all folds of a kind give a parameter, by its
/// place; not numbers where there are none.
struct FoldRange {
    double least;
    double most;
};
FoldRange range_of(const CrossValidation& validation, std::size_t parameter);

}  // namespace merl::scan
