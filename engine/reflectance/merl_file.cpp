#include "engine/reflectance/merl_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>

#include "engine/error.h"
#include "engine/widest_vectors.h"

namespace merl::reflectance {
namespace {

static_assert(std::endian::native == std::endian::little, "MERL files are little-endian");

constexpr std::uint64_t kHeaderBytes = 12;

/// An open file that closes itself.
class File {
  public:
    explicit File(const std::filesystem::path& path) : path_(path) {
        // Non-blocking, so that a FIFO called x.binary is refused and not waited for.
        descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
        if (descriptor_ < 0) {
            fail(fmt::format("cannot be opened: {}", std::strerror(errno)));
        }
        struct stat status = {};
        if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
            ::close(descriptor_);
            fail("is not a regular file");
        }
        bytes_ = static_cast<std::uint64_t>(status.st_size);
    }
    ~File() { ::close(descriptor_); }
    File(const File&) = delete;
    File& operator=(const File&) = delete;

    std::uint64_t bytes() const { return bytes_; }

    void read(std::uint64_t offset, std::span<std::byte> to) const {
        while (!to.empty()) {
            const auto got = ::pread(descriptor_, to.data(), to.size(), static_cast<off_t>(offset));
            if (got < 0 && errno == EINTR) {
                continue;
            }
            if (got <= 0) {
                fail(got < 0 ? fmt::format("cannot be read at byte {}: {}", offset,
                                           std::strerror(errno))
                             : fmt::format("ends at byte {} while it is read; it had {} bytes",
                                           offset, bytes_));
            }
            offset += static_cast<std::uint64_t>(got);
            to = to.subspan(static_cast<std::size_t>(got));
        }
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(Fault::input, fmt::format("{}: {}", path_.string(), what));
    }

  private:
    std::filesystem::path path_;
    int descriptor_ = -1;
    std::uint64_t bytes_ = 0;
};

Grid checked_header(const File& file) {
    if (file.bytes() < kHeaderBytes) {
        file.fail(fmt::format("has {} bytes; a MERL file has a header of {}, then its samples",
                              file.bytes(), kHeaderBytes));
    }
    std::array<std::int32_t, 3> sizes = {};
    file.read(0, std::as_writable_bytes(std::span(sizes)));
    const auto described = fmt::format("{} x {} x {}", sizes[0], sizes[1], sizes[2]);
    std::uint64_t voxels = 1;
    for (const auto size : sizes) {
        if (size <= 0) {
            file.fail(
                fmt::format("the header says {}; every size must be positive (MERL: 90 x 90 x "
                            "180)",
                            described));
        }
        if (static_cast<std::uint64_t>(size) > kMaxSide) {
            file.fail(
                fmt::format("the header says {}; every size may be at most {} (MERL: 90 x 90 "
                            "x 180)",
                            described, kMaxSide));
        }
        voxels *= static_cast<std::uint64_t>(size);  // three factors, each checked: no overflow
        if (voxels > kMaxVoxels) {
            file.fail(
                fmt::format("the header says {}; at most {} voxels are supported (MERL: 90 x 90 "
                            "x 180)",
                            described, kMaxVoxels));
        }
    }
    const std::uint64_t expected = kHeaderBytes + voxels * 3 * sizeof(double);
    if (file.bytes() != expected) {
        file.fail(fmt::format("has {} bytes; its header ({}) makes {}, so it is {}", file.bytes(),
                              described, expected,
                              file.bytes() < expected ? "truncated" : "over-long"));
    }
    return {static_cast<std::uint32_t>(sizes[0]), static_cast<std::uint32_t>(sizes[1]),
            static_cast<std::uint32_t>(sizes[2])};
}

/// Whether a number may be used: finite and not above kMaxReflectance (negative: not measured).
bool acceptable(double value) {
    return std::abs(value) <= kMaxReflectance;
}

/// Multiplies in place. Whether every result is acceptable.
MERL_SCAN_WIDEST_VECTORS bool scale(std::span<double> samples, double factor) {
    std::uint64_t good = 0;  // counted, which becomes vector instructions
    for (double& value : samples) {
        value *= factor;
        good += std::abs(value) <= kMaxReflectance ? 1U : 0U;
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

Grid read_merl_header(const std::filesystem::path& path) {
    return checked_header(File(path));
}

void read_merl_samples(
    const std::filesystem::path& path, const Grid& grid, VoxelRange range,
    std::span<double> samples,
    const std::function<void(std::size_t plane, std::span<const std::byte>)>& raw) {
    const File file(path);
    if (checked_header(file) != grid) {
        file.fail(fmt::format("changed while it was read; its grid was {}", grid.text()));
    }
    for (std::size_t plane = 0; plane < 3; ++plane) {
        const auto to = samples.subspan(plane * range.size(), range.size());
        file.read(kHeaderBytes + (plane * grid.voxels() + range.first) * sizeof(double),
                  std::as_writable_bytes(to));
        if (raw) {
            raw(plane, std::as_bytes(to));
        }
        if (!scale(to, kMerlScale[plane])) {
            for (std::uint64_t i = 0; i < to.size(); ++i) {
                if (!acceptable(to[i])) {
                    fail_value(file, grid, plane, range.first + i, to[i]);
                }
            }
        }
    }
}

void write_merl_file(const std::filesystem::path& path, const Database& database,
                     std::size_t material) {
    const auto partial = std::filesystem::path(path.string() + ".partial");
    const auto fail = [&](const char* what) {
        const int code = errno;
        std::remove(partial.c_str());
        throw Error(Fault::output,
                    fmt::format("{}: {}: {}", path.string(), what, std::strerror(code)));
    };
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(
        std::fopen(partial.c_str(), "wbe"), [](std::FILE* f) { return std::fclose(f); });
    if (!file) {
        fail("cannot be created");
    }
    const auto& grid = database.grid();
    const Domain domain(grid);
    const std::array<std::uint32_t, 3> header = {grid.theta_h, grid.theta_d, grid.phi_d};
    std::vector<double> samples(grid.voxels() * 3);
    database.read(material, {0, grid.voxels()}, samples);
    for (std::uint64_t i = 0; i < grid.voxels(); ++i) {
        const bool measured = domain.voxel(i).above_horizon();
        for (std::size_t plane = 0; plane < 3; ++plane) {
            double& value = samples[plane * grid.voxels() + i];
            value = measured ? value / kMerlScale[plane] : kMerlNotMeasured;
        }
    }
    if (std::fwrite(header.data(), sizeof(header), 1, file.get()) != 1 ||
        std::fwrite(samples.data(), sizeof(double), samples.size(), file.get()) != samples.size() ||
        std::fclose(file.release()) != 0) {
        fail("cannot be written");
    }
    if (std::rename(partial.c_str(), path.c_str()) != 0) {
        fail("cannot be renamed into place");
    }
}

}  // namespace merl::reflectance
