// The matrix of pairs cut into square tiles, of which those on the diagonal and above it are computed.
// engine/reflectance/pair_tiles.h has the same order: first all above the diagonal, row by row, then
// the diagonal.

struct PairTile {
    uint row;
    uint column;
    uint index;
};

uint pair_tiles(uint across) { return across * (across + 1) / 2; }

// The tile of this workgroup.
PairTile pair_tile(bool diagonal, uint across) {
    if (diagonal) {
        return PairTile(gl_WorkGroupID.x, gl_WorkGroupID.x, pair_tiles(across) - across + gl_WorkGroupID.x);
    }
    uint row = 0;
    uint rest = gl_WorkGroupID.x;
    for (uint in_row = across - 1; rest >= in_row; --in_row) {
        rest -= in_row;
        ++row;
    }
    return PairTile(row, row + 1 + rest, gl_WorkGroupID.x);
}
