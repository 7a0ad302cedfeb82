#include "app/output/npy_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "app/output/staging.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/text.h"

namespace merl::app {
namespace {

static_assert(std::endian::native == std::endian::little);

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
    throw InputError(fmt::format("{}: {}", path.string(), what));
}

}  // namespace

std::string npy_header(std::span<const std::uint64_t> sides) {
    constexpr std::size_t kAlignment = 64;
    constexpr std::string_view kMagic("\x93NUMPY\x01\x00", 8);
    const std::string shape = fmt::format(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}), }}", fmt::join(sides, ", "));
    const std::size_t bytes =
        (kMagic.size() + 2 + shape.size() + 1 + kAlignment - 1) / kAlignment * kAlignment;
    const std::size_t rest = bytes - kMagic.size() - 2;
    std::string header(kMagic);
    header += static_cast<char>(rest % 256);
    header += static_cast<char>(rest / 256);
    header += shape;
    header.resize(bytes - 1, ' ');
    return header + '\n';
}

std::string hash_of_numbers(std::span<const double> numbers,
                            const std::function<void(double share)>& progress) {
    constexpr std::size_t kPiece = 1U << 23U;  // 64 MiB
    Hash hash;
    for (std::size_t first = 0; first < numbers.size(); first += kPiece) {
        hash.update(
            std::as_bytes(numbers.subspan(first, std::min(kPiece, numbers.size() - first))));
        if (progress) {
            progress(static_cast<double>(first) / static_cast<double>(numbers.size()));
        }
    }
    return hash.hexadecimal();
}

NpyFile::NpyFile(const std::filesystem::path& path, std::span<const std::uint64_t> sides) {
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    struct stat state = {};
    if (file.get() < 0 || ::fstat(file.get(), &state) != 0) {
        fail(path, fmt::format("cannot be opened: {}", std::strerror(errno)));
    }
    if (!S_ISREG(state.st_mode)) {
        fail(path, "is no regular file");
    }
    const std::string expected = npy_header(sides);
    std::uint64_t count = 1;
    for (const auto side : sides) {
        count *= side;
    }
    const std::uint64_t bytes = expected.size() + count * sizeof(double);
    if (static_cast<std::uint64_t>(state.st_size) != bytes) {
        fail(path, fmt::format("found {} bytes; expected {}, of an array of {} numbers",
                               state.st_size, bytes, fmt::join(sides, " x ")));
    }
    void* const address = ::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, file.get(), 0);
    if (address == MAP_FAILED) {
        fail(path, fmt::format("cannot be mapped into memory: {}", std::strerror(errno)));
    }
    mapped_ = {static_cast<const std::byte*>(address), bytes};
    if (std::memcmp(address, expected.data(), expected.size()) != 0) {
        const std::string found(static_cast<const char*>(address), expected.size());
        ::munmap(address, bytes);
        fail(path,
             fmt::format(R"(found a header that begins with "{}"; expected "{}")",
                         printable(found.substr(0, 100)), printable(expected.substr(0, 100))));
    }
    numbers_ = {reinterpret_cast<const double*>(mapped_.data() + expected.size()), count};
}

NpyFile::~NpyFile() {
    ::munmap(const_cast<std::byte*>(mapped_.data()), mapped_.size());
}

}  // namespace merl::app
