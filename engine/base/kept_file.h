#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace merl {

// Files of a cache: what can be made again, and is kept to save the time. Nothing is said where
// that fails, and bytes that this did not write are not given to anybody.

/// What was kept in a file; nothing where there is none, or it is damaged, of another version, or
/// larger than `most` bytes.
std::optional<std::string> read_kept(const std::filesystem::path& file, std::uint64_t most);

/// Keeps bytes in a file, which appears complete or not at all and which its owner alone can read
/// and write. Makes the directory. Returns whether they were kept.
bool keep(const std::filesystem::path& file, std::string_view bytes);

}  // namespace merl
