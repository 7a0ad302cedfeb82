#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/pipeline/distance_tiles.h"
#include "app/pipeline/pair_distances.h"
#include "engine/distance/parts/squares.h"
#include "engine/metric/metric.h"

namespace merl::app {

/// What says which metric a folder of tiles has.
struct TileMetric {
    std::string text;         // for open_metrics()
    std::string source_hash;  // of its file
    bool is_final = false;    // MetricColumn::is_final
};

/// What a folder of tiles says of all its tiles (docs/file-formats.md).
struct TileManifest {
    pipeline::Provenance provenance;  // as provenance_before() has it
    std::vector<TileMetric> metrics;  // in the order of its metrics
    engine::Squares tiles;
    std::uint64_t voxels = 0;  // above the horizon, of the grid

    std::vector<std::string> materials() const;
};

/// The most tiles of a folder: what is kept of each in memory, and two files, stay few.
inline constexpr std::uint64_t kMostTiles = 1'000'000;

/// What tiles that are to be computed are of. `side` materials a tile, or where it is 0 as
/// default_tile_side() says. Throws Error (usage) where there would be more than kMostTiles.
TileManifest manifest_of(const pipeline::Provenance& provenance,
                         std::span<const engine::Metric* const> metrics, std::uint32_t side);

/// As a JSON file: of the same the same text.
std::string manifest_text(const TileManifest& manifest);

/// Reads that. Throws InputError, calling the file `file`, for what is none.
TileManifest parse_manifest(const std::string& text, const std::string& file);

/// The first that two manifests differ in, the database before the rest, since the number of its
/// materials changes that of the tiles: "database/path is "/a" there and "/b" here". Elements of
/// arrays count from 0: "metrics[1]/name". Empty where they are the same.
std::string manifest_difference(const std::string& there, const std::string& here);

/// What was found while a tile was computed.
struct TileRecord {
    engine::Rectangle rectangle;
    std::string rows_hash;  // content_digest() of these materials
    std::string columns_hash;
    std::uint64_t voxels = 0;
    std::string array_hash;  // hash_of() the numbers of the array, as they are in its file
    // Of a tile on the diagonal, of its materials:
    std::vector<std::string> planes;
    std::vector<engine::MaterialCounts> counts;
    std::vector<std::string> warnings;
};

/// Of a tile that was computed.
TileRecord record_of(const TileManifest& manifest, const pipeline::DistanceTile& tile);

std::string record_text(const TileManifest& manifest, const TileRecord& record);

/// Reads that of a tile. Throws InputError, calling the file `file`, for what is none of this tile.
TileRecord parse_record(const std::string& text, const std::string& file,
                        const TileManifest& manifest, const engine::Rectangle& rectangle);

}  // namespace merl::app
