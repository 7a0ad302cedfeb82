#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/database/database.h"

namespace merl::engine {

/// Database::kind() of the built-in database.
inline constexpr const char* built_in_kind = "built-in stand-in";

/// The built-in stand-in for the measured MERL database: the ABC microfacet model with the figures
/// that Löw et al. (ACM TOG 31(1), 2012) fitted to its 100 materials, evaluated at voxel centres.
/// Any grid can be asked for; nothing is ever "not measured", and below the horizon it is zero.
std::unique_ptr<Database> make_abc_database(const Grid& grid = {});

/// The same model for chosen figures, in the columns of `abc_fits.csv` (which has a header line).
/// Throws Error (input) on a malformed table.
std::unique_ptr<Database> make_abc_database(const Grid& grid, const std::string& csv);

/// The names of the 100 materials of MERL, which are those of its, ascending bytewise.
std::vector<std::string> merl_materials();

}  // namespace merl::engine
