#include "app/output/tile_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cmath>
#include <cstring>
#include <system_error>
#include <utility>

#include "app/cli/interrupt.h"
#include "app/output/npy_file.h"
#include "app/output/staging.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"

namespace merl::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "manifest.json";

/// What follows the name of a file that is being written; a dot comes before it.
constexpr std::string_view kPartial = ".partial-";

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
    throw Error(Fault::output, fmt::format("{}: {}", path.string(), what));
}

/// This process among all that share a file system.
std::string own_mark() {
    std::array<char, HOST_NAME_MAX + 1> host = {};
    ::gethostname(host.data(), host.size() - 1);
    return fmt::format("{}-{}", host.data(), ::getpid());
}

fs::path partial_path(const fs::path& path) {
    return path.parent_path() /
           fmt::format(".{}{}{}", path.filename().string(), kPartial, own_mark());
}

/// Writes a file that nobody looks for yet, to the disk.
void write_partial(const fs::path& partial, const fs::path& path,
                   const std::function<void(int file)>& write) {
    set_unfinished(partial);
    try {
        const Descriptor file(
            ::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
        if (file.get() < 0) {
            throw std::system_error(errno, std::generic_category());
        }
        write(file.get());
        sync_file(file.get());
    } catch (const std::system_error& error) {
        ::unlink(partial.c_str());
        set_unfinished({});
        fail(path, fmt::format("cannot be written: {}", error.code().message()));
    }
}

void sync_folder(const fs::path& folder) {
    const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (directory.get() >= 0) {
        sync_file(directory.get());
    }
}

/// A distance is a number from 0, a bound too, which may be infinite.
void require_numbers(std::span<const double> distances, std::span<const double> bounds,
                     const fs::path& path) {
    const auto bad =
        std::ranges::find_if_not(distances, [](double d) { return std::isfinite(d) && d >= 0; });
    if (bad != distances.end()) {
        throw InputError(fmt::format("{}: found the distance {}; expected finite numbers from 0",
                                     path.string(), *bad));
    }
    const auto worse = std::ranges::find_if_not(bounds, [](double bound) { return bound >= 0; });
    if (worse != bounds.end()) {
        throw InputError(
            fmt::format("{}: found the bound {}; expected numbers from 0", path.string(), *worse));
    }
}

}  // namespace

TileFolder::TileFolder(fs::path folder) : folder_(std::move(folder)) {
    std::error_code none;
    if (!fs::exists(folder_ / kManifest, none)) {
        throw InputError(
            fmt::format("{}: found no {}; expected a folder that `merl-scan distances` wrote",
                        folder_.string(), kManifest));
    }
    text_ = scan::read_input(manifest_path());
    manifest_ = parse_manifest(text_, manifest_path());
}

TileFolder::TileFolder(fs::path folder, const TileManifest& manifest) : folder_(std::move(folder)) {
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error || !fs::is_directory(folder_, error)) {
        fail(folder_, error ? fmt::format("cannot be made: {}", error.message())
                            : std::string("exists and is not a directory; choose another --out"));
    }
    text_ = manifest_text(manifest);
    if (!fs::exists(folder_ / kManifest, error)) {
        create(text_);
    }
    const auto found = scan::read_input(manifest_path());
    manifest_ = parse_manifest(found, manifest_path());
    if (found != text_) {
        throw InputError(fmt::format(
            "{}: the tiles are of something else: {}; choose another --out, or compute what they "
            "are of",
            manifest_path(), manifest_difference(found, text_)));
    }
}

std::string TileFolder::manifest_path() const {
    return (folder_ / kManifest).string();
}

std::string TileFolder::manifest_hash() const {
    return hash_of(text_);
}

/// Whoever is first; of several at once one.
void TileFolder::create(const std::string& text) const {
    for (const auto& entry : fs::directory_iterator(folder_)) {
        const auto name = entry.path().filename().string();
        if (name != kManifest && !name.starts_with('.')) {
            fail(folder_, fmt::format("has {} and no {}, so it is no folder of tiles; choose "
                                      "another --out",
                                      name, kManifest));
        }
    }
    const auto path = folder_ / kManifest;
    const auto partial = partial_path(path);
    write_partial(partial, path, [&](int file) { scan::write_all(file, text); });
    const bool failed = ::link(partial.c_str(), path.c_str()) != 0 && errno != EEXIST;
    const int why = errno;
    ::unlink(partial.c_str());
    set_unfinished({});
    if (failed) {
        fail(path, fmt::format("cannot be made: {}", std::strerror(why)));
    }
    sync_folder(folder_);
}

