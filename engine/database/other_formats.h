#pragma once

#include <filesystem>
#include <string>

#include "engine/base/file.h"

namespace merl::engine {

// What people have where a database should be. Each gives words for the end of an error, "; it is
// compressed with gzip: unpack it", or nothing where it knows nothing.

/// What a file is that was refused, by its first bytes.
std::string known_as(const File& file);

/// Whether a file that known_as() does not know begins with text.
bool is_unknown_text(const File& file);

/// The same of a path, whatever it is.
std::string known_as(const std::filesystem::path& path);

/// What a directory is that has no file that could be read: one above that of a database, or one of
/// files in another format.
std::string directory_known_as(const std::filesystem::path& directory);

}  // namespace merl::engine
