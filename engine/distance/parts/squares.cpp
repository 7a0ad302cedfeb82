#include "engine/distance/parts/squares.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "engine/database/subset_database.h"

namespace merl::engine {

Rectangle Squares::at(std::uint64_t number) const {
    std::uint32_t row = 0;
    for (std::uint64_t in_row = across(); number >= in_row; --in_row) {
        number -= in_row;
        ++row;
    }
    const auto column = row + static_cast<std::uint32_t>(number);
    const auto extent = [&](std::uint32_t at) { return std::min(side, materials - at * side); };
    return {
        .row = row * side, .rows = extent(row), .column = column * side, .columns = extent(column)};
}

std::unique_ptr<Database> materials_of(const Database& whole, const Rectangle& rectangle) {
    std::vector<std::size_t> places(rectangle.materials());
    const auto rows = places.begin() + rectangle.rows;
    std::iota(places.begin(), rows, std::size_t{rectangle.row});
    std::iota(rows, places.end(), std::size_t{rectangle.column});
    // Owns nothing: `whole` outlives the result.
    return make_subset(std::shared_ptr<const Database>(std::shared_ptr<void>(), &whole), places);
}

}  // namespace merl::engine