fs::path TileFolder::path_of(std::uint64_t tile, const char* extension) const {
    return folder_ / fmt::format("tile-{:05}{}", tile, extension);
}

std::vector<std::uint64_t> TileFolder::sides_of(std::uint64_t tile) const {
    const auto rectangle = manifest_.tiles.at(tile);
    return {manifest_.metrics.size(), 2, rectangle.rows, rectangle.columns};
}

bool TileFolder::has(std::uint64_t tile) const {
    if (!is_there(path_of(tile, ".json"))) {
        return false;
    }
    try {
        open(tile);
        return true;
    } catch (const InputError&) {
        return false;
    }
}

/// As it was written: a byte that a disk or a copy changed is seen.
std::unique_ptr<const NpyFile> TileFolder::open(std::uint64_t tile) const {
    const auto path = path_of(tile, ".npy");
    auto array = std::make_unique<const NpyFile>(path, sides_of(tile));
    const auto expected = record(tile).array_hash;
    if (const auto found = hash_of_numbers(array->numbers()); found != expected) {
        throw InputError(
            fmt::format("{}: found numbers with the hash {}; expected those of its .json, {}",
                        path.string(), found, expected));
    }
    return array;
}

std::uint64_t TileFolder::count() const {
    std::uint64_t there = 0;
    for (std::uint64_t tile = 0; tile < manifest_.tiles.count(); ++tile) {
        there += has(tile) ? 1 : 0;
    }
    return there;
}

void TileFolder::write_whole(const fs::path& path, const std::function<void(int file)>& write) {
    const auto partial = partial_path(path);
    write_partial(partial, path, write);
    // Another process may have found the tile of yet another one there, and swept.
    const bool failed =
        ::rename(partial.c_str(), path.c_str()) != 0 && !(errno == ENOENT && is_there(path));
    const int why = errno;
    set_unfinished({});
    if (failed) {
        ::unlink(partial.c_str());
        fail(path, fmt::format("cannot be put into place: {}", std::strerror(why)));
    }
}

TileRecord TileFolder::record(std::uint64_t tile) const {
    const auto path = path_of(tile, ".json").string();
    return parse_record(scan::read_input(path), path, manifest_, manifest_.tiles.at(tile));
}

/// Against the tiles on the diagonal that are there.
void TileFolder::require_materials_of(const TileRecord& record) const {
    const auto& [row, rows, column, columns] = record.rectangle;
    for (const auto& [first, hash] :
         {std::pair(row, record.rows_hash), {column, record.columns_hash}}) {
        const auto diagonal = manifest_.tiles.on_diagonal(first / manifest_.tiles.side);
        if (has(diagonal) && this->record(diagonal).rows_hash != hash) {
            const auto& names = manifest_.provenance.database->materials;
            throw InputError(fmt::format(
                "{}: the samples of {} to {} are not those of which {} is; the database was "
                "changed: restore it, or compute all tiles anew in another folder",
                manifest_.provenance.database->name, names[first].name,
                names[first + (first == row ? rows : columns) - 1].name,
                path_of(diagonal, ".npy").string()));
        }
    }
}

void TileFolder::write(std::uint64_t tile, const pipeline::DistanceTile& computed) const {
    const auto record = record_of(manifest_, computed);
    require_materials_of(record);
    write_whole(path_of(tile, ".json"),
                [&](int file) { scan::write_all(file, record_text(manifest_, record)); });
    write_whole(path_of(tile, ".npy"), [&](int file) {
        scan::write_all(file, npy_header(sides_of(tile)));
        const auto bytes = std::as_bytes(std::span(computed.numbers));
        scan::write_all(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    });
    sync_folder(folder_);
}

void TileFolder::sweep() const {
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(folder_, none)) {
        const auto name = entry.path().filename().string();
        const auto end = name.find(kPartial);
        if (!name.starts_with('.') || end == std::string::npos) {
            continue;
        }
        const auto whole = name.substr(1, end - 1);
        for (std::uint64_t tile = 0; tile < manifest_.tiles.count(); ++tile) {
            if ((whole == path_of(tile, ".npy").filename() ||
                 whole == path_of(tile, ".json").filename()) &&
                has(tile)) {
                ::unlink(entry.path().c_str());
            }
        }
    }
}

