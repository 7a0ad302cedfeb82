#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/pipeline/pair_distances.h"
#include "app/pipeline/reference_scan.h"

namespace merl::app {

/// So many originals are on the page.
inline constexpr std::size_t kOriginalsOnPage = 500;

/// Pixels along the side of a sphere.
inline constexpr std::uint32_t kPageSpherePixels = 96;

/// Those of the originals that are on the page, as places in `ranges`: those of the strongest
/// disagreements of the first two metrics first, then those without one.
std::vector<std::size_t> originals_on_page(const scan::ReferenceDistances& distances);

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
