#pragma once

#include <cstdint>
#include <memory>

#include "engine/database/database.h"

namespace merl::engine {

/// A rectangle of the matrix of all pairs: these rows of materials against these columns. On the
/// diagonal both are the same materials, and only pairs above it are meant.
struct Rectangle {
    std::uint32_t row = 0, rows = 0;        // the first material, and how many
    std::uint32_t column = 0, columns = 0;  // likewise; not before the rows

    bool is_diagonal() const { return row == column; }
    std::uint32_t materials() const { return is_diagonal() ? rows : rows + columns; }
    std::uint64_t pairs() const {
        return is_diagonal() ? std::uint64_t{rows} * (rows - 1) / 2 : std::uint64_t{rows} * columns;
    }
    bool operator==(const Rectangle&) const = default;
};

/// The matrix of all pairs, on and above the diagonal, cut into squares of `side` materials, the
/// last ones smaller; numbered row by row.
struct Squares {
    std::uint32_t materials = 0;
    std::uint32_t side = 1;

    std::uint32_t across() const { return (materials + side - 1) / side; }
    std::uint64_t count() const { return std::uint64_t{across()} * (across() + 1) / 2; }
    Rectangle at(std::uint64_t number) const;

    /// The number of the square in this row and column of squares; row <= column < across().
    std::uint64_t number_of(std::uint32_t row, std::uint32_t column) const {
        return std::uint64_t{row} * (2 * std::uint64_t{across()} - row + 1) / 2 + column - row;
    }
    std::uint64_t on_diagonal(std::uint32_t row) const { return number_of(row, row); }
};

/// The materials of a rectangle, those of the rows first. `whole` outlives the result.
std::unique_ptr<Database> materials_of(const Database& whole, const Rectangle& rectangle);

/// How many of them are rows, as DistanceOptions::rows has it: none on the diagonal.
inline std::uint32_t rows_of(const Rectangle& rectangle) {
    return rectangle.is_diagonal() ? 0 : rectangle.rows;
}

}  // namespace merl::engine
