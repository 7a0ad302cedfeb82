#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/device/devices.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// The matrix of material pairs cut into square tiles, those on the diagonal and above it:
/// the order of shaders/framework/pair_tile.glsl.
struct PairTiles {
    std::uint32_t side = 0;    // materials along one side of a tile
    std::uint32_t across = 0;  // tiles along one side of the matrix

    /// The tiles in which the shaders take least for the difference of a metric, on a device with
    /// these largest ones. The cheaper a pair is beside the fetching of its samples, the larger.
    static PairTiles best(std::uint32_t materials, const Metric& metric,
                          const device::TileSides& largest);

    /// Tiles of that side for so many materials.
    static PairTiles covering(std::uint32_t materials, std::uint32_t side) {
        return {.side = side, .across = (materials + side - 1) / side};
    }

    /// Materials and what fills up the last tile.
    std::uint32_t padded_materials() const { return side * across; }

    std::uint32_t above_diagonal() const { return across * (across - 1) / 2; }
    std::uint32_t count() const { return above_diagonal() + across; }

    /// The first material of a tile's rows and of its columns.
    struct Place {
        std::uint32_t row, column;
    };
    Place place_of(std::uint32_t tile) const;

    std::size_t pairs_of_tile() const { return std::size_t{side} * side; }

    /// Where the sum of materials i < j is among the sums of all tiles, [tile][row][column].
    std::size_t sum_index(std::uint32_t i, std::uint32_t j) const {
        const std::size_t row = i / side;
        const std::size_t column = j / side;
        const std::size_t tile = row == column
                                     ? above_diagonal() + row
                                     : row * (across - 1) - row * (row + 1) / 2 + column - 1;
        return tile * pairs_of_tile() + std::size_t{i % side} * side + j % side;
    }
};

}  // namespace merl::engine
