#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

namespace merl::app {

// Arrays of float64 as NumPy stores them (format 1.0 of numpy.lib.format), row by row.

/// What the file of an array of these sides, two or more, begins with: so many bytes that numbers
/// after it are where vectors like them.
std::string npy_header(std::span<const std::uint64_t> sides);

/// What says that an array is the one that was written: hash_of() of its numbers, as they are in
/// the file. `progress` is called between pieces with the share done and may throw.
std::string hash_of_numbers(std::span<const double> numbers,
                            const std::function<void(double share)>& progress = {});

/// Such a file, mapped into memory as long as it lives.
class NpyFile {
  public:
    /// Throws InputError, which names the file, unless it is an array of these sides and as long as
    /// that.
    NpyFile(const std::filesystem::path& path, std::span<const std::uint64_t> sides);
    ~NpyFile();
    NpyFile(const NpyFile&) = delete;
    NpyFile& operator=(const NpyFile&) = delete;

    /// All numbers. Somebody who cuts the file short meanwhile ends the program.
    std::span<const double> numbers() const { return numbers_; }

  private:
    std::span<const std::byte> mapped_;
    std::span<const double> numbers_;
};

}  // namespace merl::app
