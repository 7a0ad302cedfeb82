// Which tile of the triangle of pairs a workgroup takes: rows of tiles get shorter by one each.

uvec2 tile_at(uint tile, uint tiles_across) {
    uint row = 0;
    uint in_row = tiles_across;  // tiles in this row of the triangle
    while (tile >= in_row) {
        tile -= in_row;
        --in_row;
        ++row;
    }
    return uvec2(row, row + tile);
}
