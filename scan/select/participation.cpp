#include "scan/select/participation.h"

#include <algorithm>
#include <array>

namespace merl::scan {

Participation::Participation(std::uint32_t materials, std::uint32_t limit)
    : limit_(limit), parts_(materials) {}

bool Participation::open(std::uint32_t pair) const {
    const auto [first, second] = pair_at(pair, static_cast<std::uint32_t>(parts_.size()));
    return parts_[first] < limit_ && parts_[second] < limit_;
}

void Participation::take(const Configuration& chosen, DisagreementSearch& search) {
    const auto materials = static_cast<std::uint32_t>(parts_.size());
    const Pair left = pair_at(chosen.left, materials);
    const Pair right = pair_at(chosen.right, materials);
    std::array involved{left.first, left.second, right.first, right.second};
    std::ranges::sort(involved);
    const auto* const end = std::unique(involved.begin(), involved.end());
    for (const auto* material = involved.begin(); material != end; ++material) {
        if (++parts_[*material] != limit_) {
            continue;
        }
        for (std::uint32_t other = 0; other < materials; ++other) {
            if (other != *material) {
                const auto [first, second] = std::minmax(*material, other);
                search.drop(pair_index({first, second}, materials));
            }
        }
    }
}

}  // namespace merl::scan
