#pragma once

#include "scan/reference/reference_distances.h"

namespace merl::scan {

/// Writes original,approximation,label, for every metric D its distance, then for every one
/// D_rank, and where bounds are known D_bound and D_precision (as write_pairs() does,
/// scan_tables.h): one row an approximation, by original, then label. Throws std::system_error when
/// writing fails.
void write_approximations(int file, const ReferenceDistances& distances);

}  // namespace merl::scan
