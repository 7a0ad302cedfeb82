#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "engine/device/devices.h"
#include "engine/distance/parts/pair_list.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// The pairs of a computation cut into square tiles. Of all pairs it is the matrix of them, those
/// tiles on the diagonal and above it: first all above it, row by row, then the diagonal. A
/// rectangle has all its tiles above the diagonal; those at its lower edge may reach into the
/// materials of its columns, which is computed and not looked at. Of listed pairs each is a tile of
/// its own, so that nothing else is computed.
struct PairTiles {
    const PairList* pairs = nullptr;  // outlives this
    std::uint32_t side = 0;           // materials along one side of a tile
    std::uint32_t down = 0;           // tiles along the sides of the matrix
    std::uint32_t across = 0;

    /// The tiles in which the shaders take least for the difference of a metric, on a device with
    /// these largest ones. The cheaper a pair is beside the fetching of its samples, the larger.
    static PairTiles best(const PairList& pairs, const Metric& metric,
                          const device::TileSides& largest);

    /// Tiles of that side where all pairs are computed.
    static PairTiles covering(const PairList& pairs, std::uint32_t side);

    /// Materials and what fills up the last tile.
    std::uint32_t padded_materials() const {
        return std::max(side * down, pairs->rows() + side * across);
    }

    std::uint64_t above_diagonal() const {
        return pairs->is_all()     ? std::uint64_t{across} * (across - 1) / 2
               : pairs->rows() > 0 ? std::uint64_t{down} * across
                                   : pairs->size();
    }
    std::uint64_t on_diagonal() const { return pairs->is_all() ? across : 0; }
    std::uint64_t count() const { return above_diagonal() + on_diagonal(); }

    /// The first material of a tile's rows and of its columns. The shaders read it.
    struct Place {
        std::uint32_t row, column;
    };
    Place place_of(std::uint64_t tile) const;

    std::size_t pairs_of_tile() const { return std::size_t{side} * side; }

    /// Where the sum of a pair is among the sums of all tiles, [tile][row][column].
    std::size_t sum_index(std::size_t pair, std::uint32_t first, std::uint32_t second) const;
};

}  // namespace merl::engine
