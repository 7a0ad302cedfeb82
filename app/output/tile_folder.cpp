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
#include "engine/base/number.h"
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

/// A file that nobody looks for yet, beside the one that it becomes. It goes with this, unless it
/// was put into place.
class PartialFile {
  public:
    /// Throws Error (output) where it cannot be made.
    explicit PartialFile(fs::path path) : path_(std::move(path)) {
        // A process of the same number may have been killed, or be at work in another container.
        for (int number = 1;; ++number) {
            name_ = path_.parent_path() / fmt::format(".{}{}{}-{}", path_.filename().string(),
                                                      kPartial, own_mark(), number);
            file_ =
                Descriptor(::open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
            if (file_.get() >= 0) {
                break;
            }
            if (errno != EEXIST) {
                fail(path_, fmt::format("cannot be written: {}", std::strerror(errno)));
            }
        }
        set_unfinished(name_);
    }
    ~PartialFile() {
        if (!name_.empty()) {
            ::unlink(name_.c_str());
        }
        set_unfinished({});
    }
    PartialFile(const PartialFile&) = delete;
    PartialFile& operator=(const PartialFile&) = delete;

    /// Writes it, to the disk. Throws Error (output).
    void write(const std::function<void(int file)>& write) const {
        try {
            write(file_.get());
            sync_file(file_.get());
        } catch (const std::system_error& error) {
            fail(path_, fmt::format("cannot be written: {}", error.code().message()));
        }
    }

    /// Gives it the name of what it becomes, unless somebody else was first. Throws Error (output).
    void link() const { require(::link(name_.c_str(), path_.c_str()) == 0 || errno == EEXIST); }

    /// The same, in the place of what has that name.
    void rename() {
        require(::rename(name_.c_str(), path_.c_str()) == 0);
        name_.clear();
    }

  private:
    /// Another process may have found the file of yet another one there, and swept.
    void require(bool done) const {
        const int why = errno;
        if (!done && !(why == ENOENT && is_there(path_))) {
            fail(path_, fmt::format("cannot be put into place: {}", std::strerror(why)));
        }
    }

    fs::path path_;
    fs::path name_;  // of this file
    Descriptor file_;
};

/// Writes a file: to one of another name, to the disk, then to its name.
void write_whole(const fs::path& path, const std::function<void(int file)>& write) {
    PartialFile partial(path);
    partial.write(write);
    partial.rename();
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

/// The progress of one tile among all.
std::function<void(double share)> share_of(const pipeline::Control& control, std::string_view stage,
                                           std::uint64_t tile, std::uint64_t tiles) {
    return [=, &control](double share) {
        control.update(stage, (static_cast<double>(tile) + share) / static_cast<double>(tiles));
    };
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
    const PartialFile partial(folder_ / kManifest);
    partial.write([&](int file) { scan::write_all(file, text); });
    partial.link();
    sync_folder(folder_);
}

fs::path TileFolder::path_of(std::uint64_t tile, const char* extension) const {
    return folder_ / fmt::format("tile-{:05}{}", tile, extension);
}

std::vector<std::uint64_t> TileFolder::sides_of(std::uint64_t tile) const {
    const auto rectangle = manifest_.tiles.at(tile);
    return {manifest_.metrics.size(), 2, rectangle.rows, rectangle.columns};
}

/// The tile that a file of this name is of; none for another file.
std::optional<std::uint64_t> TileFolder::tile_of(const std::string& file) const {
    constexpr std::string_view kTile = "tile-";
    if (!file.starts_with(kTile)) {
        return std::nullopt;
    }
    const auto tile = parse_number<std::uint64_t>(
        std::string_view(file).substr(kTile.size(), file.find('.') - kTile.size()));
    const bool is_one =
        tile && *tile < manifest_.tiles.count() &&
        (file == path_of(*tile, ".npy").filename() || file == path_of(*tile, ".json").filename());
    return is_one ? tile : std::nullopt;
}

bool TileFolder::has(std::uint64_t tile, const std::function<void(double share)>& progress) {
    if (!is_there(path_of(tile, ".json")) || !is_there(path_of(tile, ".npy"))) {
        return false;
    }
    if (whole_.contains(tile)) {
        return true;
    }
    try {
        const auto found = record(tile);
        open(tile, found.array_hash, progress);
        whole_.emplace(tile, found.rectangle.is_diagonal() ? found.rows_hash : std::string());
        return true;
    } catch (const InputError&) {
        return false;
    }
}

/// As it was written: a byte that a disk or a copy changed is seen.
std::unique_ptr<const NpyFile> TileFolder::open(
    std::uint64_t tile, const std::string& array_hash,
    const std::function<void(double share)>& progress) const {
    const auto path = path_of(tile, ".npy");
    auto array = std::make_unique<const NpyFile>(path, sides_of(tile));
    if (const auto found = hash_of_numbers(array->numbers(), progress); found != array_hash) {
        throw InputError(
            fmt::format("{}: found numbers with the hash {}; expected those of its .json, {}",
                        path.string(), found, array_hash));
    }
    return array;
}

std::uint64_t TileFolder::count(const pipeline::Control& control) {
    const auto tiles = manifest_.tiles.count();
    std::uint64_t there = 0;
    for (std::uint64_t tile = 0; tile < tiles; ++tile) {
        const auto progress = share_of(control, "looking at tiles", tile, tiles);
        progress(0);
        there += has(tile, progress) ? 1 : 0;
    }
    return there;
}

TileRecord TileFolder::record(std::uint64_t tile) const {
    const auto path = path_of(tile, ".json").string();
    return parse_record(scan::read_input(path), path, manifest_, manifest_.tiles.at(tile));
}

/// Against the tiles on the diagonal that are there.
void TileFolder::require_materials_of(const TileRecord& record) {
    const auto& [row, rows, column, columns] = record.rectangle;
    for (const auto& [first, hash] :
         {std::pair(row, record.rows_hash), {column, record.columns_hash}}) {
        const auto diagonal = manifest_.tiles.on_diagonal(first / manifest_.tiles.side);
        if (has(diagonal) && whole_.at(diagonal) != hash) {
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

void TileFolder::write(std::uint64_t tile, const pipeline::DistanceTile& computed) {
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
    whole_.insert_or_assign(tile,
                            record.rectangle.is_diagonal() ? record.rows_hash : std::string());
}

void TileFolder::sweep() {
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(folder_, none)) {
        const auto name = entry.path().filename().string();
        const auto end = name.find(kPartial);
        if (!name.starts_with('.') || end == std::string::npos) {
            continue;
        }
        const auto whole = name.substr(1, end - 1);
        const auto tile = tile_of(whole);
        if (whole == kManifest || (tile && has(*tile))) {
            ::unlink(entry.path().c_str());
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

void TileFolder::refuse_missing(std::uint64_t missing, std::uint64_t first,
                                const std::string& why) const {
    throw InputError(
        fmt::format("{}: {} of {} tiles are missing, the first is {}{}; the same "
                    "`merl-scan distances --out {}` again computes them",
                    folder_.string(), missing, manifest_.tiles.count(),
                    path_of(first, ".npy").filename().string(), why, folder_.string()));
}

TileFolder::Records TileFolder::records(std::span<const std::size_t> places,
                                        const pipeline::Control& control) const {
    const auto& tiles = manifest_.tiles;
    std::uint64_t looked = 0;
    std::uint64_t missing = 0;
    std::uint64_t first = tiles.count();
    std::string why;
    // None where a tile is missing. What its array has is looked at when that is read.
    const auto look = [&](std::uint64_t tile) -> std::optional<TileRecord> {
        share_of(control, "looking at tiles", looked++, tiles.count())(0);
        std::string reason;
        try {
            if (!is_there(path_of(tile, ".npy"))) {
                reason = "";
            } else if (!is_there(path_of(tile, ".json"))) {
                reason = "; its .json is missing";
            } else {
                const NpyFile array(path_of(tile, ".npy"), sides_of(tile));
                return record(tile);
            }
        } catch (const InputError& error) {
            reason = fmt::format(" ({})", error.what());
        }
        ++missing;
        if (tile < first) {
            first = tile;
            why = reason;
        }
        return std::nullopt;
    };
    Records result;
    std::vector<TileRecord> diagonal(tiles.across());
    for (std::uint32_t group = 0; group < tiles.across(); ++group) {
        diagonal[group] = look(tiles.on_diagonal(group)).value_or(TileRecord());
    }
    for (std::uint32_t row = 0; row < tiles.across(); ++row) {
        result.array_hashes.push_back(diagonal[row].array_hash);
        for (std::uint32_t column = row + 1; column < tiles.across(); ++column) {
            const auto tile = tiles.number_of(row, column);
            const auto found = look(tile);
            result.array_hashes.push_back(found ? found->array_hash : std::string());
            // Of a tile on the diagonal that is missing nothing is known.
            const auto is_of = [](const std::string& hash, const TileRecord& whole) {
                return whole.rows_hash.empty() || hash == whole.rows_hash;
            };
            if (found && !(is_of(found->rows_hash, diagonal[row]) &&
                           is_of(found->columns_hash, diagonal[column]))) {
                throw InputError(fmt::format(
                    "{}: is of other samples than the tiles on the diagonal; the database was "
                    "changed meanwhile: compute all tiles anew",
                    path_of(tile, ".json").string()));
            }
        }
    }
    if (missing > 0) {
        refuse_missing(missing, first, why);
    }
    result.provenance = provenance(places, diagonal);
    return result;
}

void TileFolder::read_arrays(
    const std::vector<std::string>& array_hashes,
    const std::function<bool(std::uint64_t tile)>& is_wanted,
    const std::function<void(std::uint64_t tile, std::span<const double> numbers)>& use,
    const pipeline::Control& control) const {
    std::uint64_t missing = 0;
    std::uint64_t first = 0;
    std::string why;
    for (std::uint64_t tile = 0; tile < array_hashes.size(); ++tile) {
        const auto progress = share_of(control, "reading", tile, array_hashes.size());
        progress(0);
        if (!is_wanted(tile)) {
            continue;
        }
        std::unique_ptr<const NpyFile> array;
        try {
            array = open(tile, array_hashes[tile], progress);
        } catch (const InputError& error) {
            if (missing++ == 0) {
                first = tile;
                why = fmt::format(" ({})", error.what());
            }
            continue;
        }
        use(tile, array->numbers());
    }
    if (missing > 0) {
        refuse_missing(missing, first, why);
    }
}

/// From what the records of the tiles on the diagonal say.
pipeline::Provenance TileFolder::provenance(std::span<const std::size_t> places,
                                            std::span<const TileRecord> diagonal) const {
    auto result = manifest_.provenance;
    std::vector<std::string> planes;
    std::vector<engine::MaterialCounts> counts;
    for (const auto& found : diagonal) {
        planes.insert(planes.end(), found.planes.begin(), found.planes.end());
        counts.insert(counts.end(), found.counts.begin(), found.counts.end());
        for (const auto& warning : found.warnings) {
            if (std::ranges::find(result.warnings, warning) == result.warnings.end()) {
                result.warnings.push_back(warning);
            }
        }
        result.database->voxels = found.voxels;
    }
    pipeline::add_materials(result, planes, counts);
    result.tiles = {folder_.string(), manifest_hash(), manifest_.tiles.count()};
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
    const auto places = places_of(metrics);
    auto found = records(places, control);
    pipeline::PairDistances result;
    result.provenance = std::move(found.provenance);
    result.table.names = manifest_.materials();
    const auto materials = result.table.materials();
    result.table.metrics = columns_of(places, result.table.pairs());
    const auto all = [](std::uint64_t /*tile*/) { return true; };
    const auto use = [&](std::uint64_t tile, std::span<const double> numbers) {
        const auto at = manifest_.tiles.at(tile);
        const std::size_t plane = std::size_t{at.rows} * at.columns;
        for (std::size_t m = 0; m < places.size(); ++m) {
            const auto distances = numbers.subspan(2 * places[m] * plane, plane);
            const auto bounds = numbers.subspan((2 * places[m] + 1) * plane, plane);
            require_numbers(distances, bounds, path_of(tile, ".npy"));
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
    };
    read_arrays(found.array_hashes, all, use, control);
    result.provenance.seconds.total = watch.lap();
    return result;
}

pipeline::ListedPairDistances TileFolder::read_listed(std::span<const std::string> metrics,
                                                      std::span<const scan::Pair> pairs,
                                                      const pipeline::Control& control) const {
    Stopwatch watch;
    const auto places = places_of(metrics);
    auto found = records(places, control);
    pipeline::ListedPairDistances result;
    result.provenance = std::move(found.provenance);
    result.table.names = manifest_.materials();
    result.table.pairs.assign(pairs.begin(), pairs.end());
    result.table.metrics = columns_of(places, pairs.size());
    const auto& tiles = manifest_.tiles;
    std::vector<std::vector<std::size_t>> of_tile(tiles.count());  // places in `pairs`
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        of_tile[tiles.number_of(pairs[p].first / tiles.side, pairs[p].second / tiles.side)]
            .push_back(p);
    }
    const auto has_any = [&](std::uint64_t tile) { return !of_tile[tile].empty(); };
    const auto use = [&](std::uint64_t tile, std::span<const double> numbers) {
        const auto at = tiles.at(tile);
        const std::size_t plane = std::size_t{at.rows} * at.columns;
        for (const auto p : of_tile[tile]) {
            const std::size_t in_plane =
                std::size_t{pairs[p].first - at.row} * at.columns + (pairs[p].second - at.column);
            for (std::size_t m = 0; m < places.size(); ++m) {
                const auto distance = numbers.subspan(2 * places[m] * plane + in_plane, 1);
                const auto bound = numbers.subspan((2 * places[m] + 1) * plane + in_plane, 1);
                require_numbers(distance, bound, path_of(tile, ".npy"));
                result.table.metrics[m].values[p] = distance[0];
                result.table.metrics[m].bounds[p] = bound[0];
            }
        }
    };
    read_arrays(found.array_hashes, has_any, use, control);
    result.provenance.seconds.total = watch.lap();
    return result;
}

bool is_tile_folder(const std::string& path) {
    std::error_code none;
    return fs::is_directory(path, none);
}

}  // namespace merl::app
