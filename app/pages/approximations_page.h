#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "app/pipeline/pair_distances.h"
#include "app/pipeline/reference_scan.h"

namespace merl::app {

/// So many originals are on the page: those of the strongest disagreements.
inline constexpr std::size_t kOriginalsOnPage = 500;

/// What the page shows of materials, by their indices.
struct PageSpheres {
    std::map<std::uint32_t, std::string> png;  ///< files
    std::string why_not;                       ///< in a sentence, where there are none
};

/// approximations.html: one page that needs no other file and no network, with the originals as
/// rows and their approximations beside them, rank and distance under a metric of choice, and how
/// often metrics name which best.
std::string approximations_page(const pipeline::Provenance& provenance, std::size_t materials,
                                const pipeline::ReferenceScanResult& result,
                                const PageSpheres& spheres);

}  // namespace merl::app
