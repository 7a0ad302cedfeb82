#pragma once

#include <array>
#include <string>

namespace merl::scan {

/// The materials of a configuration: the left pair, then the right one.
using FourMaterials = std::array<std::string, 4>;

/// Whether both have the same pairs on the same sides, in whatever order within each pair.
bool same_sides(const FourMaterials& one, const FourMaterials& other);

/// The same configuration with its sides exchanged.
FourMaterials swapped_sides(const FourMaterials& materials);

/// Throws nothing and returns what is wrong with the materials of a configuration: one without a
/// name, a pair of one material, the same pair on both sides. Empty: nothing is.
std::string fault_of(const FourMaterials& materials);

}  // namespace merl::scan
