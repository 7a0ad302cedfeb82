#include "scan/selection.h"

#include <algorithm>
#include <array>

#include "scan/search.h"

namespace merl::scan {
namespace {

void drop_pairs_of(std::uint32_t material, std::uint32_t materials, DisagreementSearch& search) {
    for (std::uint32_t other = 0; other < materials; ++other) {
        if (other != material) {
            const auto [first, second] = std::minmax(material, other);
            search.drop(pair_index({first, second}, materials));
        }
    }
}

}  // namespace

std::vector<Configuration> select_configurations(const Distances& distances, std::uint32_t select,
                                                 std::uint32_t per_material) {
    DisagreementSearch search(distances);
    std::vector<Configuration> chosen;
    if (per_material == 0) {
        return chosen;
    }
    const std::uint32_t materials = distances.materials();
    std::vector<std::uint32_t> parts(materials);
    while (chosen.size() < select) {
        // Pairs of a material that has taken part often enough are dropped, so whatever the search
        // still yields is to be taken.
        const auto found = search.next();
        if (!found) {
            break;
        }
        chosen.push_back(*found);
        const Pair left = pair_at(found->left, materials);
        const Pair right = pair_at(found->right, materials);
        std::array involved{left.first, left.second, right.first, right.second};
        std::ranges::sort(involved);
        const auto* const end = std::unique(involved.begin(), involved.end());
        for (const auto* material = involved.begin(); material != end; ++material) {
            if (++parts[*material] == per_material) {
                drop_pairs_of(*material, materials, search);
            }
        }
    }
    return chosen;
}

}  // namespace merl::scan
