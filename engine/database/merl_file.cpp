#include "engine/database/merl_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>

#include "engine/base/file.h"
#include "engine/base/widest_vectors.h"
#include "engine/database/other_formats.h"

namespace merl::engine {
namespace {

static_assert(std::endian::native == std::endian::little, "MERL files are little-endian");

constexpr std::uint64_t kHeaderBytes = 12;

using Sizes = std::array<std::int32_t, 3>;

Sizes read_sizes(const File& file) {
    Sizes sizes = {};
    file.read(0, std::as_writable_bytes(std::span(sizes)));
    return sizes;
}

/// How many samples a header makes; nothing where no file has these sizes.
std::optional<std::uint64_t> samples_of(const Sizes& sizes) {
    std::uint64_t samples = 3;
    for (const auto size : sizes) {
        if (size <= 0 || static_cast<std::uint64_t>(size) > kMaxSide) {
            return std::nullopt;
        }
        samples *= static_cast<std::uint64_t>(size);  // three factors, each checked: no overflow
    }
    return samples;
}

/// Throws what is wrong with a file, or what else it is if that is known.
[[noreturn]] void fail_format(const File& file, const std::string& what) {
    const auto known = known_as(file);
    if (!known.empty()) {
        file.fail(known + "; expected a MERL file");
    }
    file.fail(what + (is_unknown_text(file) ? "; it is text" : ""));
}

/// The same where the header is wrong, or is not that of so many bytes.
[[noreturn]] void fail_header(const File& file, Sizes sizes, const std::string& what) {
    const auto has = [&](std::size_t bytes) {
        const auto samples = samples_of(sizes);
        return samples && file.bytes() == kHeaderBytes + *samples * bytes;
    };
    if (has(sizeof(float))) {
        file.fail(what + "; its samples are float32: write them again as float64");
    }
    for (auto& size : sizes) {
        size = static_cast<std::int32_t>(__builtin_bswap32(static_cast<std::uint32_t>(size)));
    }
    if (has(sizeof(double)) || has(sizeof(float))) {
        file.fail(fmt::format(
            "{}; it is big-endian ({} x {} x {}): write it again with little-endian numbers{}",
            what, sizes[0], sizes[1], sizes[2], has(sizeof(float)) ? ", samples as float64" : ""));
    }
    fail_format(file, what);
}

Grid checked_header(const File& file, std::optional<PhiDRange> range) {
    if (file.bytes() < kHeaderBytes) {
        fail_format(file,
                    fmt::format("has {} bytes; a MERL file has a header of {}, then its samples",
                                file.bytes(), kHeaderBytes));
    }
    const Sizes sizes = read_sizes(file);
    const auto fail = [&](const std::string& what) { fail_header(file, sizes, what); };
    const auto described = fmt::format("{} x {} x {}", sizes[0], sizes[1], sizes[2]);
    std::uint64_t voxels = 1;
    for (const auto size : sizes) {
        if (size <= 0) {
            fail(
                fmt::format("the header says {}; every size must be positive (MERL: 90 x 90 x "
                            "180)",
                            described));
        }
        if (static_cast<std::uint64_t>(size) > kMaxSide) {
            fail(
                fmt::format("the header says {}; every size may be at most {} (MERL: 90 x 90 "
                            "x 180)",
                            described, kMaxSide));
        }
        voxels *= static_cast<std::uint64_t>(size);  // three factors, each checked: no overflow
        if (voxels > kMaxVoxels) {
            fail(
                fmt::format("the header says {}; at most {} voxels are supported (MERL: 90 x 90 "
                            "x 180)",
                            described, kMaxVoxels));
        }
    }
    const std::uint64_t expected = kHeaderBytes + voxels * 3 * sizeof(double);
    if (file.bytes() != expected) {
        fail(fmt::format("has {} bytes; its header ({}) makes {}, so it is {}", file.bytes(),
                         described, expected, file.bytes() < expected ? "truncated" : "over-long"));
    }
    Grid grid = {static_cast<std::uint32_t>(sizes[0]), static_cast<std::uint32_t>(sizes[1]),
                 static_cast<std::uint32_t>(sizes[2])};
    grid.phi_d_range =
        range.value_or(is_over_all_of_phi_d(grid) ? PhiDRange::two_pi : PhiDRange::pi);
    if (grid.phi_d_range == PhiDRange::two_pi && grid.phi_d % 2 != 0) {
        file.fail(fmt::format("the header says {}; over [0, 2 pi) the number of phi_d is even",
                              described));
    }
    return grid;
}

/// Whether a number may be used: finite and not above kMaxReflectance (negative: not measured).
constexpr double kLowest = std::numeric_limits<double>::lowest();
bool acceptable(double value) {
    return value >= kLowest && value <= kMaxReflectance;
}

/// Multiplies in place. Whether every result is acceptable. What is negative stays so, whatever its
/// size: it was not measured, and -0 would be a measured zero.
MERL_SCAN_WIDEST_VECTORS bool scale(std::span<double> samples, double factor) {
    constexpr std::uint64_t kMinusZero = 1ULL << 63U;
    // Bits and counts instead of conditions, which become vector instructions.
    std::uint64_t good = 0;
    for (double& value : samples) {
        const auto scaled = std::bit_cast<std::uint64_t>(value * factor);
        const std::uint64_t vanished =
            std::uint64_t{scaled == kMinusZero} & std::uint64_t{value < 0};
        value = std::bit_cast<double>(scaled | vanished);
        good += std::uint64_t{value >= kLowest} & std::uint64_t{value <= kMaxReflectance};
    }
    return good == samples.size();
}

[[noreturn]] void fail_value(const File& file, const Grid& grid, std::size_t plane,
                             std::uint64_t index, double value) {
    constexpr std::array<const char*, 3> channels = {"red", "green", "blue"};
    file.fail(
        fmt::format("{} of voxel theta_h {}, theta_d {}, phi_d {} is {}/sr; expected a finite "
                    "number, at most {}",
                    channels[plane], index / grid.phi_d / grid.theta_d,
                    index / grid.phi_d % grid.theta_d, index % grid.phi_d, value, kMaxReflectance));
}

}  // namespace

bool is_over_all_of_phi_d(const Grid& grid) {
    return grid.phi_d == 4 * std::uint64_t{grid.theta_d};
}

MerlHeader read_merl_header(const std::filesystem::path& path, std::optional<PhiDRange> range) {
    File file(path);
    file.settle();
    const Grid grid = checked_header(file, range);
    file.expect(file.state());
    return {grid, file.state()};
}

void read_merl_samples(const std::filesystem::path& path, const MerlHeader& header,
                       VoxelRange range, std::span<double> samples, const SampleSink& sink) {
    const File file(path);
    const Grid& grid = header.grid;
    file.expect(header.state);
    for (std::size_t plane = 0; plane < 3; ++plane) {
        const auto to = samples.subspan(plane * range.size(), range.size());
        file.read(kHeaderBytes + (plane * grid.voxels() + range.first) * sizeof(double),
                  std::as_writable_bytes(to));
        if (sink) {
            sink(plane, std::as_bytes(to));
        }
        if (!scale(to, kMerlScale[plane])) {
            for (std::uint64_t i = 0; i < to.size(); ++i) {
                if (!acceptable(to[i])) {
                    fail_value(file, grid, plane, range.first + i, to[i]);
                }
            }
        }
    }
    file.expect(header.state);
}

void check_merl_samples(const std::filesystem::path& path, const MerlHeader& header) {
    constexpr std::uint64_t kVoxelsAtATime = 16384;  // whose planes stay in cache
    const std::uint64_t voxels = header.grid.voxels();
    std::vector<double> samples(3 * std::min(kVoxelsAtATime, voxels));
    for (std::uint64_t first = 0; first < voxels; first += kVoxelsAtATime) {
        const VoxelRange range = {first, std::min(first + kVoxelsAtATime, voxels)};
        read_merl_samples(path, header, range, std::span(samples).first(3 * range.size()));
    }
}

std::string merl_file(const Database& database, std::size_t material) {
    const auto& grid = database.grid();
    const Domain domain(grid);
    const std::array<std::uint32_t, 3> header = {grid.theta_h, grid.theta_d, grid.phi_d};
    std::vector<double> samples(grid.voxels() * 3);
    database.read(material, {0, grid.voxels()}, samples);
    for (std::uint64_t i = 0; i < grid.voxels(); ++i) {
        const auto at = [&](std::size_t plane) -> double& {
            return samples[plane * grid.voxels() + i];
        };
        const bool is_nothing = at(0) == 0 && at(1) == 0 && at(2) == 0;
        const bool measured = !is_nothing || domain.voxel(i).above_horizon();
        for (std::size_t plane = 0; plane < 3; ++plane) {
            at(plane) = measured ? at(plane) / kMerlScale[plane] : kMerlNotMeasured;
        }
    }
    std::string bytes(sizeof(header) + samples.size() * sizeof(double), '\0');
    std::memcpy(bytes.data(), header.data(), sizeof(header));
    std::memcpy(bytes.data() + sizeof(header), samples.data(), samples.size() * sizeof(double));
    return bytes;
}

}  // namespace merl::engine
