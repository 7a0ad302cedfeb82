#include "engine/distance/parts/pair_tiles.h"

#include <algorithm>
#include <limits>

namespace merl::engine {

PairTiles PairTiles::best(std::uint32_t materials, const Metric& metric,
                          const device::TileSides& largest) {
    if (!metric.has_degree()) {
        // One pair after the other: the side only cuts the work into workgroups.
        constexpr std::uint32_t kSide = 10;
        return covering(materials, kSide);
    }
    const bool is_power = metric.header.degree < 1;
    // What fetching a texel costs, in evaluated pairs of texels. Measured on lavapipe; elsewhere it
    // is about half as much (docs/performance.md), which makes little difference.
    const double fetch = is_power ? 1.6 : 9;
    PairTiles best;
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t side = 1;
         side <= std::min(materials, is_power ? largest.power : largest.square); ++side) {
        const auto tiles = covering(materials, side);
        const double full = side * side + 2 * side * fetch;
        const double diagonal = side * (side - 1) / 2.0 + side * fetch;
        const double cost = tiles.above_diagonal() * full + tiles.across * diagonal;
        if (cost <= least) {
            least = cost;
            best = tiles;
        }
    }
    return best;
}

PairTiles::Place PairTiles::place_of(std::uint32_t tile) const {
    if (tile >= above_diagonal()) {
        const std::uint32_t on_diagonal = (tile - above_diagonal()) * side;
        return {on_diagonal, on_diagonal};
    }
    std::uint32_t row = 0;
    for (std::uint32_t in_row = across - 1; tile >= in_row; --in_row) {
        tile -= in_row;
        ++row;
    }
    return {row * side, (row + 1 + tile) * side};
}

}  // namespace merl::engine
