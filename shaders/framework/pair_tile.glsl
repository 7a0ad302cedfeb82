// Pairs of materials cut into square tiles: which ones there are the host says, in a list of the first
// materials of their rows and columns (engine/distance/parts/pair_tiles.h). Those on the diagonal of the
// matrix of all pairs come last.

layout(constant_id = 2) const uint kTile = 10;  // materials along a side of a tile

// A kernel may be made twice, once for the tiles above the diagonal and once for those on it, which
// need only the pairs above it: unrolled, they are not even there.
layout(constant_id = 1) const bool kDiagonal = false;

const uint kPairs = kTile * kTile;  // of a tile

bool is_wanted(uint pair) { return !kDiagonal || pair % kTile > pair / kTile; }
