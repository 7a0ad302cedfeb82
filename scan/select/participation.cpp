#include "scan/select/participation.h"

#include <algorithm>
#include <array>

namespace merl::scan {

Participation::Participation(std::uint32_t materials, std::uint32_t limit)
    : limit_(limit), parts_(materials) {}

bool Participation::open(Pair pair) const {
    return parts_[pair.first] < limit_ && parts_[pair.second] < limit_;
}

bool Participation::open(std::uint32_t pair) const {
    return open(pair_at(pair, static_cast<std::uint32_t>(parts_.size())));
}

std::vector<std::uint32_t> Participation::take(Pair left, Pair right) {
    std::array involved{left.first, left.second, right.first, right.second};
    std::ranges::sort(involved);
    const auto* const end = std::unique(involved.begin(), involved.end());
    std::vector<std::uint32_t> closed;
    for (const auto* material = involved.begin(); material != end; ++material) {
        if (++parts_[*material] == limit_) {
            closed.push_back(*material);
        }
    }
    return closed;
}

void Participation::take(const Configuration& chosen, DisagreementSearch& search) {
    const auto materials = static_cast<std::uint32_t>(parts_.size());
    for (const auto material :
         take(pair_at(chosen.left, materials), pair_at(chosen.right, materials))) {
        for (std::uint32_t other = 0; other < materials; ++other) {
            if (other != material) {
                const auto [first, second] = std::minmax(material, other);
                search.drop(pair_index({first, second}, materials));
            }
        }
    }
}

}  // namespace merl::scan
