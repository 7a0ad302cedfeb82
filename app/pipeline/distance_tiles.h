#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/pipeline/control.h"
#include "app/pipeline/pair_distances.h"
#include "engine/database/database.h"
#include "engine/distance/distances.h"
#include "engine/distance/parts/squares.h"
#include "engine/metric/metric.h"

namespace merl::pipeline {

// The distances of all pairs in tiles, each of which any process on any machine can compute by
// itself: rows of materials against columns of materials, at all voxels. No sum is split, so every
// bit is the same however many processes there are.

/// The side of the tiles for so many materials, where nobody asks for another: eight tiles along a
/// side, of 8 to 256 materials (docs/many-machines.md).
std::uint32_t default_tile_side(std::size_t materials);

/// What is in a tile.
struct DistanceTile {
    engine::Rectangle rectangle;
    /// [metric][distance, bound][row][column], of float64; on the diagonal all of the square, which
    /// is symmetric, with 0 between a material and itself. A bound may be infinite.
    std::vector<double> numbers;
    std::vector<std::string> plane_hashes;       // of the rows, then of columns that are no rows
    std::vector<engine::MaterialCounts> counts;  // likewise
    std::uint64_t voxels = 0;                    // above the horizon
    std::vector<std::string> warnings;           // of these materials and metrics, one line each;
                                                 // not of copies
    double seconds = 0;
    std::uint64_t peak_bytes = 0;  // of the engines
};

/// Computes one. The stage is "distances". Throws what compute_pair_distances() throws.
DistanceTile compute_tile(engine::Engines& engines, const engine::Database& database,
                          std::span<const engine::Metric* const> metrics,
                          const engine::Rectangle& rectangle,
                          std::uint64_t memory_bytes = 1ULL << 30U, const Control& control = {});

/// What computed distances will say of these metrics and engines, before they are computed: no
/// hashes, counts and seconds. Throws what engine::Engines::share() throws.
Provenance provenance_before(engine::Engines& engines, const engine::Database& database,
                             std::span<const engine::Metric* const> metrics);

/// Adds what is known once all materials were read: hashes, counts and the warning of copies.
/// `planes` are the hashes of each material's planes (content_hash.h).
void add_materials(Provenance& provenance, std::span<const std::string> planes,
                   std::span<const engine::MaterialCounts> counts);

}  // namespace merl::pipeline
