// The matrix of pairs cut into square tiles, of which those on the diagonal and above it are computed.
// engine/distance/parts/pair_tiles.h has the same order: first all above the diagonal, row by row, then
// the diagonal.

layout(constant_id = 2) const uint kTile = 10;  // materials along a side of a tile

uint tiles_above_diagonal(uint across) { return across * (across - 1) / 2; }

uint tile_count(uint across) { return tiles_above_diagonal(across) + across; }

// Row and column of a tile, in tiles.
uvec2 tile_at(uint tile, uint across) {
    if (tile >= tiles_above_diagonal(across)) {
        return uvec2(tile - tiles_above_diagonal(across));
    }
    uint row = 0;
    for (uint in_row = across - 1; tile >= in_row; --in_row) {
        tile -= in_row;
        ++row;
    }
    return uvec2(row, row + 1 + tile);
}

// A kernel may be made twice, once for the tiles above the diagonal and once for those on it, which
// need only the pairs above it: unrolled, they are not even there.
layout(constant_id = 1) const bool kDiagonal = false;

const uint kPairs = kTile * kTile;  // of a tile

bool is_wanted(uint pair) { return !kDiagonal || pair % kTile > pair / kTile; }
