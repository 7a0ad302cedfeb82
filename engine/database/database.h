#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/database/domain.h"

namespace merl::engine {

/// A contiguous range of voxels in file order, first included, last excluded.
struct VoxelRange {
    std::uint64_t first = 0;
    std::uint64_t last = 0;
    std::uint64_t size() const { return last - first; }
};

/// Above every physical reflectance (1/sr), and low enough that the float32 sums on the device,
/// which square it, cannot overflow.
constexpr double kMaxReflectance = 1e12;

/// A material of a database that cannot be used.
struct BadMaterial {
    std::string material;
    std::string reason;  // the error about it, which names its file
};

/// Some materials by name, ascending bytewise; without a value: all there are.
using WantedMaterials = std::optional<std::vector<std::string>>;

/// How a database is opened.
struct OpenOptions {
    Grid grid = {};                  ///< where it is evaluated, if it is (is_evaluated())
    WantedMaterials materials = {};  ///< only these are looked at, where that can be
    /// Where phi_d of MERL files ends; without it at 2 pi where is_over_all_of_phi_d(), else at pi.
    std::optional<PhiDRange> phi_d_range = {};
    /// Leave out what cannot be used (Database::skipped()). For that every sample is read once.
    bool skip_bad = false;
};

/// Takes what identifies the samples of one material while they are read: bytes of one of its three
/// planes, in order. The same bytes are the same content, however they come in pieces
/// (ContentHash).
using SampleSink = std::function<void(std::size_t plane, std::span<const std::byte> bytes)>;

/// One of the databases that another is made of, and what it is called there.
struct DatabasePart {
    std::string label;
    std::string name;  // this and what follows are as the database has them by itself
    std::string kind;
    std::string path;
    std::size_t first = 0;  // its materials follow each other, from this one on
    std::size_t materials = 0;
};

/// Measured BRDFs on one grid, read a range of voxels at a time.
///
/// A kind of database is a class derived from this one and a line in open_database.cpp. It fills in
/// the members below in its constructor. One that wraps others hands the sink on to them.
class Database {
  public:
    virtual ~Database() = default;
    Database(const Database&) = delete;
    Database& operator=(const Database&) = delete;

    const std::string& name() const { return name_; }
    /// What it is, for people: "MERL directory", "built-in stand-in" ... Summaries have it.
    const std::string& kind() const { return kind_; }

    /// What opens it again after a scan, in any working directory: where it is, absolute, or of a
    /// model its name; empty for one that only a program has.
    const std::string& path() const { return path_; }

    const Grid& grid() const { return grid_; }

    /// The databases that it is made of (joined_database.h), in the order of their materials, which
    /// are called "label/name"; none: it is one by itself.
    const std::vector<DatabasePart>& parts() const { return parts_; }

    /// Names as require_usable() has them, without extension; their order is that of everything
    /// else. Otherwise they may hold any bytes; whoever prints them sees to that (printable()).
    const std::vector<std::string>& materials() const { return materials_; }

    /// What was left out because it cannot be used, by name; only where the options say so.
    const std::vector<BadMaterial>& skipped() const { return skipped_; }

    /// Adds what was left out before it was opened.
    void add_skipped(const std::vector<BadMaterial>& skipped);

    /// Where a material is, for people: its file, or of what has none path() or name().
    virtual std::string place_of(std::size_t material) const;

    /// Reflectance in 1/sr of one material, by its index: `samples` gets three planes (red, green,
    /// blue) of `range.size()` numbers each, in the order of the voxels in MERL files (Domain).
    /// Negative numbers mean "not measured" and come as they are; the others are finite and at most
    /// kMaxReflectance; below the horizon any number will do. With `sink`, what identifies these
    /// samples is handed to it: the bytes of each plane of the range, or, of samples that are
    /// computed from a few figures, those figures to plane 0 when the range begins with voxel 0.
    /// Whoever wants that reads all ranges in order. Any thread may call it. Throws InputError that
    /// names the file, the voxel and what was found.
    virtual void read(std::size_t material, VoxelRange range, std::span<double> samples,
                      const SampleSink& sink = {}) const = 0;

    /// Lets it keep samples that take time to compute, at most so many bytes of them, so that
    /// reading them again is quick; more than one call: the largest. Returns how many it will keep
    /// at most; none where reading is quick anyway. Whoever bounds memory counts them.
    virtual std::uint64_t keep([[maybe_unused]] std::uint64_t bytes) const { return 0; }

  protected:
    Database(std::string name, std::string kind, std::string path = {})
        : name_(std::move(name)), kind_(std::move(kind)), path_(std::move(path)) {}

    std::string name_;
    std::string kind_;
    std::string path_;
    Grid grid_;
    std::vector<DatabasePart> parts_;
    std::vector<std::string> materials_;
    std::vector<BadMaterial> skipped_;
};

/// Throws InputError unless the grid has 1 to kMaxSide voxels a side and at most kMaxVoxels;
/// `database` is what has it.
void require_usable(const Grid& grid, const std::string& database);

/// Throws InputError unless the grid is usable, and the materials have different names, ascending
/// bytewise, that can become names of files: not empty, without a slash and a zero byte, and not
/// beginning with a dot. Where a database has parts the label of one and a slash come before that.
void require_usable(const Database& database);

/// What a file about a material is called, without an extension: the material's name, or
/// "label=name" for "label/name". No label has a "=", so different materials have different files.
std::string file_stem(std::string_view material);

/// The names that the materials of a part have by themselves, without its label.
std::vector<std::string> own_names(const Database& database, const DatabasePart& part);

/// Reads a whole material, some voxels at a time and in order: `use` gets each range and its
/// planes, as Database::read() gives them.
void read_material(
    const Database& database, std::size_t material, const SampleSink& sink,
    const std::function<void(VoxelRange range, std::span<const double> samples)>& use);

}  // namespace merl::engine
