#include "scan/pairs/four_materials.h"

#include <fmt/format.h>

#include <algorithm>

namespace merl::scan {

bool same_sides(const FourMaterials& one, const FourMaterials& other) {
    return std::minmax(one[0], one[1]) == std::minmax(other[0], other[1]) &&
           std::minmax(one[2], one[3]) == std::minmax(other[2], other[3]);
}

FourMaterials swapped_sides(const FourMaterials& materials) {
    return {materials[2], materials[3], materials[0], materials[1]};
}

std::string fault_of(const FourMaterials& m) {
    if (std::ranges::find(m, "") != m.end()) {
        return "found a material without a name";
    }
    if (m[0] == m[1] || m[2] == m[3]) {
        return fmt::format("found \"{}\" twice in a pair; expected two materials",
                           m[0] == m[1] ? m[0] : m[2]);
    }
    return std::minmax(m[0], m[1]) == std::minmax(m[2], m[3])
               ? fmt::format(R"(found "{}" and "{}" on both sides; expected two pairs)", m[0], m[1])
               : "";
}

}  // namespace merl::scan
