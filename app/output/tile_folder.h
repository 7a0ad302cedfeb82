#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/output/npy_file.h"
#include "app/output/tile_manifest.h"
#include "app/pipeline/control.h"
#include "app/pipeline/distance_tiles.h"
#include "app/pipeline/pair_distances.h"
#include "scan/pairs/pairs.h"

namespace merl::app {

/// A folder of tiles of distances, which any number of processes write at once:
///
///     manifest.json       what they are of: database, metrics, engines, the side of the tiles
///     tile-00012.npy      the distances and bounds of a tile; it is there as a whole or not at all
///     tile-00012.json     what was read for them; it is there before they are
///
/// Files are all that processes know of each other (docs/file-formats.md).
class TileFolder {
  public:
    /// Opens one to read. Throws InputError, which names the file, for what is no such folder.
    explicit TileFolder(std::filesystem::path folder);

    /// Opens one to write, and makes it where it is not there yet. Throws InputError that names the
    /// difference where it is of another database, grid, metric, engine or version, or has tiles of
    /// another side; Error (output) where it cannot be made, or something else is in its place.
    TileFolder(std::filesystem::path folder, const TileManifest& manifest);

    const TileManifest& manifest() const { return manifest_; }
    std::string manifest_path() const;
    std::string manifest_hash() const;

    /// Whether a tile is there: its files, the record one of it, and the array the one that was
    /// written. Each is read for that until it was found whole, once; `progress` follows that and
    /// may throw.
    bool has(std::uint64_t tile, const std::function<void(double share)>& progress = {});

    /// How many are. The stage is "looking at tiles".
    std::uint64_t count(const pipeline::Control& control);

    /// Writes a tile: to files of other names, to the disk, then to their names. Throws Error
    /// (output) that names the file, and InputError where its samples are not those that a tile on
    /// the diagonal is of.
    void write(std::uint64_t tile, const pipeline::DistanceTile& computed);

    /// Removes what writers of files that are there left when they were killed.
    void sweep();

    /// The distances of all pairs under some of the metrics, in this order. Throws InputError that
    /// says how many tiles are missing, or names the file that is not as it should be or the
    /// metric that is not there, and what `control` throws. The stages are "looking at tiles" and
    /// "reading". Each file is read once.
    pipeline::PairDistances read(std::span<const std::string> metrics,
                                 const pipeline::Control& control) const;

    /// The same of some pairs, in the order that ListedDistances has.
    pipeline::ListedPairDistances read_listed(std::span<const std::string> metrics,
                                              std::span<const scan::Pair> pairs,
                                              const pipeline::Control& control) const;

  private:
    /// What the records of all tiles say.
    struct Records {
        std::vector<std::string> array_hashes;  // of each tile
        pipeline::Provenance provenance;
    };

    std::vector<std::uint64_t> sides_of(std::uint64_t tile) const;
    std::filesystem::path path_of(std::uint64_t tile, const char* extension) const;
    std::optional<std::uint64_t> tile_of(const std::string& file) const;
    TileRecord record(std::uint64_t tile) const;
    std::unique_ptr<const NpyFile> open(std::uint64_t tile, const std::string& array_hash,
                                        const std::function<void(double share)>& progress) const;
    void create(const std::string& text) const;
    void require_materials_of(const TileRecord& record);
    [[noreturn]] void refuse_missing(std::uint64_t missing, std::uint64_t first,
                                     const std::string& why) const;
    Records records(std::span<const std::size_t> places, const pipeline::Control& control) const;
    void read_arrays(
        const std::vector<std::string>& array_hashes,
        const std::function<bool(std::uint64_t tile)>& is_wanted,
        const std::function<void(std::uint64_t tile, std::span<const double> numbers)>& use,
        const pipeline::Control& control) const;
    pipeline::Provenance provenance(std::span<const std::size_t> places,
                                    std::span<const TileRecord> diagonal) const;
    std::vector<std::size_t> places_of(std::span<const std::string> metrics) const;
    std::vector<scan::MetricColumn> columns_of(std::span<const std::size_t> places,
                                               std::size_t pairs) const;

    std::filesystem::path folder_;
    std::string text_;  // of the manifest
    TileManifest manifest_;
    /// The tiles that were found whole, or written; of those on the diagonal the hash of the
    /// materials.
    std::map<std::uint64_t, std::string> whole_;
};

/// Whether a path is a directory, as that of such a folder is.
bool is_tile_folder(const std::string& path);

}  // namespace merl::app
