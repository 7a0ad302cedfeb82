#include "engine/distance/parts/pair_tiles.h"

#include <algorithm>
#include <limits>

namespace merl::engine {

PairTiles PairTiles::covering(const PairList& pairs, std::uint32_t side) {
    const std::uint32_t of_tile = pairs.is_all() || pairs.rows() > 0 ? side : 1;
    const auto tiles_of = [&](std::uint32_t materials) {
        return (materials + of_tile - 1) / of_tile;
    };
    const std::uint32_t columns = pairs.materials() - pairs.rows();
    return {.pairs = &pairs,
            .side = of_tile,
            .down = tiles_of(pairs.rows() > 0 ? pairs.rows() : columns),
            .across = tiles_of(columns)};
}

PairTiles PairTiles::best(const PairList& pairs, const Metric& metric,
                          const device::TileSides& largest) {
    if (!metric.has_degree()) {
        // One pair after the other: the side only cuts the work into workgroups.
        constexpr std::uint32_t kSide = 10;
        return covering(pairs, kSide);
    }
    const bool is_power = metric.header.degree < 1;
    // What fetching a texel costs, in evaluated pairs of texels. Measured on lavapipe; elsewhere it
    // is about half as much (docs/performance.md), which makes little difference.
    const double fetch = is_power ? 1.6 : 9;
    PairTiles best;
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t side = 1;
         side <= std::min(pairs.materials(), is_power ? largest.power : largest.square); ++side) {
        const auto tiles = covering(pairs, side);
        const double full = side * side + 2 * side * fetch;
        const double diagonal = side * (side - 1) / 2.0 + side * fetch;
        const double cost = static_cast<double>(tiles.above_diagonal()) * full +
                            static_cast<double>(tiles.on_diagonal()) * diagonal;
        if (cost <= least) {
            least = cost;
            best = tiles;
        }
    }
    return best;
}

PairTiles::Place PairTiles::place_of(std::uint64_t tile) const {
    if (pairs->rows() > 0) {
        const auto row = static_cast<std::uint32_t>(tile / across);
        const auto column = static_cast<std::uint32_t>(tile % across);
        return {row * side, pairs->rows() + column * side};
    }
    if (!pairs->is_all()) {
        const auto& [first, second] = pairs->listed()[tile];
        return {first, second};
    }
    if (tile >= above_diagonal()) {
        const auto on_diagonal = static_cast<std::uint32_t>(tile - above_diagonal()) * side;
        return {on_diagonal, on_diagonal};
    }
    std::uint32_t row = 0;
    for (std::uint32_t in_row = across - 1; tile >= in_row; --in_row) {
        tile -= in_row;
        ++row;
    }
    return {row * side, (row + 1 + static_cast<std::uint32_t>(tile)) * side};
}

std::size_t PairTiles::sum_index(std::size_t pair, std::uint32_t first,
                                 std::uint32_t second) const {
    const std::size_t row = first / side;
    const std::uint32_t in_columns = second - pairs->rows();
    const std::size_t column = in_columns / side;
    std::size_t tile = 0;
    if (pairs->rows() > 0) {
        tile = row * across + column;
    } else if (!pairs->is_all()) {
        return pair;
    } else if (row == column) {
        tile = above_diagonal() + row;
    } else {
        tile = row * (across - 1) - row * (row + 1) / 2 + column - 1;
    }
    return tile * pairs_of_tile() + std::size_t{first % side} * side + in_columns % side;
}

}  // namespace merl::engine