std::vector<std::size_t> TileFolder::places_of(std::span<const std::string> metrics) const {
    std::vector<std::size_t> places;
    const auto& there = manifest_.provenance.metrics;
    for (const auto& name : metrics) {
        const auto found = std::ranges::find(there, name, &pipeline::MetricProvenance::name);
        if (found == there.end()) {
            std::vector<std::string> names;
            std::ranges::transform(there, std::back_inserter(names),
                                   &pipeline::MetricProvenance::name);
            throw InputError(fmt::format("{}: found no metric \"{}\"; expected of {}",
                                         manifest_path(), name, fmt::join(names, ", ")));
        }
        places.push_back(static_cast<std::size_t>(found - there.begin()));
    }
    return places;
}

void TileFolder::require_all() const {
    std::uint64_t missing = 0;
    std::uint64_t first = 0;
    const auto count = manifest_.tiles.count();
    for (std::uint64_t tile = 0; tile < count; ++tile) {
        if (!has(tile) && missing++ == 0) {
            first = tile;
        }
    }
    if (missing > 0) {
        const auto path = path_of(first, ".npy");
        std::string why;
        if (is_there(path)) {
            try {
                if (is_there(path_of(first, ".json"))) {
                    open(first);
                }
                why = "; its .json is missing";
            } catch (const InputError& error) {
                why = fmt::format(" ({})", error.what());
            }
        }
        throw InputError(fmt::format(
            "{}: {} of {} tiles are missing, the first is {}{}; the same "
            "`merl-scan distances --out {}` again computes them",
            folder_.string(), missing, count, path.filename().string(), why, folder_.string()));
    }
}

pipeline::Provenance TileFolder::provenance(std::span<const std::size_t> places,
                                            const pipeline::Control& control) const {
    auto result = manifest_.provenance;
    std::vector<std::string> planes;
    std::vector<engine::MaterialCounts> counts;
    std::vector<std::string> of_groups;  // hashes, of the materials of each tile on the diagonal
    const auto& tiles = manifest_.tiles;
    for (std::uint32_t group = 0; group < tiles.across(); ++group) {
        const auto found = record(tiles.on_diagonal(group));
        planes.insert(planes.end(), found.planes.begin(), found.planes.end());
        counts.insert(counts.end(), found.counts.begin(), found.counts.end());
        for (const auto& warning : found.warnings) {
            if (std::ranges::find(result.warnings, warning) == result.warnings.end()) {
                result.warnings.push_back(warning);
            }
        }
        of_groups.push_back(found.rows_hash);
        result.database->voxels = found.voxels;
    }
    for (std::uint64_t tile = 0; tile < tiles.count(); ++tile) {
        const auto found = record(tile);
        if (found.rows_hash != of_groups[found.rectangle.row / tiles.side] ||
            found.columns_hash != of_groups[found.rectangle.column / tiles.side]) {
            throw InputError(fmt::format(
                "{}: is of other samples than the tiles on the diagonal; the database was changed "
                "meanwhile: compute all tiles anew",
                path_of(tile, ".json").string()));
        }
        control.update("reading", 0);
    }
    pipeline::add_materials(result, planes, counts);
    result.tiles = {folder_.string(), manifest_hash(), tiles.count()};
    std::vector<pipeline::MetricProvenance> chosen;
    for (const auto place : places) {
        chosen.push_back(result.metrics[place]);
    }
    result.metrics = std::move(chosen);
    for (auto& engine : result.engines) {
        std::erase_if(engine.metrics, [&](const std::string& name) {
            return std::ranges::find(result.metrics, name, &pipeline::MetricProvenance::name) ==
                   result.metrics.end();
        });
    }
    std::erase_if(result.engines, [](const auto& engine) { return engine.metrics.empty(); });
    return result;
}

