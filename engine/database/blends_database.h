#pragma once

#include <memory>
#include <string>

#include "engine/database/database.h"

namespace merl::engine {

// As many materials as one likes, to see what a scan of them takes: the built-in ones, and beyond
// those blends of two of them, which need no memory and no files. Any grid can be asked for.

/// The most materials: two of them differ in a bit of the weight or in an original.
inline constexpr std::size_t kMostBlends = 100'000;

/// Whether `name` begins as that of such a database: "blends:1000" has 1,000 materials.
bool is_blends(const std::string& name);

/// The database of such a name; by its path() it can be opened again. Up to the number of built-in
/// materials it has that many of those, evenly chosen; otherwise all of them and blends,
/// "blend-00100" and so on: a sample is w a + (1 - w) b of the samples of two, in float64. The
/// blends take all pairs of originals with w = 1/2, first neighbours by name, then those once
/// removed, and so on; then all again with w = 1/4, 3/4, 1/8, 5/8 ... Throws InputError unless
/// there are 2 to kMostBlends.
std::unique_ptr<Database> open_blends(const std::string& name, const Grid& grid = {});

}  // namespace merl::engine
