#include "scan/select/selection.h"

#include "scan/select/disagreement_search.h"
#include "scan/select/participation.h"

namespace merl::scan {

std::vector<Configuration> select_configurations(const DistancesView& distances,
                                                 std::uint32_t select, std::uint32_t per_material,
                                                 const Progress& progress) {
    DisagreementSearch search(distances, progress);
    Participation participation(distances.materials(), per_material);
    std::vector<Configuration> chosen;
    while (chosen.size() < select && per_material > 0) {
        // Pairs of a material that has taken part often enough are dropped, so whatever the search
        // still yields is to be taken.
        const auto found = search.next();
        if (!found) {
            break;
        }
        chosen.push_back(*found);
        participation.take(*found, search);
    }
    return chosen;
}

}  // namespace merl::scan