std::vector<scan::MetricColumn> TileFolder::columns_of(std::span<const std::size_t> places,
                                                       std::size_t pairs) const {
    std::vector<scan::MetricColumn> columns;
    for (const auto place : places) {
        columns.push_back({.metric = manifest_.provenance.metrics[place].name,
                           .values = std::vector<double>(pairs),
                           .bounds = std::vector<double>(pairs),
                           .is_final = manifest_.metrics[place].is_final});
    }
    return columns;
}

pipeline::PairDistances TileFolder::read(std::span<const std::string> metrics,
                                         const pipeline::Control& control) const {
    Stopwatch watch;
    require_all();
    const auto places = places_of(metrics);
    pipeline::PairDistances result;
    result.provenance = provenance(places, control);
    result.table.names = manifest_.materials();
    const auto materials = result.table.materials();
    result.table.metrics = columns_of(places, result.table.pairs());
    for (std::uint64_t tile = 0; tile < manifest_.tiles.count(); ++tile) {
        const auto path = path_of(tile, ".npy");
        const auto at = manifest_.tiles.at(tile);
        const auto array = open(tile);
        const std::size_t plane = std::size_t{at.rows} * at.columns;
        for (std::size_t m = 0; m < places.size(); ++m) {
            const auto distances = array->numbers().subspan(2 * places[m] * plane, plane);
            const auto bounds = array->numbers().subspan((2 * places[m] + 1) * plane, plane);
            require_numbers(distances, bounds, path);
            auto& column = result.table.metrics[m];
            for (std::uint32_t r = 0; r < at.rows; ++r) {
                const std::uint32_t skipped = at.is_diagonal() ? r + 1 : 0;
                if (skipped >= at.columns) {
                    continue;
                }
                const auto first = static_cast<std::ptrdiff_t>(
                    scan::pair_index({at.row + r, at.column + skipped}, materials));
                const std::size_t in_row = std::size_t{r} * at.columns + skipped;
                const std::size_t count = at.columns - skipped;
                std::ranges::copy(distances.subspan(in_row, count), column.values.begin() + first);
                std::ranges::copy(bounds.subspan(in_row, count), column.bounds.begin() + first);
            }
        }
        control.update("reading", static_cast<double>(tile + 1) /
                                      static_cast<double>(manifest_.tiles.count()));
    }
    result.provenance.seconds.total = watch.lap();
    return result;
}

pipeline::ListedPairDistances TileFolder::read_listed(std::span<const std::string> metrics,
                                                      std::span<const scan::Pair> pairs,
                                                      const pipeline::Control& control) const {
    Stopwatch watch;
    require_all();
    const auto places = places_of(metrics);
    pipeline::ListedPairDistances result;
    result.provenance = provenance(places, control);
    result.table.names = manifest_.materials();
    result.table.pairs.assign(pairs.begin(), pairs.end());
    result.table.metrics = columns_of(places, pairs.size());
    const auto& tiles = manifest_.tiles;
    std::vector<std::vector<std::size_t>> of_tile(tiles.count());  // places in `pairs`
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        of_tile[tiles.number_of(pairs[p].first / tiles.side, pairs[p].second / tiles.side)]
            .push_back(p);
    }
    for (std::uint64_t tile = 0; tile < tiles.count(); ++tile) {
        if (of_tile[tile].empty()) {
            continue;
        }
        const auto path = path_of(tile, ".npy");
        const auto at = tiles.at(tile);
        const auto array = open(tile);
        const std::size_t plane = std::size_t{at.rows} * at.columns;
        for (const auto p : of_tile[tile]) {
            const std::size_t in_plane =
                std::size_t{pairs[p].first - at.row} * at.columns + (pairs[p].second - at.column);
            for (std::size_t m = 0; m < places.size(); ++m) {
                const auto distance = array->numbers().subspan(2 * places[m] * plane + in_plane, 1);
                const auto bound =
                    array->numbers().subspan((2 * places[m] + 1) * plane + in_plane, 1);
                require_numbers(distance, bound, path);
                result.table.metrics[m].values[p] = distance[0];
                result.table.metrics[m].bounds[p] = bound[0];
            }
        }
        control.update("reading",
                       static_cast<double>(tile + 1) / static_cast<double>(tiles.count()));
    }
    result.provenance.seconds.total = watch.lap();
    return result;
}

bool is_tile_folder(const std::string& path) {
    std::error_code none;
    return fs::is_directory(path, none);
}

}  // namespace merl::app
